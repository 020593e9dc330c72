"""The built-in voice: a small source-filter formant synthesiser that speaks any alignment exactly.

A train of glottal pulses and noise of breath pass a cascade of formant resonators (Klatt, *Software for a
cascade/parallel formant synthesizer*, J. Acoust. Soc. Am. 67(3), 1980); frication and bursts are noise shaped in
parallel. Formants glide between the targets of :mod:`dnnvss.speech.formant_table`, consonant targets lean toward their
vowels (locus equations), and pitch falls over each phrase with a rise on the longer vowels.
"""

import tempfile
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.phones import SILENCES
from dnnvss.speech.formant_table import NOISES, Sound, sound
from dnnvss.timing import Alignment, FrameClock, Tier

_STEP = 0.0025  # seconds between updates of the filters
_GLIDE = 0.038  # seconds that formants take from a consonant to its vowel, at most
_BURST, _BREATH = 0.012, 0.055  # seconds of a stop's burst, and of the breath after a voiceless one
_UPPER = ((3400.0, 200.0), (4300.0, 280.0), (5300.0, 350.0), (6400.0, 450.0), (7500.0, 600.0))
_NASAL_POLE = 270.0
_PEAK = 0.6
_LONG, _LONGER, _LONGEST = 30.0, 40.0, 50.0
"""Seconds after which speech is cut in a pause, before a voiceless stop, and anywhere."""
_PAUSE = 10.0  # seconds of silence at once
_HELD = 900.0  # seconds of speech from which it lies in a file without a name, not in memory
_BLOCK = 1 << 20  # samples that are looked at at once


class _Piece(NamedTuple):
    """A spoken phone with its sound, its times in seconds, and the F2 of the nearest vowel on either side."""

    start: float
    end: float
    phone: str
    sound: Sound
    before: float
    after: float
    breathy: bool  # a voiceless stop whose release is aspirated


def synthesise(alignment: Alignment, rate: int = 16000, seed: int = 0, f0: float = 110.0) -> np.ndarray:
    """Return speech for an alignment, float32 in [-1, 1], shape (n,), n being the samples between its ends.

    A quarter of an hour and more is mapped from a file without a name, see :func:`dnnvss.files.mapped`.

    Args:
        alignment: with the tier ``phones``; every phone sounds exactly where it stands.
        rate: samples a second, 8000 to 48000.
        seed: of the noise and of the voice's small irregularities.
        f0: mean pitch in Hz, 50 to 400; above 160 the vocal tract is made a seventh shorter.

    Raises:
        DnnvssError: a phone is unknown, or rate or pitch are out of range.
    """
    if not 8000 <= rate <= 48000 or not 50 <= f0 <= 400:
        raise DnnvssError(f"cannot speak at {rate} samples a second and a pitch of {f0} Hz",
                          remedy="Give rate=8000 to 48000 and f0=50 to 400")
    tiers = parts(alignment["phones"])
    if len(tiers) == 1:
        return _loud(_spoken(alignment, rate, np.random.default_rng(seed), f0)).astype(np.float32)
    spoken = (_spoken(Alignment([tier]), rate, np.random.default_rng([seed, k]), f0).astype(np.float32)
              for k, tier in enumerate(tiers))
    if alignment.end - alignment.start < _HELD:
        return _loud(np.concatenate(list(spoken)))
    return _loud(files.mapped(spoken, tempfile.gettempdir()))


def parts(phones: Tier) -> list[Tier]:
    """A tier of phones in parts that are spoken one by one: an hour of speech takes the memory of half a minute.

    They end in the middle of a pause where there is one, else where the closure of a voiceless stop begins, which is
    silent too, else with any phone.
    """
    found, own = list[Tier](), list[tuple[float, float, str]]()
    for start, end, label in _short_pauses(phones):
        cut = (start + end) / 2 if label in SILENCES else start
        quiet = label in SILENCES or (sound(label).kind in ("stop", "affricate") and not sound(label).voice)
        length = start - own[0][0] if own else 0.0
        if own and (length > _LONG if label in SILENCES else length > _LONGER if quiet else length > _LONGEST):
            if cut > start:
                own.append((start, cut, label))
            found.append(Tier(phones.name, own))
            own, start = [], cut
        own.append((start, end, label))
    return [*found, Tier(phones.name, own)] if found else [phones]


def _short_pauses(phones: Tier) -> Iterator[tuple[float, float, str]]:
    """The segments of a tier, pauses that last for long in several."""
    for start, end, label in phones:
        count = 1 if label not in SILENCES else int(np.ceil((end - start) / _PAUSE))
        edges = np.linspace(start, end, count + 1).tolist()
        yield from ((a, b, label) for a, b in pairwise([start, *edges[1:-1], end]))


def _loud(spoken: np.ndarray) -> np.ndarray:
    """The samples, changed in place, at their usual peak."""
    blocks = [spoken[k : k + _BLOCK] for k in range(0, len(spoken), _BLOCK)]
    peak = 1e-9
    for block in blocks:
        peak = max(peak, float(block.max(initial=0.0)), -float(block.min(initial=0.0)))
        files.forget(block)
    for block in blocks:
        block *= _PEAK / peak
        files.forget(block)
    return spoken


def _spoken(alignment: Alignment, rate: int, rng: np.random.Generator, f0: float) -> np.ndarray:
    """Speech (n,) for an alignment, of any loudness."""
    edges = FrameClock(rate).edges(np.array([alignment.start, alignment.end]))
    count = int(edges[1] - edges[0])
    pieces = _pieces(alignment)
    if not pieces or not count:
        return np.zeros(count)
    times = alignment.start + (np.arange(count) + 0.5) / rate
    pulses, opening = _voice(_pitch(pieces, alignment, times, f0, rng), rate, rng)
    voicing, breath = _track(times, _voicing(pieces)), _track(times, _breath(pieces))
    source = pulses * voicing + rng.standard_normal(count) * breath * 0.25
    spoken = _filtered(source, pieces, alignment.start, rate, 1.14 if f0 > 160 else 1.0)
    spoken += _noise(pieces, times, voicing, opening, rate, rng)
    return spoken


def _pieces(alignment: Alignment) -> list[_Piece]:
    segments = list(alignment["phones"])
    sounds = [None if s.label in SILENCES else sound(s.label) for s in segments]
    before, after = _nearest_f2(sounds, "end"), _nearest_f2(sounds[::-1], "start")[::-1]
    pieces = []
    for i, (segment, own) in enumerate(zip(segments, sounds, strict=True)):
        if own is None:
            continue
        following = segments[i + 1].label if i + 1 < len(segments) else "sil"
        previous = segments[i - 1].label if i else "sil"
        breathy = own.kind == "stop" and not own.voice and previous != "S" and (
            following in SILENCES or sound(following).voice > 0.5)
        pieces.append(_Piece(*segment, own, before[i], after[i], breathy))
    return pieces


def _nearest_f2(sounds: list[Sound | None], side: str) -> list[float]:
    """For each sound F2 in Hz of the last vowel or glide before it, 1450 where a silence is nearer."""
    found, last = [], 1450.0
    for own in sounds:
        found.append(last)
        if own is None:
            last = 1450.0
        elif own.kind in ("vowel", "glide"):
            last = float(getattr(own, side)[1])
    return found


def _release(piece: _Piece) -> float:
    """Return when the closure of a stop or affricate opens, in seconds."""
    length = piece.end - piece.start
    if piece.sound.kind == "affricate":
        return piece.end - 0.6 * length
    return piece.end - min(0.6 * length, _BURST + (_BREATH if piece.breathy else 0.005))


def pitch(alignment: Alignment, times: np.ndarray, f0: float = 110.0, seed: int = 0) -> np.ndarray:
    """Return the built-in voice's pitch in Hz (n,) at times in seconds (n,), increasing."""
    return _pitch(_pieces(alignment), alignment, times, f0, np.random.default_rng(seed))


# ---- tracks: rows of (start, end, value) that are joined by short ramps ----------------------------------------------


def _track(times: np.ndarray, rows: list[tuple[float, float, float]], ramp: float = 0.006) -> np.ndarray:
    """Return a curve (n,) that has each row's value between its times, 0 elsewhere, with ramps of some milliseconds."""
    from scipy.ndimage import uniform_filter1d  # slow to import, and needed by this voice alone

    rate = 1 / (times[1] - times[0]) if len(times) > 1 else 1.0
    curve = np.zeros(len(times))
    for start, end, value in rows:
        curve[_between(times, start, end)] = value
    width = max(int(ramp * rate), 1)
    return uniform_filter1d(uniform_filter1d(curve, width, mode="constant"), width, mode="constant")


def _between(times: np.ndarray, start: float, end: float) -> slice:
    """Where times in order are from ``start`` up to, and not at, ``end``."""
    first, last = np.searchsorted(times, (start, end))
    return slice(int(first), int(last))


def _voicing(pieces: list[_Piece]) -> list[tuple[float, float, float]]:
    rows = []
    for p in pieces:
        if p.sound.kind in ("stop", "affricate"):
            rows.append((p.start, _release(p), p.sound.voice))
            rows.append((_release(p), p.end, p.sound.voice * 1.5))
        else:
            rows.append((p.start, p.end, p.sound.voice))
    return rows


def _breath(pieces: list[_Piece]) -> list[tuple[float, float, float]]:
    """Return the breath: of HH, of voiceless stops after their burst, and a little in every voiced sound."""
    rows = []
    for p in pieces:
        if p.sound.kind == "aspirate":
            rows.append((p.start, p.end, 0.5))
        elif p.breathy:
            rows.append((_release(p) + _BURST / 2, p.end, 0.45))
        elif p.sound.voice > 0.5:
            rows.append((p.start, p.end, 0.015))
    return rows


def _noise(pieces: list[_Piece], times: np.ndarray, voicing: np.ndarray, opening: np.ndarray, rate: int,
           rng: np.random.Generator) -> np.ndarray:
    """Return frication and bursts (n,); in voiced sounds the noise comes and goes with the glottal opening."""
    rows: dict[str, list[tuple[float, float, float]]] = {}
    for p in pieces:
        if not p.sound.noise:
            continue
        name, start, end = p.sound.noise, p.start, p.end
        if p.sound.kind in ("stop", "affricate"):
            start = _release(p)
            end = end if p.sound.kind == "affricate" else min(p.end, start + _BURST)
        if name == "burst-velar" and (p.after if p.after != 1450.0 else p.before) > 1600:
            name = "burst-palatal"
        rows.setdefault(name, []).append((start, end, p.sound.hiss))
    total = np.zeros(len(times))
    modulation = np.where(voicing > 0.1, 0.4 + 1.2 * opening, 1.0)
    for name in sorted(rows):
        ramp = 0.002 if name.startswith("burst") else 0.012
        total += _shaped(rng.standard_normal(len(times)), name, rate) * _track(times, rows[name], ramp) * modulation
    return total * 0.6


def _shaped(noise: np.ndarray, name: str, rate: int) -> np.ndarray:
    """Return noise (n,) with the spectrum of that name, at a root mean square of about 1."""
    from scipy.signal import iirpeak, lfilter  # slow to import, and needed by this voice alone

    bands = [(f, width, gain) for f, width, gain in NOISES[name] if f < 0.46 * rate]
    out = np.zeros(len(noise))
    for f, width, gain in bands or [(0.4 * rate, 1000.0, 0.5)]:
        b, a = iirpeak(f, f / width, fs=rate)
        band = lfilter(b, a, noise)
        out += gain * band / np.sqrt(2 * width / rate)
    return out


# ---- the voice -------------------------------------------------------------------------------------------------------


def _pitch(pieces: list[_Piece], alignment: Alignment, times: np.ndarray, f0: float,
           rng: np.random.Generator) -> np.ndarray:
    """Return pitch in Hz (n,): a fall over each stretch between silences, raised on longer vowels, low at the end."""
    curve = np.ones(len(times))
    silent = [(s.start, s.end) for s in alignment["phones"] if s.label in SILENCES and s.duration > 0.05]
    bounds = [alignment.start, *[t for pair in silent for t in pair], alignment.end]
    for start, end in zip(bounds[::2], bounds[1::2], strict=True):
        inside = _between(times, start, end)
        along = (times[inside] - start) / max(end - start, 1e-6)
        curve[inside] = 1.14 - 0.24 * along - 0.14 * np.clip((along - 0.85) / 0.15, 0, 1)
    for p in pieces:
        if p.sound.kind == "vowel" and p.phone not in ("AH", "IH", "ER"):
            centre, width = p.start + 0.4 * (p.end - p.start), 0.07
            near = slice(*np.searchsorted(times, (centre - 6 * width, centre + 6 * width)))
            rise = np.exp(-0.5 * ((times[near] - centre) / width) ** 2)
            curve[near] += min(0.13, 0.9 * (p.end - p.start)) * rise
    slow = np.interp(times, np.arange(times[0], times[-1] + 0.2, 0.1),
                     rng.standard_normal(len(np.arange(times[0], times[-1] + 0.2, 0.1))))
    return f0 * curve * (1 + 0.008 * slow)


def _voice(pitch: np.ndarray, rate: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return the derivative of glottal flow (n,), about 1 at its largest, and the opening of the glottis (n,) 0 to 1.

    **Source**: the polynomial pulse of Rosenberg (J. Acoust. Soc. Am. 49(2B), 1971), open for 60 % of the period.
    """
    from scipy.signal import resample_poly

    fine = 4  # the pulse's sharp edge is made at four times the rate and then filtered, else it would alias
    phase = np.cumsum(np.repeat(pitch, fine)) / (rate * fine)
    cycle = np.floor(phase).astype(int)
    strength = 1 + 0.04 * rng.standard_normal(cycle[-1] + 1)
    x = (phase - cycle) / 0.6
    flow = np.where(x < 1, 6.75 * x**2 * (1 - x), 0.0)
    slope = np.where(x < 1, x * (2 - 3 * x), 0.0) * strength[cycle]
    pulses = resample_poly(slope, 1, fine)
    return pulses[: len(pitch)], flow[::fine]


# ---- the vocal tract -------------------------------------------------------------------------------------------------


def _targets(pieces: list[_Piece]) -> tuple[np.ndarray, np.ndarray]:
    """Return times (k,) and formants F1 to F3 in Hz (k, 3) between which the tract moves."""
    points: list[tuple[float, tuple[float, ...]]] = []
    for p in pieces:
        length, own = p.end - p.start, p.sound
        if own.kind == "aspirate":
            continue  # breath takes the shape of its neighbours
        if own.kind == "vowel":
            glide = min(_GLIDE, 0.35 * length)
            steady = 0.0 if own.start == own.end else 0.15 * length
            points += [(p.start + glide, own.start), (p.start + glide + steady, own.start), (p.end - glide, own.end)]
        else:
            inset = 0.3 * length if own.kind == "glide" else 0.0
            for time, vowel in ((p.start + inset, p.before), (p.end - inset, p.after)):
                f1, f2, f3 = own.start
                points.append((time, (f1, f2 + own.pull * (vowel - f2), f3)))
    if not points:
        points = [(0.0, (500.0, 1450.0, 2500.0))]
    points.sort(key=lambda point: point[0])
    return np.array([t for t, _ in points]), np.array([f for _, f in points], dtype=float)


def _formants(pieces: list[_Piece], times: np.ndarray) -> np.ndarray:
    from scipy.ndimage import gaussian_filter1d

    at, values = _targets(pieces)
    curves = np.stack([np.interp(times, at, values[:, k]) for k in range(3)], axis=1)
    return gaussian_filter1d(curves, 0.009 / _STEP, axis=0, mode="nearest")


def _resonators(frequency: np.ndarray, width: np.ndarray, rate: int) -> np.ndarray:
    """Return second-order sections (k, 6) of resonators with unit gain at 0 Hz (Klatt 1980, eq. 2)."""
    radius = np.exp(-np.pi * width / rate)
    a1, a2 = -2 * radius * np.cos(2 * np.pi * frequency / rate), radius**2
    zero = np.zeros_like(a1)
    return np.stack([1 + a1 + a2, zero, zero, np.ones_like(a1), a1, a2], axis=-1)


def _inverse(sections: np.ndarray) -> np.ndarray:
    """Return antiresonators: the sections' poles as zeros."""
    gain = sections[..., :1]
    one = np.zeros_like(sections[..., 3:])
    one[..., 0] = 1
    return np.concatenate([sections[..., 3:] / gain, one], axis=-1)


def _sections(pieces: list[_Piece], times: np.ndarray, rate: int, shift: float) -> np.ndarray:
    """Return the tract's second-order sections at each time, shape (steps, sections, 6)."""
    from scipy.ndimage import gaussian_filter1d

    formants = _formants(pieces, times) * shift
    open_glottis = np.zeros(len(times), bool)
    for p in pieces:
        if p.sound.kind == "aspirate" or p.breathy:
            open_glottis[_between(times, p.start, p.end)] = True
    widths = np.stack([np.where(open_glottis, 220.0, 70.0), np.full(len(times), 95.0), np.full(len(times), 150.0)], 1)
    rows = [_resonators(formants[:, k], widths[:, k], rate) for k in range(3)]
    rows += [np.broadcast_to(_resonators(np.array(f * shift), np.array(b), rate), (len(times), 6))
             for f, b in _UPPER if f * shift < 0.48 * rate]
    zero = np.full(len(times), _NASAL_POLE)
    for p in pieces:
        if p.sound.zero:
            zero[_between(times, p.start - 0.02, p.end + 0.01)] = p.sound.zero
    zero = gaussian_filter1d(zero, 0.008 / _STEP, mode="nearest")
    rows.append(_resonators(np.full(len(times), _NASAL_POLE), np.full(len(times), 100.0), rate))
    rows.append(_inverse(_resonators(zero, np.full(len(times), 100.0), rate)))
    return np.ascontiguousarray(np.stack(rows, axis=1))


def _filtered(source: np.ndarray, pieces: list[_Piece], start: float, rate: int, shift: float) -> np.ndarray:
    """Return the source (n,) after the vocal tract, whose filters change every few milliseconds."""
    block = round(_STEP * rate)
    blocks = -(-len(source) // block)
    sections = _sections(pieces, start + (np.arange(blocks) + 0.5) * block / rate, rate, shift)
    out = source
    for k in range(sections.shape[1]):
        b0, b1, b2, _, a1, a2 = np.repeat(sections[:, k].T, block, axis=1)[:, : len(source)]
        out = _zeros(out, b0, b1, b2)
        if a1.any():
            out = _poles(out, a1, a2)
    return out


def _zeros(x: np.ndarray, b0: np.ndarray, b1: np.ndarray, b2: np.ndarray) -> np.ndarray:
    """Return ``b0[t] x[t] + b1[t] x[t - 1] + b2[t] x[t - 2]`` (n,)."""
    y = b0 * x
    y[1:] += b1[1:] * x[:-1]
    y[2:] += b2[2:] * x[:-2]
    return y


def _poles(x: np.ndarray, a1: np.ndarray, a2: np.ndarray) -> np.ndarray:
    """Return y (n,) with ``y[t] = x[t] - a1[t] y[t - 1] - a2[t] y[t - 2]``: a triangular system of three diagonals.

    Samples are remembered, not products of samples and coefficients, which would click where the coefficients change.
    """
    diagonals = np.zeros((3, len(x)), order="F")
    diagonals[0] = 1.0
    diagonals[1, :-1], diagonals[2, :-2] = a1[1:], a2[2:]
    y: np.ndarray = lapack.dtbtrs(diagonals, x, uplo="L", diag="U", overwrite_b=1)[0]
    return y
