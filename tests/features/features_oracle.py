"""A plain, slow, independent reading of Table 1: one frame, one column name, one answer at a time."""

import numpy as np

from dnnvss.phones import ANSWERS, PHONES, QUESTIONS, SILENCES
from dnnvss.timing import Alignment, FrameClock, Tier


def third(index: int, count: int) -> str:
    centre = (index + 0.5) / count
    return "start" if centre < 1 / 3 else "middle" if centre < 2 / 3 else "end"


class Reading:
    """Everything about one tier, as lists."""

    def __init__(self, tier: Tier, clock: FrameClock, frames: int) -> None:
        self.labels = list(tier.labels)
        self.edges = [min(int(e) - int(tier.frame_edges(clock)[0]), frames) for e in tier.frame_edges(clock)]
        self.edges[-1] = frames
        self.at = [next(i for i in range(len(self.labels)) if self.edges[i] <= t < self.edges[i + 1])
                   for t in range(frames)]

    def frame_label(self, t: int, outside: str | None) -> str | None:
        return self.labels[self.at[t]] if 0 <= t < len(self.at) else outside

    def segment_label(self, s: int, outside: str | None) -> str | None:
        return self.labels[s] if 0 <= s < len(self.labels) else outside


def classes(phone: str | None) -> set[str]:
    return {q.name for q, a in zip(QUESTIONS, ANSWERS[PHONES.index(str(phone))], strict=True) if a}


def unit_features(out: dict[str, float], unit: str, tier: Reading, t: int, window: list[int]) -> None:
    outside = "sil" if unit == "phone" else None
    s = tier.at[t]
    start, end = tier.edges[s], tier.edges[s + 1]
    out[f"centre_{unit}/{tier.labels[s]}"] = 1
    for k in window:
        if (label := tier.frame_label(t + k, outside)) is not None:
            out[f"{unit}_window/{k:+d}:{label}"] = 1
    for k in range(-2, 3):
        if (label := tier.segment_label(s + k, outside)) is not None:
            out[f"{unit}_context/{k:+d}:{label}"] = 1
    out[f"{unit}_position/{third(t - start, end - start)}"] = 1
    out[f"{unit}_frames/frames"] = end - start
    out[f"{unit}_span/frames"] = end - t
    out[f"{unit}_fraction/fraction"] = (t - start + 0.5) / (end - start)


def own_features(out: dict[str, float], tier: Reading, t: int) -> None:
    s = tier.at[t]
    for k in (-64, -48, -40, -32, -28, -24, -20, 20, 24, 28, 32, 40, 48, 64):
        out[f"phone_window_wide/{k:+d}:{tier.frame_label(t + k, 'sil')}"] = 1
    for k in (-12, -8, -4, -2, 2, 4, 8, 12):
        for name in classes(tier.frame_label(t + k, "sil")):
            out[f"class_window/{k:+d}:{name}"] = 1
    for k in (-2, -1, 1, 2):
        for name in classes(tier.segment_label(s + k, "sil")):
            out[f"class_context/{k:+d}:{name}"] = 1
        if 0 <= s + k < len(tier.labels):
            out[f"neighbour_frames/{k:+d}:frames"] = tier.edges[s + k + 1] - tier.edges[s + k]


def tree_features(out: dict[str, float], tree: object, s: int) -> None:
    for part, whole in [("phone", "syllable"), ("syllable", "word"), ("syllable", "phrase"), ("word", "phrase")]:
        index, count = getattr(tree, f"{part}_in_{whole}")[s], getattr(tree, f"{part}s_in_{whole}")[s]
        if index >= 0:
            out[f"{whole}_{part}_position/{third(index, count)}"] = 1
            out[f"{whole}_{part}s/{part}s"] = count
    for part in ("syllable", "word", "phrase"):
        if (index := getattr(tree, part)[s]) >= 0:
            out[f"utterance_{part}_position/{third(index, getattr(tree, part + 's'))}"] = 1


def viseme_features(out: dict[str, float], phones: Reading, visemes: Reading, tree: object, t: int) -> None:
    v = visemes.at[t]
    inside = range(phones.at[visemes.edges[v]], phones.at[visemes.edges[v + 1] - 1] + 1)
    out["viseme_phones/phones"] = sum(phones.labels[s] not in SILENCES for s in inside)
    syllable = tree.syllable[phones.at[t]]
    if syllable >= 0:
        within = [visemes.at[f] for f in range(len(phones.at)) if tree.syllable[phones.at[f]] == syllable]
        shared = range(min(within), max(within) + 1)
        out[f"syllable_viseme_position/{third(shared.index(v), len(shared))}"] = 1
        out["syllable_visemes/visemes"] = len(shared)


def dense(alignment: Alignment, tree: object, clock: FrameClock, columns: list[str], window: list[int]) -> np.ndarray:
    """Return the matrix (T, C) of the named columns; ``window`` holds the offsets of the window context."""
    edges = alignment["phones"].frame_edges(clock)
    frames = int(edges[-1] - edges[0])
    phones = Reading(alignment["phones"], clock, frames)
    visemes = Reading(alignment["visemes"], clock, frames) if "visemes" in alignment else None
    matrix = np.zeros((frames, len(columns)), np.float32)
    for t in range(frames):
        out: dict[str, float] = {f"acoustic_class/{name}": 1 for name in classes(phones.labels[phones.at[t]])}
        unit_features(out, "phone", phones, t, window)
        own_features(out, phones, t)
        tree_features(out, tree, phones.at[t])
        if visemes is not None:
            unit_features(out, "viseme", visemes, t, window)
            viseme_features(out, phones, visemes, tree, t)
        matrix[t] = [out.get(name, 0) for name in columns]
    return matrix
