"""Is a drawn face as lively as its talker? One tracker looks at held-out recordings and at what the run draws.

    python benchmarks/liveliness.py RUN [--split val] [--sentences 40] [--seeds 2] [--out FOLDER] [--most 1000]

The run says sentences that it never learnt from, at the recordings' phone times, with ``style.life=1``. In both videos
the face landmarker finds the points, from which blinks, the place of the brows and the pose of the head follow, and the
run's part model of the eyes is laid on the pictures. Means are over all sentences, intervals by bootstrap over them
(95 %). With ``--out`` each sentence is kept when it is done, and a command goes on from there; ``--most`` ends it after
so many new ones. The corpus has to have the landmarker's 146 points (GRID, or footage without landmarks).
"""

import argparse
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.evaluation.runs import open_corpus
from dnnvss.evaluation.videos import recorded, say
from dnnvss.face.aam import ActiveAppearanceModel
from dnnvss.face.landmarker import Landmarker, as_arrays, find_task, follow, mesh_groups
from dnnvss.face.pose import to_image, to_reference
from dnnvss.formats.tables import markdown_table
from dnnvss.life import CONTEXTS, Life, blink_threshold, find_blinks, speech_contexts
from dnnvss.render.living import eye_opening, head_track
from dnnvss.runs.run import Run
from dnnvss.style.generator import make_style
from dnnvss.timing import FrameClock, fill_invalid

MEASURES = ("blinks a minute", "length of a blink, ms", "blinks at ends of phrases, share", "eyes, deviation",
            "eyes, change a frame", "brows, deviation, px", "brows, change a frame, px", "head, deviation, px",
            "head, change a frame, px", "head's turn, deviation, degrees")
OF_BLINKS = 3
"""Measures that are of blinks. A few sentences in which the talker sits up hold most of the squares of movement."""
LATE = tuple(CONTEXTS.index(name) for name in ("phrase end", "after a phrase"))


class Seen:
    """What the tracker saw of a video: eyes' opening (F,), and tracks of eyes, brows and head."""

    def __init__(self, run: Run, life: Life, landmarker: Landmarker, pictures: Iterable[np.ndarray], rate: float
                 ) -> None:
        frames = list(pictures)
        face = run.face
        assert isinstance(face, ActiveAppearanceModel)
        tracks, count = follow(landmarker, frames)
        points, self.valid = as_arrays(tracks[0] if tracks else None, count)
        points = fill_invalid(points.astype(float), self.valid)
        reference, groups = face.reference, mesh_groups()
        pose = reference.poses(points[:, face.layout.stable], self.valid, rate)
        self.opening = eye_opening(face, points, self.valid)
        self.head = head_track(pose, face) * [1, 1, np.hypot(*pose[0, :2]), np.hypot(*pose[0, :2])]
        brows = np.concatenate([np.arange(*groups[name]) for name in ("right_brow", "left_brow")])
        self.brows = to_reference(points, pose, reference.pivot)[:, brows, 1].mean(axis=1, keepdims=True)
        at = to_image(life.model.region.points[None], pose, reference.pivot)
        self.eyes = life.model.code(np.stack([life.model.region.read(*pair) for pair in zip(frames, at, strict=True)]))


def sums(seen: Seen, threshold: float, context: np.ndarray, rate: float) -> np.ndarray:
    """Numerators and denominators (M, 2) of :data:`MEASURES` in one video."""
    blinks = find_blinks(seen.opening, threshold, rate)
    shut = np.convolve(seen.opening < threshold, np.ones(7), "same") > 0
    awake = seen.valid & ~shut
    late = sum(bool(np.isin(context[b.first], LATE)) for b in blinks)
    rows = [(60 * len(blinks), len(seen.opening) / rate), (1000 * sum(b.seconds for b in blinks), len(blinks)),
            (late, len(blinks))]
    for track, frames in ((seen.eyes, awake), (seen.brows, awake), (seen.head[:, 2:], seen.valid)):
        step = frames[1:] & frames[:-1]
        rows += [_root(track[frames] - track[frames].mean(axis=0)), _root(np.diff(track, axis=0)[step])]
    return np.array([*rows, _root(np.degrees(seen.head[seen.valid, 1:2]))], dtype=float)


def _root(track: np.ndarray) -> tuple[float, float]:
    """Squares and how many, whose mean's root is reported."""
    return float((track**2).sum()), float(len(track))


def means(rows: np.ndarray) -> np.ndarray:
    """The measures (M,) of rows (S, M, 2): of blinks over all sentences, of movement the median sentence's."""
    pooled = rows[..., 0].sum(axis=0) / np.maximum(rows[..., 1].sum(axis=0), 1e-9)
    median = np.median(np.sqrt(rows[..., 0] / np.maximum(rows[..., 1], 1e-9)), axis=0)
    return np.where(np.arange(len(pooled)) < OF_BLINKS, pooled, median)


def watch(run: Run, options: argparse.Namespace, landmarker: Landmarker) -> tuple[np.ndarray, np.ndarray]:
    """Rows (S, M, 2) of the talker's videos, and (S, M, 2) of those that are drawn, seeds added up."""
    done = options.out / f"liveliness-{options.split}-{options.seeds}.npz" if options.out else None
    kept = dict(np.load(done)) if done and done.is_file() else {}
    new = 0
    corpus, life = open_corpus(run.folder, run.settings.corpus_folder), run.life
    assert life is not None, "the run did not learn how eyes and head move"
    style, threshold = make_style(run.settings.style, run.face), blink_threshold(life.tracks.opening)
    assert threshold is not None, "the talker was never seen to blink"
    everything = [u for u in corpus.split(options.split, run.settings.split) if u.video]
    for utterance in everything[:: max(1, len(everything) // options.sentences)][: options.sentences]:
        if utterance.id in kept or new >= options.most:
            continue
        rate, clock = float(utterance.rate), FrameClock(utterance.rate)
        size = run.pictures().size
        seen = Seen(run, life, landmarker, recorded(corpus, utterance, size), rate)
        context = speech_contexts(utterance.alignment, utterance.text, clock, len(seen.opening) + 9)
        truth = sums(seen, threshold, context, rate)
        drawn = [Seen(run, life, landmarker, say(run, corpus, utterance, replace(style, life=1.0, seed=seed)).frames(),
                      rate) for seed in range(options.seeds)]
        kept[utterance.id] = np.stack([truth, np.sum([sums(s, threshold, context, rate) for s in drawn], axis=0)])
        new += 1
        if done:
            files.write_arrays(done, **kept)
    rows = np.stack(list(kept.values()))
    return rows[:, 0], rows[:, 1]


def table(truth: np.ndarray, made: np.ndarray) -> str:
    """Both, and one over the other with its interval, as Markdown."""
    random, ratios = np.random.default_rng(0), []
    for _ in range(1000):
        which = random.integers(len(truth), size=len(truth))
        ratios.append(means(made[which]) / np.maximum(means(truth[which]), 1e-9))
    low, high = np.percentile(ratios, [2.5, 97.5], axis=0)
    ours, theirs = means(made), means(truth)
    rows = [[name, f"{t:.3g}", f"{m:.3g}", f"{m / max(t, 1e-9):.2f}", f"{a:.2f} to {b:.2f}"]
            for name, t, m, a, b in zip(MEASURES, theirs, ours, low, high, strict=True)]
    return markdown_table(["", "talker", "drawn", "ratio", "95 %"], rows)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("--split", default="val")
    parser.add_argument("--sentences", type=int, default=40)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--most", type=int, default=1000)
    options = parser.parse_args()
    run = Run.open(options.run)
    truth, made = watch(run, options, Landmarker(find_task()))
    print(f"{len(truth)} sentences\n{table(truth, made)}")


if __name__ == "__main__":
    main()
