"""Principal components of many long rows."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Components:
    """Orthonormal modes (K, M), the standard deviation (K,) of each, and the total variance of the rows."""

    modes: np.ndarray
    deviations: np.ndarray
    total: float


def components(rows: np.ndarray, count: float, seed: int = 1, most: int = 200) -> Components:
    """Return the leading principal components of centred rows (F, M).

    ``rows`` must have mean zero already. Variances are divided by F. Each mode's largest element is positive, so that
    signs do not depend on the machine. A short side up to 500 is solved exactly, else by randomised subspace iteration.

    Args:
        count: number of modes, or the share of variance to keep if it is below 1.
        most: no more modes than this when a share is asked for.
    """
    total = float(np.einsum("fm,fm->", rows, rows, dtype=np.float64)) / len(rows)
    short = min(rows.shape)
    wanted = min(short, int(count) if count >= 1 else most)
    if short <= 500:
        _, values, modes = np.linalg.svd(rows, full_matrices=False)
        values, modes = values[:wanted], modes[:wanted]
    else:
        from sklearn.utils.extmath import randomized_svd  # slow to import, and synthesis needs none of it

        _, values, modes = randomized_svd(rows, wanted, n_oversamples=20, n_iter=4, random_state=seed)
    variance = values.astype(np.float64) ** 2 / len(rows)
    keep = variance > 1e-12 * max(total, 1e-300)
    if count < 1:
        keep &= np.concatenate([[True], np.cumsum(variance)[:-1] < count * total])
    modes, variance = modes[keep], variance[keep]
    signs = np.sign(modes[np.arange(len(modes)), np.abs(modes).argmax(axis=1)])
    return Components(modes * signs[:, None], np.sqrt(variance), total)
