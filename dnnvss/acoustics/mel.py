"""The mel scale and its bands."""

from functools import lru_cache

import numpy as np

from dnnvss.acoustics.analysis import RATE


def transform_of(samples: int, least: int = 1) -> int:
    """Points of the Fourier transform: the power of two that a window of so many samples fits into."""
    return max(1 << (samples - 1).bit_length(), least)


@lru_cache
def mel_filters(bands: int, low: float, high: float, transform: int) -> np.ndarray:
    """Triangles (B, K) over the K points of a transform, equally spaced on the mel scale, of sum 1.

    The mel scale is ``2595 log10(1 + f / 700)``. A band between two points of the transform is zero.

    Args:
        bands: how many (B).
        low, high: Hz, where the lowest begins and the highest ends.
        transform: points of the Fourier transform, of which ``K = transform / 2 + 1`` are seen.
    """
    first, last = (2595 * np.log10(1 + f / 700) for f in (low, high))
    edges = 700 * (10 ** (np.linspace(first, last, bands + 2) / 2595) - 1)
    frequency = np.arange(transform // 2 + 1) * RATE / transform
    left, centre, right = edges[:-2, None], edges[1:-1, None], edges[2:, None]
    rising, falling = (frequency - left) / (centre - left), (right - frequency) / (right - centre)
    triangles = np.maximum(0, np.minimum(rising, falling))
    total = triangles.sum(axis=1, keepdims=True)
    return np.divide(triangles, total, out=np.zeros_like(triangles), where=total > 0)


def power(pieces: np.ndarray, window: np.ndarray, transform: int) -> np.ndarray:
    """The power spectrum (n, K) of windows (n, N): white noise of variance v has v everywhere.

    ``|X_k|^2 / sum_n w_n^2``, where ``X`` is the Fourier transform of the samples under ``w``.
    """
    return np.abs(np.fft.rfft(pieces * window, transform, axis=1)) ** 2 / (window**2).sum()


def emphasised(pieces: np.ndarray, factor: float) -> np.ndarray:
    """Windows (n, N) with the high frequencies raised: ``x_t - factor x_(t-1)``, and ``x_(-1) = x_0``."""
    return pieces - factor * np.concatenate([pieces[:, :1], pieces[:, :-1]], axis=1)
