"""Where somebody speaks: bursts, gaps, noise and silence whose edges are known."""

import numpy as np
import pytest

from dnnvss.media import Sound
from dnnvss.speech.activity import loudness, voice_activity

RATE = 16000


def sound(*parts: tuple[float, float]) -> Sound:
    """Noise of given seconds and levels, in decibels of full scale."""
    rng = np.random.default_rng(0)
    return Sound(np.concatenate([rng.normal(size=round(s * RATE)) * 10 ** (level / 20) for s, level in parts]), RATE)


def test_loudness_by_hand() -> None:
    assert loudness(Sound(np.r_[np.full(160, 0.1), np.zeros(80)], RATE)) == pytest.approx([-20.0, -120.0])


def test_speech_begins_and_ends_where_it_is_loud() -> None:
    tier = voice_activity(sound((0.5, -80), (1.0, -20), (0.1, -80), (0.4, -25), (0.6, -80)))
    assert tier.labels == ("sil", "speech", "sil")  # the gap of 0.1 s is a sound of speech
    assert tier.edges == pytest.approx([0, 0.45, 2.05, 2.6], abs=0.021)


def test_a_word_in_a_long_silence_is_heard_and_its_places_are_10_ms_at_any_rate() -> None:
    """At 22050 samples a second 10 ms are 220.5 samples: in places of 220 an edge at 60 s would lie .14 s too late."""
    rate = 22050
    for noise in (0.0, 1e-3):
        samples = np.random.default_rng(1).normal(0, noise, 62 * rate).astype(np.float32)
        samples[60 * rate : 61 * rate] += np.random.default_rng(0).normal(0, 0.1, rate)
        tier = voice_activity(Sound(samples, rate))
        assert tier.labels == ("sil", "speech", "sil")
        np.testing.assert_allclose(tier.edges, [0, 59.95, 61.05, 62], atol=0.011)


def test_long_gaps_are_pauses_and_clicks_are_none() -> None:
    tier = voice_activity(sound((1.0, -20), (0.5, -80), (0.02, -20), (0.5, -80), (1.0, -20)))
    assert tier.labels == ("speech", "sil", "speech") and tier.edges[1:3] == pytest.approx([1.05, 1.97], abs=0.021)


@pytest.mark.parametrize("parts, label", [
    (((2.0, -90),), "sil"), (((2.0, -20),), "speech"), (((0.5, -25), (1.0, -20), (0.5, -25)), "speech")])
def test_silence_is_silent_and_what_noise_covers_is_speech(parts: tuple, label: str) -> None:
    tier = voice_activity(sound(*parts))
    assert tier.labels == (label,) and tier.end == pytest.approx(2.0)


def test_the_shortest_sound_has_a_tier() -> None:
    assert voice_activity(Sound(np.ones(1), RATE)).end == pytest.approx(1 / RATE)
