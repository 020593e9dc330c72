"""Sounds as they come in practice: in noise, through a telephone, with music under them, of another throat."""

from collections.abc import Sequence

import numpy as np

from dnnvss.acoustics.analysis import RATE

_PIECE, _ACTIVE = 320, 30.0  # samples of a piece, and dB below the loudest within which one is speech
_BAND = (300.0, 3400.0)  # Hz that a telephone lets through
_NOTE = 0.4  # seconds of a chord


def speech_power(samples: np.ndarray) -> float:
    """The mean power of speech (n,): of the 20 ms pieces within 30 dB of the loudest; 0 in silence."""
    whole = len(samples) // _PIECE * _PIECE
    power = (samples[:whole].reshape(-1, _PIECE).astype(float) ** 2).mean(axis=1)
    if not len(power) or not power.max():
        return 0.0
    return float(power[power > power.max() / 10 ** (_ACTIVE / 10)].mean())


def with_noise(samples: np.ndarray, noise: np.ndarray, decibels: float) -> np.ndarray:
    """Speech (n,) with noise (n,) under it, whose mean power is so many decibels below that of the speech."""
    own = float((noise.astype(float) ** 2).mean())
    if not own:
        return samples
    scale = np.sqrt(speech_power(samples) / own / 10 ** (decibels / 10))
    return (samples + scale * noise).astype(samples.dtype)


def white(rng: np.random.Generator, count: int) -> np.ndarray:
    """White noise (count,)."""
    return rng.normal(size=count)


def babble(rng: np.random.Generator, count: int, others: Sequence[np.ndarray], voices: int = 6) -> np.ndarray:
    """Several recordings of speech at once (count,), each of power 1 and begun anywhere.

    Args:
        rng: chooses them, and where they begin.
        count: samples.
        others: recordings (n,) to choose from.
        voices: how many are heard.
    """
    out = np.zeros(count)
    for index in rng.integers(0, len(others), voices):
        piece = np.resize(np.roll(others[index], rng.integers(0, len(others[index]))), count)
        out += piece / np.sqrt(speech_power(piece) + 1e-12)
    return out


def music(rng: np.random.Generator, count: int) -> np.ndarray:
    """Chords of three notes with five harmonics each (count,), a new one every 0.4 s, each dying away."""
    out, length = np.zeros(count), round(_NOTE * RATE)
    time = np.arange(length) / RATE
    for start in range(0, count, length):
        root = 110 * 2 ** (rng.integers(0, 24) / 12)
        chord = sum(np.sin(2 * np.pi * root * third * k * time + rng.uniform(0, 6)) / k
                    for third in (1, 2 ** (4 / 12), 2 ** (7 / 12)) for k in range(1, 6))
        out[start : start + length] = (chord * np.exp(-3 * time))[: count - start]
    return out


def telephone(samples: np.ndarray) -> np.ndarray:
    """Sound (n,) at 16 kHz as a telephone lets it through: 300 to 3400 Hz, by a Butterworth filter of order 4."""
    from scipy.signal import butter, sosfilt

    return sosfilt(butter(4, _BAND, "bandpass", fs=RATE, output="sos"), samples).astype(samples.dtype)


def altered(rng: np.random.Generator, samples: np.ndarray, others: Sequence[np.ndarray]) -> np.ndarray:
    """Speech (n,) as it might come another time: what befalls it is drawn, and may be nothing.

    Every third time another throat (0.85 to 1.2), three times in four noise at 0 to 20 dB (white or
    voices, half as often music), one time in five a telephone; always another level (-12 to 6 dB).

    Args:
        rng: draws.
        samples: of a recording.
        others: recordings that voices under it are taken from.
    """
    if rng.random() < 1 / 3:
        samples = another_throat(samples, rng.uniform(0.85, 1.2))
    if rng.random() < 0.75:
        samples = with_noise(samples, _some_noise(rng, len(samples), others), rng.uniform(0, 20))
    if rng.random() < 0.2:
        samples = telephone(samples)
    return (samples * 10 ** (rng.uniform(-12, 6) / 20)).astype(samples.dtype)


def _some_noise(rng: np.random.Generator, count: int, others: Sequence[np.ndarray]) -> np.ndarray:
    """Noise (count,) of a kind that is drawn; what covers consonants is drawn more often."""
    match rng.integers(5):
        case 0 | 1:
            return white(rng, count)
        case 2 | 3:
            return babble(rng, count, others)
        case _:
            return music(rng, count)


def another_throat(samples: np.ndarray, factor: float) -> np.ndarray:
    """Speech (n,) whose pitch and formants are a factor higher, as long as it was.

    The sound is resampled, and then laid out anew in pieces of 32 ms that overlap by half, each
    taken within 8 ms of its place where it fits the one before best.

    **Source**: Verhelst and Roelands 1993 (WSOLA).
    """
    if len(samples) < 4 * RATE // 100:
        return samples
    places = np.arange(0, len(samples) - 1, factor)
    quick = np.interp(places, np.arange(len(samples)), samples)
    return _stretched(quick, len(samples)).astype(samples.dtype)


def _stretched(samples: np.ndarray, count: int) -> np.ndarray:
    """The sound (n,) at another length (count,), with its own pitch."""
    size, hop, slack = 512, 256, 128
    window = np.hanning(size + 1)[:-1]
    padded = np.pad(samples, (slack, size + 2 * slack))
    out, last = np.zeros(count + size), np.zeros(size)
    for k, start in enumerate(range(0, count, hop)):
        place = min(round(start * len(samples) / count), len(samples)) + slack
        if k:
            near = padded[place - slack : place + slack + size]
            place += int(np.argmax(np.correlate(near, last, "valid"))) - slack
        out[start : start + size] += window * padded[place : place + size]
        last = padded[place + hop : place + hop + size]
        last = np.pad(last, (0, size - len(last)))
    return out[:count]
