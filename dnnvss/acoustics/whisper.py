"""The front end of Whisper: log-mel energies as its encoder was trained on them."""

from functools import lru_cache

import numpy as np

from dnnvss.acoustics.analysis import RATE

BANDS, HOP = 80, 160
"""Mel bands, and samples from one row to the next."""
_SIZE = 400  # samples of a window, and points of its transform
_RANGE = 8.0  # decades that are seen below the loudest


def encoder_input(samples: np.ndarray) -> np.ndarray:
    """The input (80, n // 160) float32 of the encoder for samples (n,) at 16 kHz, more than 200.

    ``(max(log10 max(E, 1e-10), L - 8) + 4) / 4``, where ``E`` is the power in mel bands of 25 ms
    under a Hann window around every 160th sample and ``L`` the highest logarithm of all; the ends
    of the sound are mirrored.

    **Source**: Radford et al. 2022, section 2.2, and the code that is published with it.
    """
    padded = np.pad(samples.astype(np.float64), _SIZE // 2, mode="reflect")
    windows = np.lib.stride_tricks.sliding_window_view(padded, _SIZE)[::HOP][: len(samples) // HOP]
    power = np.abs(np.fft.rfft(windows * np.hanning(_SIZE + 1)[:-1], axis=1)) ** 2
    logarithm = np.log10(np.maximum(power @ _filters().T, 1e-10))
    return ((np.maximum(logarithm, logarithm.max() - _RANGE) + 4) / 4).T.astype(np.float32)


@lru_cache
def _filters() -> np.ndarray:
    """Triangles (80, 201), each with the area 1 in Hz, equally spaced on the scale of Slaney 1998.

    It is linear up to 1 kHz (200 / 3 Hz a mel) and logarithmic above (27 mels for a factor of 6.4).
    """
    top = 15 + 27 * np.log(RATE / 2 / 1000) / np.log(6.4)
    mels = np.linspace(0, top, BANDS + 2)
    edges = np.where(mels < 15, mels * 200 / 3, 1000 * 6.4 ** ((mels - 15) / 27))
    left, centre, right = edges[:-2, None], edges[1:-1, None], edges[2:, None]
    frequency = np.arange(_SIZE // 2 + 1) * RATE / _SIZE
    rising, falling = (frequency - left) / (centre - left), (right - frequency) / (right - centre)
    return np.maximum(0, np.minimum(rising, falling)) * 2 / (right - left)
