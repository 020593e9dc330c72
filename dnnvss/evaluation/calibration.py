"""Do predicted variances mean what they say: the share of frames that fall inside each predicted interval."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError

LEVELS = np.linspace(0.05, 0.95, 19)


@dataclass(frozen=True)
class Calibration:
    """How a Gaussian prediction compares with what happened.

    Args:
        levels: shares that central intervals were asked to hold, (L,).
        held: shares that they held, (L, D).
        spread: standard deviation of the error over the predicted one, (D,): above 1 the model is too sure of itself.
        density: mean log density of the truth, (D,), natural logarithm, in the coefficients' unit.
    """

    levels: np.ndarray
    held: np.ndarray
    spread: np.ndarray
    density: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """The mean distance between shares asked for and held, (D,): 0 is calibrated, at most about 0.5."""
        return np.abs(self.held - self.levels[:, None]).mean(axis=0)


def calibration(
    references: Sequence[np.ndarray], means: Sequence[np.ndarray], variances: Sequence[np.ndarray],
    masks: Sequence[np.ndarray] | None = None,
) -> Calibration:
    """Return how well the predicted variances of the static stream fit, over all frames of all sentences.

    A frame is inside the interval of level q where ``|x - mean| <= z sqrt(variance)`` and z holds the central share q
    of a normal law.

    Args:
        references: measured parameters (T, D).
        means: predicted static means (T, D).
        variances: predicted static variances, which broadcast to (T, D).
        masks: (T,) bool, frames that count.

    Raises:
        DnnvssError: no frame, or a variance that is not positive.

    **Source**: Gneiting, Balabdaoui and Raftery, Probabilistic forecasts, calibration and sharpness (2007), section 3.
    """
    from scipy.special import ndtri  # slow to import; the quantile of the normal law

    kept = [np.ones(len(r), bool) for r in references] if masks is None else list(masks)
    rows = [((np.asarray(r, float) - m)[k], np.broadcast_to(np.asarray(v, float), r.shape)[k])
            for r, m, v, k in zip(references, means, variances, kept, strict=True)]
    error, variance = (np.concatenate([row[i] for row in rows]) for i in (0, 1))
    if not len(error) or not (variance > 0).all():
        raise DnnvssError("there is no frame, or a predicted variance is not positive",
                          remedy="Give Gaussian predictions of at least one frame")
    score = np.abs(error) / np.sqrt(variance)
    held = np.stack([(score <= ndtri(0.5 + level / 2)).mean(axis=0) for level in LEVELS])
    density = -0.5 * (np.log(2 * np.pi * variance) + error**2 / variance)
    return Calibration(LEVELS, held, np.sqrt((score**2).mean(axis=0)), density.mean(axis=0))


def plot_calibration(path: str | Path, systems: dict[str, Calibration], first: int = 5) -> Path:
    """Write a plot of shares held against shares asked for, averaged over the first coefficients, and return its
    path."""
    from matplotlib.figure import Figure  # slow to import, and not needed for the numbers

    figure = Figure(figsize=(4.6, 4.4), layout="constrained")
    axes = figure.add_subplot()
    axes.plot([0, 1], [0, 1], color="#98a2b3", linewidth=1, linestyle="--", label="calibrated")
    for name, c in systems.items():
        axes.plot(c.levels, c.held[:, :first].mean(axis=1), marker="o", markersize=3, linewidth=1.4, label=name)
    axes.set(xlim=(0, 1), ylim=(0, 1), xlabel="share asked for", ylabel="share held", aspect="equal")
    axes.legend(frameon=False, fontsize=8)
    with files.replacing(path) as temporary:
        figure.savefig(temporary, dpi=130)
    return Path(path)
