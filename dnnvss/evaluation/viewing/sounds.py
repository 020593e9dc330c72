"""The sound of a stimulus: cut, silent, or in noise of a level."""

import numpy as np

_FADE = 0.005
"""Seconds in which a cut sound comes and goes."""
_QUIET = 0.01
"""Share of the greatest power of a frame below which a frame counts as silence."""


def cut(samples: np.ndarray, rate: int, start: float, seconds: float, fade: bool) -> np.ndarray:
    """So many seconds of a sound (n,) from a time, with silence where there is none, faded where words are cut."""
    first, count = round(start * rate), round(seconds * rate)
    part = np.zeros(count, dtype=np.float32)
    given = samples[first:first + count]
    part[:len(given)] = given
    if fade and (length := min(round(_FADE * rate), count // 2)):
        ramp = np.linspace(0, 1, length, dtype=np.float32)
        part[:length] *= ramp
        part[-length:] *= ramp[::-1]
    return part


def in_noise(samples: np.ndarray, rate: int, level: float, seed: tuple[int, ...]) -> np.ndarray:
    """A sound (n,) in steady noise of its own spectrum, brought back to a peak of 0.9 where it is louder.

    Args:
        samples: the speech.
        rate: samples a second.
        level: of the speech over the noise in decibels, silence left out.
        seed: of the noise.
    """
    spectrum = np.fft.rfft(samples)
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(spectrum))
    noise = np.fft.irfft(np.abs(spectrum) * np.exp(1j * phase), len(samples))
    power = float((noise ** 2).mean())
    if power == 0:
        return samples
    wanted = speech_power(samples, rate) / 10 ** (level / 10)
    mixed = samples + noise * np.sqrt(wanted / power)
    peak = float(np.abs(mixed).max())
    return np.asarray(mixed * min(1.0, 0.9 / peak), dtype=np.float32)


def speech_power(samples: np.ndarray, rate: int) -> float:
    """Mean power of a sound (n,) over frames of 20 ms that are not silent."""
    size = max(1, rate // 50)
    whole = len(samples) // size
    if not whole:
        return float((samples ** 2).mean())
    frames = (samples[:whole * size].reshape(whole, size).astype(float) ** 2).mean(axis=1)
    return float(frames[frames >= _QUIET * frames.max()].mean())
