"""Cepstra for alignment: what the sound is like every five milliseconds."""

from functools import lru_cache

import numpy as np

from dnnvss.media import SPEECH_RATE

HOP = 0.005
"""Seconds from one frame to the next; frame ``k`` is centred at ``(k + 0.5) * HOP``."""

_WINDOW, _BINS, _MELS, _CEPSTRA, _SPAN = 0.020, 512, 26, 13, 4


def cepstra(audio: np.ndarray) -> np.ndarray:
    """Return mel cepstra with their slopes and curvatures, mean removed, float32, shape (T, 39), 200 frames a second.

    Windows of 20 ms, pre-emphasis 0.97, 26 mel bands from 60 to 7600 Hz, 13 cepstra, slopes by regression over nine
    frames.

    Args:
        audio: (n,) in [-1, 1] at 16 kHz; T is n // 80.
    """
    hop, window = round(HOP * SPEECH_RATE), round(_WINDOW * SPEECH_RATE)
    noise = np.random.default_rng(0).normal(0, 1e-4, len(audio))  # digital silence has no logarithm
    sound = audio.astype(float) + noise
    sound[1:] -= 0.97 * sound[:-1]
    count = len(audio) // hop
    padded = np.pad(sound, (window // 2, window))
    frames = padded[np.arange(count)[:, None] * hop + hop // 2 + np.arange(window)]
    power = np.abs(np.fft.rfft(frames * np.hamming(window), _BINS)) ** 2
    from scipy.fft import dct  # slow to import

    static = dct(np.log(power @ _mel_bands().T + 1e-6), norm="ortho", axis=1)[:, :_CEPSTRA]
    slope = _slope(static)
    features = np.hstack([static, slope, _slope(slope)])
    return (features - features.mean(axis=0)).astype(np.float32)


def _slope(x: np.ndarray) -> np.ndarray:
    padded = np.pad(x, ((_SPAN, _SPAN), (0, 0)), "edge")
    rows = len(x)
    steps = range(1, _SPAN + 1)
    total = sum(k * (padded[_SPAN + k : _SPAN + k + rows] - padded[_SPAN - k : _SPAN - k + rows]) for k in steps)
    return np.asarray(total / (2 * sum(k * k for k in steps)))


@lru_cache(maxsize=1)
def _mel_bands() -> np.ndarray:
    """Return triangular bands (26, 257) equally spaced on the mel scale, 2595 log10(1 + f / 700)."""
    low, high = (2595 * np.log10(1 + f / 700) for f in (60.0, 7600.0))
    edges = 700 * (10 ** (np.linspace(low, high, _MELS + 2) / 2595) - 1)
    frequency = np.arange(_BINS // 2 + 1) * SPEECH_RATE / _BINS
    left, centre, right = edges[:-2, None], edges[1:-1, None], edges[2:, None]
    return np.maximum(0, np.minimum((frequency - left) / (centre - left), (right - frequency) / (right - centre)))
