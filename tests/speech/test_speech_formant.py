"""The built-in voice: exact times, spectra where they belong, silence where there is silence."""

from itertools import pairwise

import numpy as np
import pytest
import scipy.signal

from dnnvss.errors import DnnvssError
from dnnvss.phones import SPOKEN
from dnnvss.speech import formant
from dnnvss.speech.formant import parts, synthesise
from dnnvss.speech.formant_table import SOUNDS
from dnnvss.timing import Alignment, Tier


def row(*phones: tuple[str, float], start: float = 0.0) -> Alignment:
    segments, time = [], start
    for label, length in phones:
        segments.append((time, time + length, label))
        time += length
    return Alignment([Tier("phones", segments)])


def level(samples: np.ndarray, start: float, end: float, rate: int = 16000) -> float:
    return float(np.sqrt((samples[round(start * rate) : round(end * rate)] ** 2).mean()))


def spectrum(samples: np.ndarray, start: float, end: float, rate: int = 16000) -> tuple[np.ndarray, np.ndarray]:
    part = samples[round(start * rate) : round(end * rate)]
    return scipy.signal.welch(part, rate, nperseg=min(512, len(part)))


def test_table_has_all_phones() -> None:
    assert set(SOUNDS) == set(SPOKEN)


@pytest.mark.parametrize("rate", [8000, 16000, 22050])
def test_length_is_exact_and_level_bounded(rate: int) -> None:
    speech = synthesise(row(("sil", 0.2), *((p, 0.08) for p in SPOKEN), ("sil", 0.1233)), rate)
    assert len(speech) == int(np.floor((0.2 + 39 * 0.08 + 0.1233) * rate + 0.5)) and speech.dtype == np.float32
    assert np.isfinite(speech).all() and 0.5 < np.abs(speech).max() <= 0.61
    assert level(speech, 0, 0.15, rate) < 1e-3


def test_an_alignment_that_starts_later_sounds_the_same() -> None:
    phones = (("sil", 0.1), ("AA", 0.2), ("sil", 0.1))
    assert np.allclose(synthesise(row(*phones)), synthesise(row(*phones, start=2.0)), atol=1e-3)


def test_seed_fixes_the_samples() -> None:
    alignment = row(("S", 0.1), ("IY", 0.2))
    assert np.array_equal(synthesise(alignment, seed=3), synthesise(alignment, seed=3))
    assert not np.array_equal(synthesise(alignment, seed=3), synthesise(alignment, seed=4))


@pytest.mark.parametrize(("vowel", "low", "high"), [("IY", 200, 400), ("AA", 600, 900), ("UW", 200, 450)])
def test_first_formant_is_the_strongest_region_of_a_vowel(vowel: str, low: float, high: float) -> None:
    frequency, power = spectrum(synthesise(row(("sil", 0.1), (vowel, 0.4), ("sil", 0.1))), 0.2, 0.45)
    smooth = np.convolve(power, np.ones(5) / 5, "same")
    assert low <= frequency[smooth.argmax()] <= high


def test_s_is_higher_than_sh_and_both_higher_than_vowels() -> None:
    def centre(phone: str) -> float:
        frequency, power = spectrum(synthesise(row(("sil", 0.1), (phone, 0.3), ("AA", 0.2))), 0.15, 0.35)
        return float((frequency * power).sum() / power.sum())

    assert centre("S") > 4200 > centre("SH") > 2000 > centre("AA")


def test_pitch_is_what_was_asked() -> None:
    speech = synthesise(row(("sil", 0.1), ("AA", 0.4), ("sil", 0.5)), f0=150.0)
    part = speech[3200:6400]
    correlation = np.correlate(part, part, "full")[len(part) - 1 :]
    lag = 60 + int(correlation[60:240].argmax())
    assert 130 < 16000 / lag < 185  # early in the phrase, on a long vowel


def test_closure_is_quiet_and_burst_comes_after_it() -> None:
    speech = synthesise(row(("AA", 0.2), ("T", 0.12), ("AA", 0.2)))
    assert level(speech, 0.215, 0.25) < 0.06 * level(speech, 0.05, 0.15)
    assert level(speech, 0.262, 0.275) > 3 * level(speech, 0.215, 0.25)


def test_nothing_but_silence_is_zeros() -> None:
    assert not synthesise(row(("sil", 0.5))).any()


def test_bad_input_is_named() -> None:
    with pytest.raises(DnnvssError, match="unknown phone 'XX'"):
        synthesise(row(("XX", 0.1)))
    with pytest.raises(DnnvssError, match="pitch of 4"):
        synthesise(row(("AA", 0.1)), f0=4.0)


def test_long_speech_is_spoken_in_parts_that_end_where_it_is_silent() -> None:
    phones = ["sil", *["AA", "M", "T", "IY"] * 30, "sil"]
    spans = [(0.2 * i, 0.2 * (i + 1), p) for i, p in enumerate(phones)]  # half a minute without a pause
    spans += [(spans[-1][1], spans[-1][1] + 90.0, "sil")]
    spans += [(spans[-1][1] + 0.2 * i, spans[-1][1] + 0.2 * (i + 1), p) for i, p in enumerate(["N", "AA"] * 200)]
    tier = Tier("phones", spans)
    found = parts(tier)
    assert found[0].start == tier.start and found[-1].end == tier.end
    assert all(a.end == b.start for a, b in pairwise(found))
    assert max(part.end - part.start for part in found) <= 61
    spoken = [s.label for part in found for s in part if s.label != "sil"]
    assert spoken == [s.label for s in tier if s.label != "sil"]
    assert [part.labels[-1] for part in found[:2]] == ["sil", "sil"]  # where there are pauses
    short = Tier("phones", spans[:100])
    assert parts(short) == [short]


def test_parts_join_to_speech_that_is_as_long_and_as_loud_as_ever() -> None:
    sentence = [(0.0, 0.3, "sil"), (0.3, 0.5, "N"), (0.5, 0.8, "AW"), (0.8, 1.0, "sil")]
    spans = [(k + a, k + b, p) for k in range(70) for a, b, p in sentence]
    tier = Tier("phones", spans)
    assert len(parts(tier)) == 3
    whole, one = synthesise(Alignment([tier]), 16000), synthesise(Alignment([Tier("phones", sentence)]), 16000)
    assert len(whole) == 70 * 16000 and whole.dtype == np.float32
    assert np.abs(whole).max() == pytest.approx(0.6, abs=1e-6)
    loudness = np.sqrt((whole.reshape(70, 16000) ** 2).mean(axis=1))
    assert (loudness > 0.4 * np.sqrt((one**2).mean())).all() and loudness.max() < 2 * loudness.min()
    edges = [round(part.end * 16000) for part in parts(tier)[:-1]]
    assert all(np.abs(whole[e - 20 : e + 20]).max() < 0.01 for e in edges)


def test_speech_of_a_quarter_of_an_hour_lies_in_a_file_and_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    spans = [(0.5 * k, 0.5 * (k + 1), p) for k, p in enumerate(["N", "AW", "sil"] * 50)]
    alignment = Alignment([Tier("phones", spans)])
    whole = synthesise(alignment, 8000)
    monkeypatch.setattr(formant, "_HELD", 20.0)
    monkeypatch.setattr(formant, "_BLOCK", 10_000)
    held = synthesise(alignment, 8000)
    assert isinstance(held.base, np.memmap) and not isinstance(whole.base, np.memmap)
    np.testing.assert_array_equal(held, whole)


def test_the_tract_is_the_recursion_sample_by_sample() -> None:
    rng = np.random.default_rng(0)
    x, a1, a2 = rng.normal(size=300), rng.uniform(-1.8, -1, 300), rng.uniform(0.5, 0.95, 300)
    b0, b1, b2 = rng.normal(size=(3, 300))
    zeros, poles = np.zeros(302), np.zeros(302)
    for t in range(300):
        before, last = (x[t - 2] if t > 1 else 0.0), (x[t - 1] if t else 0.0)
        zeros[t + 2] = b0[t] * x[t] + b1[t] * last + b2[t] * before
        poles[t + 2] = x[t] - a1[t] * poles[t + 1] - a2[t] * poles[t]
    np.testing.assert_allclose(formant._zeros(x, b0, b1, b2), zeros[2:], atol=1e-12)
    np.testing.assert_allclose(formant._poles(x.copy(), a1, a2), poles[2:], rtol=1e-9)


def test_filters_that_stay_are_those_of_scipy() -> None:
    x = np.random.default_rng(1).normal(size=2000)
    section = np.array([0.2, 0.0, 0.0, 1.0, -1.6, 0.9])
    b0, b1, b2, _, a1, a2 = (np.full(2000, c) for c in section)
    ours = formant._poles(formant._zeros(x, b0, b1, b2), a1, a2)
    np.testing.assert_allclose(ours, scipy.signal.sosfilt(section[None], x), atol=1e-10)
