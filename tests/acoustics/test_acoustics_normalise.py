"""Normalisation by talker, by recording and as the sound comes, against sums by hand."""

import numpy as np
import pytest

from dnnvss.acoustics import (
    RATE,
    AcousticStream,
    Encoder,
    EncoderStream,
    LogMel,
    Moments,
    Running,
    analyse,
    encoder,
    encoder_outputs,
    normalised,
    places_of,
    talker_moments,
)
from dnnvss.acoustics.encoder_stream import mixed
from dnnvss.media import Sound
from dnnvss.timing import FrameClock

ROWS = np.random.default_rng(0).normal(3, 2, (400, 5)) * np.array([1, 2, 3, 4, 0])


def nobody() -> Moments:
    raise AssertionError("the talker was not asked for")


def test_a_recording_has_mean_zero_and_deviation_one() -> None:
    got = normalised(ROWS, "recording", 1.0, 100, nobody)
    np.testing.assert_allclose(got.mean(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(got.std(axis=0), [1, 1, 1, 1, 0], atol=1e-12)
    assert normalised(ROWS, "none", 1.0, 100, nobody) is ROWS
    assert normalised(ROWS[:0], "recording", 1.0, 100, nobody).shape == (0, 5)


def test_running_by_hand() -> None:
    got = Running(2.0, 3.0).push(np.array([[1.0], [3.0], [8.0]]))
    # weight 3, usual variance 4: rows so far have means 1, 2, 4 and squares about them 0, 2, 26
    expected = [0, 1 / np.sqrt((12 + 2) / 5), 4 / np.sqrt((12 + 26) / 6)]
    np.testing.assert_allclose(got[:, 0], expected)


def test_running_does_not_depend_on_how_rows_come() -> None:
    whole, parts = Running(1.0, 100.0).push(ROWS + 1e4), Running(1.0, 100.0)
    cut = [parts.push(p) for p in np.split(ROWS + 1e4, [0, 1, 2, 50, 51, 399])]
    np.testing.assert_array_equal(np.concatenate(cut), whole)
    np.testing.assert_array_equal(Running(1.0, 100.0).push(ROWS[:100] + 1e4), whole[:100])
    late = normalised(ROWS, "recording", 1.0, 100, nobody)[-1]
    np.testing.assert_allclose(whole[-1], late, atol=0.4)  # in the end nearly all is known


def test_a_talker_is_all_recordings_and_asked_once() -> None:
    asked: list[int] = []
    parts = {n: np.random.default_rng(n).normal(n, 1, (50 + n, 3)) for n in (1, 2, 3)}
    sounds = [Sound(np.zeros(n), RATE) for n in parts]

    def rows_of(sound: Sound) -> np.ndarray:
        asked.append(len(sound.samples))
        return parts[len(sound.samples)]

    def everything() -> list[Sound]:
        return sounds

    own = Sound(np.zeros(2), RATE, None, everything)
    found = talker_moments(own, rows_of, "key", 1.0)
    both = np.concatenate([*parts.values()])
    np.testing.assert_allclose(found.mean, both.mean(axis=0))
    np.testing.assert_allclose(found.deviation, both.std(axis=0))
    assert talker_moments(own, rows_of, "key", 1.0) is found and asked == [1, 2, 3]
    alone = talker_moments(sounds[1], rows_of, "key", 1.0)
    np.testing.assert_allclose(alone.mean, parts[2].mean(axis=0))


def test_streams_normalise_as_the_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, samples = FrameClock(100), np.random.default_rng(0).normal(0, 0.1, 12_000).astype(np.float32)
    mel = LogMel(causal=True)
    rows = analyse(Sound(samples, RATE), mel, clock, 0, 75, np.float64)
    whole = normalised(rows, "running", mel.spread, 100.0, nobody)
    stream = AcousticStream(mel, clock, running=True)
    got = [stream.push(samples[:5000]), stream.push(samples[5000:]), stream.finish()]
    np.testing.assert_allclose(np.concatenate(got), whole, atol=1e-9)
    monkeypatch.setattr(encoder, "run_encoder", lambda e: np.resize(e[:, ::2].T, (e.shape[1] // 2, 384)))
    made = Encoder(causal=True, window=20)
    outputs = normalised(encoder_outputs(Sound(samples, RATE), made), "running", 1.0, 50.0, nobody)
    before, share = places_of(clock, np.arange(75), len(outputs))
    hearing = EncoderStream(made, clock, running=True)
    got = [hearing.push(samples[:5000]), hearing.push(samples[5000:]), hearing.finish()]
    np.testing.assert_allclose(np.concatenate(got), mixed(outputs, before, share.astype(np.float32)), atol=1e-6)
