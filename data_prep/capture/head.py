"""Rigid head motion: where a jig on the head is in each frame, by least squares."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from data_prep.capture.kalman import smoothed
from dnnvss.corpus.similarity import fit_similarity
from dnnvss.errors import DnnvssError
from dnnvss.timing import fill_invalid

_LEAST = 3
"""Markers that tell where a rigid body is."""
_FAR = 4.0
"""Millimetres by which a marker may leave the rigid jig; beyond, it is somewhere else."""
_SEEN = 0.5
"""Share of the frames in which the jig must be seen."""


@dataclass(frozen=True)
class HeadPose:
    """The pose of the head in each frame: a point ``p`` of the head is seen at ``turn p + shift``.

    Args:
        turn: rotations (F, 3, 3).
        shift: (F, 3) mm.
        left: RMS distance (F,) of the jig's markers from the rigid jig; NaN where it was not seen.
    """

    turn: np.ndarray
    shift: np.ndarray
    left: np.ndarray

    def taken_out(self, points: np.ndarray) -> np.ndarray:
        """Points (F, M, 3) of the room in the frame of the head."""
        return np.einsum("fij,fmi->fmj", self.turn, points - self.shift[:, None])

    @property
    def movement(self) -> tuple[float, float]:
        """Degrees and millimetres between the poses that lie farthest from the middle one."""
        middle = len(self.turn) // 2
        cosine = (np.einsum("fij,ij->f", self.turn, self.turn[middle]) - 1) / 2
        far = np.linalg.norm(self.shift - self.shift[middle], axis=1)
        return float(np.rad2deg(np.arccos(np.clip(cosine, -1, 1))).max()), float(far.max())


def jig_of(takes: Sequence[np.ndarray], rounds: int = 4) -> np.ndarray:
    """The rigid jig (J, 3) mm about its centroid, from its markers (F, J, 3) in several takes; NaN where missing.

    The generalised Procrustes mean without scale of frames in which all its markers are seen, median over frames.

    Raises:
        DnnvssError: it has fewer than three markers, or is never seen whole, or lies on a line.
    """
    whole = [take[np.isfinite(take).all(axis=(1, 2))] for take in takes]
    rows = (
        np.concatenate([take[:: max(1, len(take) // 60)] for take in whole])
        if whole
        else np.zeros((0, 0, 3))
    )
    if not len(rows) or rows.shape[1] < _LEAST:
        count = takes[0].shape[1] if takes else 0
        raise DnnvssError(
            f"the {count} markers of the jig are never seen together"
            if count >= _LEAST
            else f"the jig has {count} markers, and a pose needs {_LEAST}",
            remedy="Name the markers that sit on the head: corpus.importer.jig=[NAME, ...]",
        )
    jig = rows[0] - rows[0].mean(axis=0)
    for _ in range(rounds):
        pose = fit_similarity(rows, jig, rigid=True)
        jig = np.median(pose.back(rows, np.zeros(3)), axis=0)
        jig = jig - jig.mean(axis=0)
    spread = np.linalg.svd(jig, compute_uv=False)
    if spread[1] < 0.02 * spread[0]:
        raise DnnvssError(
            "the markers of the jig lie on a line, which does not tell how the head turns",
            remedy="Name more markers that sit on the head: corpus.importer.jig=[NAME, ...]",
        )
    return np.asarray(jig)


def find_head(seen: np.ndarray, jig: np.ndarray, rate: float) -> HeadPose:
    """The pose of the head in each frame of a take.

    The jig is fitted to the markers that are seen, without those that leave it; where they are missing it stands in
    for them; the whole jig is smoothed forward and backward and fitted again.

    Args:
        seen: (F, J, 3) mm, NaN where missing.
        jig: (J, 3) mm, rigid.
        rate: frames a second.

    Raises:
        DnnvssError: three markers are seen in less than half of the frames.
    """
    there = np.isfinite(seen).all(axis=2)
    turn, shift, left = (
        np.tile(np.eye(3), (len(seen), 1, 1)),
        np.zeros((len(seen), 3)),
        np.full(len(seen), np.nan),
    )
    for f in np.flatnonzero(there.sum(axis=1) >= _LEAST):
        turn[f], shift[f], left[f], there[f] = _fitted(seen[f], jig, there[f])
    known = np.isfinite(left)
    if known.mean() < _SEEN:
        raise DnnvssError(
            f"its jig is seen in {known.sum()} of {len(known)} frames",
            remedy="Leave the take out, or name other markers: corpus.importer.jig=[NAME, ...]",
        )
    stands = np.einsum("fij,mj->fmi", turn, jig) + shift[:, None]
    filled = np.where(there[..., None], seen, stands)
    filled = fill_invalid(filled, known)
    filled = smoothed(filled.reshape(len(seen), -1), rate).reshape(filled.shape)
    pose = fit_similarity(filled, jig, rigid=True)
    return HeadPose(pose.turn, pose.centre, left)


def _fitted(
    seen: np.ndarray, jig: np.ndarray, there: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
    """Rotation, shift, RMS error and the markers that were believed, of one frame (J, 3)."""
    kept = there.copy()
    while True:
        pose = fit_similarity(seen[None, kept], jig[kept], rigid=True)
        shift = pose.centre[0] - pose.turn[0] @ jig[kept].mean(axis=0)
        off = np.linalg.norm(seen - jig @ pose.turn[0].T - shift, axis=1)
        worst = int(np.where(kept, off, -1.0).argmax())
        if off[worst] <= _FAR or kept.sum() <= _LEAST:
            error = float(np.sqrt((off[kept] ** 2).mean()))
            return pose.turn[0], shift, error if error <= _FAR else float("nan"), kept
        kept[worst] = False
