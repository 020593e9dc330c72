"""The neutral frame: the picture of the talker into which the moving mouth is put."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from dnnvss import files, robust
from dnnvss.archives import Held, read_declared
from dnnvss.corpus import Corpus, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.face.aam import ActiveAppearanceModel, ClipCode
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.face.report import speech_span
from dnnvss.media import read_video

_FINALISTS = 12
"""Candidates whose pictures are read and compared for sharpness."""
_ARRAYS = {"image": Held(("H", "W", 3), "u"), "points": Held(("P", 2)), "pose": Held((4,)),
           "shape_offset": Held(("P", 2)), "texture_offset": Held(("N", 3)), "source": Held((), "U")}
_FIELDS = ("image", "points", "pose", "shape_offset", "texture_offset")


@dataclass(frozen=True)
class Neutral:
    """A frame of the talker at rest, with what places the model in it.

    Args:
        image: uint8 RGB (H, W_, 3).
        points: the model's points (P, 2) in its pixels.
        pose: head pose (4,) of :mod:`dnnvss.face.pose`.
        shape_offset, texture_offset: (P, 2) and (N, 3) of its clip.
        source: utterance and frame, e.g. ``"bbaf2n:3"``.
    """

    image: np.ndarray
    points: np.ndarray
    pose: np.ndarray
    shape_offset: np.ndarray
    texture_offset: np.ndarray
    source: str = ""

    def save(self, path: str | Path) -> Path:
        """Write the frame as ``.npz`` and return the path."""
        return files.write_arrays(path, source=np.array(self.source), **{f: getattr(self, f) for f in _FIELDS})

    @classmethod
    def load(cls, path: str | Path) -> "Neutral":
        """Return a frame that :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing or damaged.
        """
        arrays = read_declared(path, _ARRAYS, "Train again, or choose another run")
        image, points, pose, *offsets = (arrays[name] for name in _FIELDS)
        return cls(image, points, pose, offsets[0], offsets[1], str(arrays["source"]))


@dataclass(frozen=True)
class _Candidate:
    badness: float
    utterance: Utterance
    code: ClipCode
    frame: int


def choose_neutral(
    corpus: Corpus, encoded: EncodedCorpus, utterances: Sequence[str] | None = None, most: int = 200
) -> Neutral:
    """Return a frame at rest: silent, mouth as it mostly is in silence, eyes open, colours and pose as usual, sharp.

    Every criterion is measured against the others by median and median absolute deviation; the sharpest (variance of
    the Laplacian over the face) of the twelve best frames, each of another clip, is taken.

    Args:
        corpus: the prepared corpus.
        encoded: its encoding.
        utterances: ids to choose among; the train split where None.
        most: no more clips than this are looked at, evenly spaced.

    Raises:
        DnnvssError: no utterance was encoded, or the face has no texture.
    """
    model = encoded.face
    if not isinstance(model, ActiveAppearanceModel):
        raise DnnvssError(f"a face of the kind {model.kind} has no neutral frame", file=encoded.folder)
    ids = [i for i in (utterances or encoded.splits["train"]) if i not in encoded.dropped]
    ids = ids[::max(1, len(ids) // most)]
    codes = {i: code for i in ids if isinstance(code := encoded.clip(i), ClipCode)}
    codes = {i: code for i, code in codes.items() if _rest_frames(corpus.utterances[i], code).any()}
    if not codes:
        raise DnnvssError("no utterance has a valid frame to render upon", file=encoded.folder)
    best = sorted(_candidates(model, corpus, codes), key=lambda c: c.badness)[:_FINALISTS]
    pictured = [(c, read_video(corpus.path(c.utterance, "video"))[c.frame]) for c in best]
    chosen, image = max(pictured, key=lambda pair: _sharpness(model, pair[0].code, pair[0].frame, pair[1]))
    points, _ = corpus.landmarks(chosen.utterance)
    code, own = chosen.code, points[chosen.frame, model.layout.rows].astype(np.float64)
    return Neutral(image, own, code.pose[chosen.frame], code.shape_offset, code.texture_offset,
                   f"{chosen.utterance.id}:{chosen.frame}")


def _rest_frames(utterance: Utterance, code: ClipCode) -> np.ndarray:
    """Return the valid silent frames (F,), or all valid ones where none is silent."""
    silent = np.ones(len(code.valid), dtype=bool)
    silent[speech_span(utterance, len(silent))] = False
    return code.valid & silent if (code.valid & silent).any() else code.valid


def _candidates(model: ActiveAppearanceModel, corpus: Corpus, codes: dict[str, ClipCode]) -> list[_Candidate]:
    """Return each clip's best frame with the sum of its robust distances from the usual."""
    rest = {i: np.flatnonzero(_rest_frames(corpus.utterances[i], code)) for i, code in codes.items()}
    usual = np.median(np.concatenate([codes[i].parameters[f] for i, f in rest.items()]), axis=0)
    centre = np.median(np.concatenate([codes[i].pose[f] for i, f in rest.items()]), axis=0)
    colour = np.median([code.texture_offset.mean(axis=0) for code in codes.values()], axis=0)
    rows, owners = [], []
    for i, frames in rest.items():
        code = codes[i]
        away = np.sqrt((((code.parameters[frames] - usual) / model.deviations) ** 2).mean(axis=1))
        turned = np.linalg.norm((code.pose[frames] - centre) * [60, 60, 1, 1], axis=1)
        tint = np.full(len(frames), np.linalg.norm(code.texture_offset.mean(axis=0) - colour))
        bent = np.full(len(frames), np.sqrt((code.shape_offset**2).mean()))
        shut = -_eye_opening(model, corpus, corpus.utterances[i])[frames]
        rows.append(np.column_stack([away, turned, tint, bent, shut]))
        owners += [(i, int(f)) for f in frames]
    badness = _standardised(np.concatenate(rows))
    best: dict[str, _Candidate] = {}
    for value, (i, frame) in zip(badness, owners, strict=True):
        if i not in best or value < best[i].badness:
            best[i] = _Candidate(float(value), corpus.utterances[i], codes[i], frame)
    return list(best.values())


def _standardised(rows: np.ndarray) -> np.ndarray:
    """Return each row's sum of excesses over the columns' medians, in robust deviations; the first counts twice."""
    centred = rows - np.median(rows, axis=0)
    spread = np.maximum(robust.spread(centred), 1e-6)
    weights = np.array([2.0] + [1.0] * (rows.shape[1] - 1))
    return (np.maximum(centred / spread, -1.0) * weights).sum(axis=1)


def _eye_opening(model: ActiveAppearanceModel, corpus: Corpus, utterance: Utterance) -> np.ndarray:
    """Return height over width (F,) of the eyes' landmarks, the smaller of the two; zeros where there are none."""
    points, _ = corpus.landmarks(utterance)
    ratios = [np.ptp(points[:, rows, 1], axis=1) / np.maximum(np.ptp(points[:, rows, 0], axis=1), 1e-6)
              for rows in model.layout.eyes]
    return np.min(ratios, axis=0) if ratios else np.zeros(len(points))


def _sharpness(model: ActiveAppearanceModel, code: ClipCode, frame: int, image: np.ndarray) -> float:
    """Return the variance of the Laplacian over the box of the model's points and the stable ones."""
    points = np.concatenate([model.mean_shape, model.reference.stable])
    box = model.place(points, code.pose[frame])
    (left, top), (right, bottom) = box.min(axis=0).astype(int), np.ceil(box.max(axis=0)).astype(int)
    grey = cv2.cvtColor(image[max(top, 0):bottom, max(left, 0):right], cv2.COLOR_RGB2GRAY)
    return float(cv2.Laplacian(grey, cv2.CV_64F).var()) if grey.size else 0.0
