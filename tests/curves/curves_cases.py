"""Dense oracles that several tests of this room share."""

import numpy as np

from dnnvss.curves import Windows


def window_matrix(frames: int, windows: Windows) -> np.ndarray:
    """Return W (T * W, T), written down entry by entry."""
    matrix = np.zeros((frames, len(windows), frames))
    for t in range(frames):
        for w, taps in enumerate(windows.taps):
            for s, weight in enumerate(taps):
                matrix[t, w, min(max(t + s - len(taps) // 2, 0), frames - 1)] += weight
    return matrix.reshape(-1, frames)


def dense_mlpg(mean: np.ndarray, variance: np.ndarray, windows: Windows) -> np.ndarray:
    """Solve the normal equations (T, T) of each column with numpy."""
    frames, _, columns = mean.shape
    matrix = window_matrix(frames, windows)
    x = np.empty((frames, columns))
    for d in range(columns):
        precision = 1 / np.broadcast_to(variance, mean.shape)[:, :, d].ravel()
        x[:, d] = np.linalg.solve(matrix.T * precision @ matrix, matrix.T @ (precision * mean[:, :, d].ravel()))
    return x


def dense_normal_matrix(variance: np.ndarray, windows: Windows) -> np.ndarray:
    """Return W' V^-1 W of all columns, (T * D, T * D), the trajectory read frame by frame; variance (T, W, D)."""
    frames, _, columns = variance.shape
    matrix = window_matrix(frames, windows)
    normal = np.zeros((frames * columns, frames * columns))
    for d in range(columns):
        normal[d::columns, d::columns] = matrix.T * (1 / variance[:, :, d].ravel()) @ matrix
    return normal
