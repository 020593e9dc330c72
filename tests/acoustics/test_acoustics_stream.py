"""Causal analyses: nothing behind the frame, equal to what comes out as the sound arrives; bad sounds."""

from dataclasses import replace

import numpy as np
import pytest

from dnnvss.acoustics import (
    RATE,
    AcousticStream,
    Analysis,
    Energy,
    Formants,
    LogMel,
    Lpc,
    Lsf,
    Mfcc,
    Voicing,
    analyse,
)
from dnnvss.errors import DnnvssError
from dnnvss.media import Sound
from dnnvss.timing import FrameClock

ALL: list[Analysis] = [LogMel(), Mfcc(), Lpc(), Lsf(), Formants(), Energy(), Voicing()]
NAMES = [a.name for a in ALL]


def noise(count: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.cumsum(rng.normal(0, 0.01, count)) * 0.1 + rng.normal(0, 0.02, count)


@pytest.mark.parametrize("rate", ["100", "25", "29.97"])
@pytest.mark.parametrize("analysis", ALL, ids=NAMES)
def test_the_stream_is_the_whole_frame_by_frame(analysis: Analysis, rate: str) -> None:
    causal, clock, samples = replace(analysis, causal=True), FrameClock(rate), noise(12_345)
    count = clock.edge(len(samples) / RATE)
    whole = analyse(Sound(samples, RATE), causal, clock, 0, count, np.float64)
    stream, rng, place, rows = AcousticStream(causal, clock), np.random.default_rng(1), 0, []
    while place < len(samples):
        size = int(rng.choice([0, 1, 7, 160, 1000, 3000]))
        rows.append(stream.push(samples[place : place + size]))
        place += size
        ended = sum(map(len, rows))
        heard = min(place, len(samples)) / RATE
        assert abs(clock.seconds(ended) - heard) <= 1 / float(clock.rate)  # as soon as it can be
    rows.append(stream.finish())
    np.testing.assert_allclose(np.concatenate(rows), whole, rtol=0, atol=1e-9 * np.abs(whole).max())


@pytest.mark.parametrize("analysis", ALL, ids=NAMES)
def test_causal_frames_do_not_know_what_follows(analysis: Analysis) -> None:
    causal, clock = replace(analysis, causal=True), FrameClock(100)
    samples, other = noise(16_000), noise(16_000, 1)
    other[:8000] = samples[:8000]
    ours, theirs = (analyse(Sound(s, RATE), causal, clock, 0, 100) for s in (samples, other))
    np.testing.assert_array_equal(ours[:50], theirs[:50])
    assert (ours[50] != theirs[50]).any()
    assert causal.key != analysis.key


def test_a_causal_frame_is_a_centred_one_of_the_sound_before() -> None:
    samples = noise(16_000)  # a window of 40 ms that ends with frame 52 has its centre in that of 50.5
    causal = analyse(Sound(samples, RATE), Mfcc(causal=True), FrameClock(100), 52, 1)
    centred = analyse(Sound(samples[80:], RATE), Mfcc(), FrameClock(100), 50, 1)
    np.testing.assert_array_equal(causal, centred)


def test_before_the_sound_there_is_silence() -> None:
    samples = noise(1600)
    early = analyse(Sound(samples, RATE), Energy(causal=True), FrameClock(100), 0, 10)
    later = analyse(Sound(np.concatenate([np.zeros(1600), samples]), RATE), Energy(causal=True),
                    FrameClock(100), 10, 10)
    np.testing.assert_array_equal(early, later)


def test_a_stream_holds_one_window() -> None:
    stream = AcousticStream(Mfcc(causal=True), FrameClock(100))
    for _ in range(50):
        stream.push(np.zeros(777, np.float32))
        assert len(stream._held) <= 640


def test_what_looks_ahead_cannot_stream() -> None:
    with pytest.raises(DnnvssError, match=r"labels.mfcc looks at sound behind its frame.*mfcc.causal=true"):
        AcousticStream(Mfcc(), FrameClock(100))


@pytest.mark.parametrize(("samples", "rate", "message"), [
    (np.array([0.0, np.nan, 0.1]), RATE, "no finite numbers"),
    (np.array([0.0, np.inf]), RATE, "no finite numbers"),
    (np.array([0, 3000], np.int16), RATE, "of shape .* and type int16"),
    (np.zeros((100, 2)), RATE, r"a sound of shape \(100, 2\)"),
    (np.array([0.0, 20000.0]), RATE, "the sound reaches 20000, and 1 is full scale"),
    (np.zeros(100), 0, "a sound of 0 samples a second"),
])
def test_what_is_no_sound_is_refused(samples: np.ndarray, rate: int, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        analyse(Sound(samples, rate), LogMel(), FrameClock(100), 0, 1)
    if rate == RATE:
        with pytest.raises(DnnvssError, match=message):
            AcousticStream(LogMel(causal=True), FrameClock(100)).push(samples)


@pytest.mark.parametrize("analysis", [*ALL, *(replace(a, causal=True) for a in ALL)])
def test_poor_sounds_have_features_all_the_same(analysis: Analysis) -> None:
    clock = FrameClock(100)
    square = np.sign(np.sin(np.arange(16_000) / 30))  # clipped as far as can be
    for samples in (np.zeros(0), np.zeros(1), np.ones(100), np.zeros(16_000), square, np.full(16_000, 1e-30)):
        rows = analyse(Sound(samples, RATE), analysis, clock, 0, 20)
        assert rows.shape == (20, len(analysis.columns))
        assert np.isfinite(rows).all()
