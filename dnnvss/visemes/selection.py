"""How many dynamic visemes: what each number of units explains of gestures that were not used to learn them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.timing import FrameClock
from dnnvss.visemes.units import REST, Movement, Visemes, VisemeSettings, learn, shapes

_VARIANCE = 0.95  # share of the variance of gestures whose principal directions densities are measured in
_RIDGE = 1e-3  # share of the variance of all gestures that is added to the variance inside units


@dataclass(frozen=True)
class UnitCount:
    """What one number of units is worth.

    Args:
        units: the number asked for, rest included.
        used: the number that became of it, mean over the folds.
        likelihood: mean log density (nats) of a held-out gesture; the largest is the number to take.
        distortion: mean squared distance of held-out gestures from their unit, as a share of that from the mean of all.
    """

    units: int
    used: float
    likelihood: float
    distortion: float


def compare_units(clips: Sequence[Movement], clock: FrameClock, settings: VisemeSettings, candidates: Sequence[int],
                  view: np.ndarray | None = None, folds: int = 3) -> list[UnitCount]:
    """Return the worth of each number of units, by cross-validation over clips.

    In every fold units are learnt from the other clips. A held-out gesture that does not rest, brought to one length
    and projected on the principal directions of the training gestures, has the density of a mixture with one Gaussian a
    unit: the unit's mean, its share as weight, and one covariance for all (their members' scatter, and a small ridge).
    More units bring the means nearer and the scatter down as long as they stand for something that comes again.

    Args:
        clips: of the training utterances.
        clock: of their trajectories.
        settings: everything but the number of units.
        candidates: numbers of units to compare.
        view: see :func:`~dnnvss.visemes.units.learn`.
        folds: clips are dealt out in turns to so many parts.

    Raises:
        DnnvssError: fewer clips than folds, or too few gestures in a fold.
    """
    if folds < 2 or len(clips) < folds:
        raise DnnvssError(f"{len(clips)} clips cannot be held out in {folds} folds",
                          remedy="Give more clips or fewer folds")
    choices = []
    for units in candidates:
        scores = []
        for fold in range(folds):
            kept = [c for i, c in enumerate(clips) if i % folds != fold]
            visemes = learn(kept, clock, replace(settings, units=units), view)
            scores.append((len(visemes), *_held_out(visemes, kept, clips[fold::folds])))
        used, likelihood, distortion = np.mean(scores, axis=0).tolist()
        choices.append(UnitCount(units, used, likelihood, distortion))
    return choices


def _held_out(visemes: Visemes, kept: Sequence[Movement], held: Sequence[Movement]) -> tuple[float, float]:
    """Return the mean log density and the share of squared distance left of the gestures of held-out clips."""
    known, units = _moving(visemes, kept)
    new, _ = _moving(visemes, held)
    mean = known.mean(axis=0)
    _, sizes, directions = np.linalg.svd(known - mean, full_matrices=False)
    share = np.cumsum(sizes**2) / (sizes**2).sum()
    kept_directions = directions[: int(np.searchsorted(share, _VARIANCE)) + 1]
    known, new = ((x - mean) @ kept_directions.T for x in (known, new))
    counts = np.bincount(units)
    used = np.flatnonzero(counts)
    means = np.stack([known[units == u].mean(axis=0) for u in used])
    inside = known - means[np.searchsorted(used, units)]
    from scipy.special import logsumexp  # slow to import, and synthesis needs none of it

    ridge = _RIDGE * np.diag(known.var(axis=0))
    root = np.linalg.cholesky(inside.T @ inside / len(inside) + ridge)
    distances = ((np.linalg.solve(root, (new[:, None] - means[None]).reshape(-1, new.shape[1]).T)) ** 2).sum(0)
    densities = np.log(counts[used] / counts.sum()) - 0.5 * distances.reshape(len(new), -1)
    constant = 0.5 * new.shape[1] * np.log(2 * np.pi) + np.log(np.diag(root)).sum()
    nearest = ((new[:, None] - means[None]) ** 2).sum(2).min(1)
    return float((logsumexp(densities, axis=1) - constant).mean()), float(nearest.mean() / (new**2).sum(1).mean())


def _moving(visemes: Visemes, clips: Sequence[Movement]) -> tuple[np.ndarray, np.ndarray]:
    """Return the scaled gestures (G, R * D) of clips that do not rest, and their units (G,)."""
    rows, units = [], []
    for clip in clips:
        gestures = visemes.gestures(clip)
        found = shapes(clip.trajectory, gestures.edges, visemes.settings.length) * visemes.scale
        unit = visemes.classify(clip, gestures)
        rows.append(found[unit != REST].reshape((unit != REST).sum(), -1))
        units.append(unit[unit != REST])
    return np.concatenate(rows), np.concatenate(units)
