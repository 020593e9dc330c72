"""Altered sounds: levels by hand, what a band lets through, and where pitch and formants go."""

import numpy as np
import pytest

from dnnvss.acoustics import RATE, Formants, analyse
from dnnvss.acoustics.alter import altered, another_throat, babble, music, speech_power, telephone, white, with_noise
from dnnvss.media import Sound
from dnnvss.timing import FrameClock


def tone(hertz: float, seconds: float = 1.0) -> np.ndarray:
    return 0.2 * np.sin(2 * np.pi * hertz * np.arange(round(seconds * RATE)) / RATE)


def peak(samples: np.ndarray) -> float:
    return float(np.abs(np.fft.rfft(samples * np.hanning(len(samples)))).argmax() * RATE / len(samples))


def test_speech_is_what_is_not_silent() -> None:
    half = np.concatenate([tone(500), np.zeros(RATE)])
    assert speech_power(half) == pytest.approx(0.02)
    assert speech_power(np.zeros(RATE)) == 0 == speech_power(np.zeros(3))


def test_noise_lies_so_far_below_the_speech() -> None:
    speech, noise = np.concatenate([tone(500), np.zeros(RATE)]), white(np.random.default_rng(0), 2 * RATE)
    added = with_noise(speech, noise, 5) - speech
    assert 10 * np.log10(0.02 / (added**2).mean()) == pytest.approx(5)
    np.testing.assert_array_equal(with_noise(speech, np.zeros(2 * RATE), 5), speech)


@pytest.mark.parametrize(("hertz", "least", "most"), [(1000, 0.95, 1.05), (100, 0, 0.05), (6000, 0, 0.1)])
def test_a_telephone_lets_the_middle_through(hertz: float, least: float, most: float) -> None:
    left = telephone(tone(hertz))[RATE // 2 :].std() / tone(hertz).std()
    assert least <= left <= most


def test_babble_and_music_fill_the_time() -> None:
    rng = np.random.default_rng(0)
    voices = babble(rng, 5000, [tone(300, 0.2), tone(700, 0.5)], voices=4)
    assert voices.shape == (5000,) and 1 < voices.std() < 4
    chords = music(rng, 20_001)
    assert chords.shape == (20_001,) and chords.std() > 0.1 and np.isfinite(chords).all()


@pytest.mark.parametrize("factor", [0.85, 1.0, 1.2])
def test_another_throat_is_higher_and_no_shorter(factor: float) -> None:
    moved = another_throat(tone(300, 2), factor)
    assert moved.shape == (2 * RATE,)
    assert peak(moved) == pytest.approx(300 * factor, rel=0.02)
    assert moved[RATE // 4 : -RATE // 4].std() == pytest.approx(tone(300).std(), rel=0.1)


def test_another_throat_says_the_same_at_the_same_time() -> None:
    speech = np.concatenate([np.zeros(RATE // 2), tone(200, 0.5), np.zeros(RATE // 2)])
    loud = another_throat(speech, 1.2).reshape(-1, 800).std(axis=1) > 0.05
    assert (np.flatnonzero(loud)[[0, -1]] == [10, 19]).all()
    pulses = np.zeros(RATE)
    pulses[:: RATE // 100] = 1
    from scipy.signal import lfilter

    turns = np.exp(-np.pi * 80 / RATE + 2j * np.pi * np.array([600, 1500, 2500]) / RATE)
    vowel = 0.01 * lfilter([1], np.poly(np.concatenate([turns, turns.conj()])).real, pulses)
    own, moved = (np.median(analyse(Sound(s, RATE), Formants(order=8), FrameClock(100), 20, 60), axis=0)
                  for s in (vowel, another_throat(vowel, 1.15)))
    np.testing.assert_allclose(moved[:2] / own[:2], 1.15, rtol=0.06)
    assert another_throat(np.zeros(10), 1.2).shape == (10,)


def test_what_befalls_a_recording_is_drawn() -> None:
    speech = np.concatenate([np.zeros(RATE // 2), tone(200, 0.5), np.zeros(RATE // 2)]).astype(np.float32)
    made = [altered(np.random.default_rng(k), speech, [tone(300, 0.2)]) for k in range(20)]
    assert all(m.shape == speech.shape and m.dtype == np.float32 and np.isfinite(m).all() for m in made)
    clean = [m for m in made if abs(peak(m) - 200) < 2 and not m[:100].any()]
    assert 1 <= len(clean) <= 10  # some keep all but their level
    assert 11 <= sum(m[:100].any() for m in made) <= 19  # three in four come with noise
    np.testing.assert_array_equal(altered(np.random.default_rng(3), speech, [speech]),
                                  altered(np.random.default_rng(3), speech, [speech]))
