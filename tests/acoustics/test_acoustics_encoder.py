"""The pretrained encoder: its input by hand, pieces of long sounds, the causal form, what is kept, what is refused."""

from pathlib import Path

import numpy as np
import pytest

from dnnvss.acoustics import RATE, Encoder, EncoderStream, encoder, encoder_model, encoder_outputs, places_of
from dnnvss.acoustics.encoder import STEP, between, count_of
from dnnvss.acoustics.encoder_model import WIDTH, weights_file
from dnnvss.acoustics.encoder_stream import mixed
from dnnvss.acoustics.whisper import encoder_input
from dnnvss.errors import DnnvssError
from dnnvss.media import Sound
from dnnvss.timing import FrameClock

CAUSAL = Encoder(causal=True, window=30, hop=3, ahead=5)


def noise(seconds: float, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    count = round(seconds * RATE)
    return (rng.normal(0, 0.05, count) * (1 + np.sin(np.arange(count) / 3000))).astype(np.float32)


def installed() -> bool:
    try:
        import ctranslate2  # noqa: F401

        return weights_file().is_file()
    except (ImportError, DnnvssError):
        return False


needs_weights = pytest.mark.skipif(not installed(), reason="the encoder is not installed: make extras")


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """An encoder that sees two rows of its input and no further; the lengths of what it was given."""
    mix, lengths = np.random.default_rng(0).normal(size=(2, 80, WIDTH)) / 9, []

    def run(energies: np.ndarray) -> np.ndarray:
        lengths.append(energies.shape[1] // 2)
        return (energies[:, ::2].T @ mix[0] + energies[:, 1::2].T @ mix[1]).astype(np.float32)

    monkeypatch.setattr(encoder, "run_encoder", run)
    return lengths


def test_the_input_is_that_of_whisper_written_out() -> None:
    samples = noise(0.5)
    got = encoder_input(samples)
    assert (got.shape, got.dtype) == ((80, 50), np.float32)
    padded = np.concatenate([samples[200:0:-1], samples, samples[-2:-202:-1]]).astype(float)
    hann = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(400) / 400)

    def hertz(mel: float) -> float:
        return mel * 200 / 3 if mel < 15 else 1000 * np.exp((mel - 15) * np.log(6.4) / 27)

    top = 15 + np.log(8) * 27 / np.log(6.4)
    edges = [hertz(top * i / 81) for i in range(82)]
    expected = np.zeros((80, 50))
    for t in range(50):
        power = np.abs(np.fft.fft(padded[160 * t : 160 * t + 400] * hann)[:201]) ** 2
        for b in range(80):
            low, peak, high = edges[b : b + 3]
            weights = [max(0.0, min((f - low) / (peak - low), (high - f) / (high - peak)))
                       * 2 / (high - low) for f in np.arange(201) * 40.0]
            expected[b, t] = np.log10(max(1e-10, np.dot(weights, power)))
    expected = (np.maximum(expected, expected.max() - 8) + 4) / 4
    np.testing.assert_allclose(got, expected, atol=1e-5)


def test_between_is_silence_outside() -> None:
    x = np.arange(1.0, 6)
    for start, stop in [(-3, 4), (2, 9), (-9, -4), (7, 9), (-2, 8), (1, 3)]:
        expected = [x[i] if 0 <= i < 5 else 0 for i in range(start, stop)]
        np.testing.assert_array_equal(between(x, start, stop), expected)


def test_long_sounds_go_through_in_pieces_of_half_a_minute(plain: list[int]) -> None:
    samples = noise(62)
    samples[:RATE] *= 3  # the loudest of all pieces is in the first alone
    got = encoder_outputs(Sound(samples, RATE), Encoder())
    assert got.shape == (count_of(len(samples)), WIDTH) and got.dtype == np.float16
    assert len(plain) == 3 and max(plain) == 1500
    plain.clear()
    short = encoder_outputs(Sound(samples[: 20 * RATE], RATE), Encoder())
    assert plain == [count_of(20 * RATE) + 50]
    np.testing.assert_array_equal(got[:900], short[:900])
    samples[0] = 0.9999  # each piece has its own loudest, and none changes what is far away
    np.testing.assert_array_equal(encoder_outputs(Sound(samples, RATE), Encoder())[1300:], got[1300:])


def test_pieces_meet_where_they_are_told_apart_by_nothing(plain: list[int]) -> None:
    tone = 0.3 * np.sin(2 * np.pi * 100 * np.arange(62 * RATE) / RATE)  # repeats after 160 samples
    got = encoder_outputs(Sound(tone, RATE), Encoder()).astype(float)
    np.testing.assert_allclose(got[5:3000], np.tile(got[5], (2995, 1)), atol=2e-2)


def test_the_causal_form_hears_so_far_ahead_and_no_further(
        plain: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(encoder, "run_encoder", lambda e: plain.append(e.shape[1] // 2) or np.full(
        (e.shape[1] // 2, WIDTH), e[:, -1].sum()))  # every output sees the last row
    samples, other = noise(3), noise(3, 1)
    at = 90  # outputs 90 to 92 are made of what lies before sample (92 + 5) 320
    other[: (at + 7) * STEP] = samples[: (at + 7) * STEP]
    ours, theirs = (encoder_outputs(Sound(s, RATE), CAUSAL) for s in (samples, other))
    np.testing.assert_array_equal(ours[: at + 3], theirs[: at + 3])
    assert (theirs[at + 3] != ours[at + 3]).any()
    other[(at + 7) * STEP - 20 :] = 0.9
    assert (encoder_outputs(Sound(other, RATE), CAUSAL)[at : at + 3] != ours[at : at + 3]).any()
    assert CAUSAL.lookahead == 0.16 and Encoder().lookahead is None
    assert set(plain) == {30}


@pytest.mark.parametrize("rate", ["100", "25", "29.97"])
@pytest.mark.parametrize("seconds", [0.013, 0.7, 2.345])
def test_the_stream_is_the_whole_frame_by_frame(plain: list[int], rate: str, seconds: float) -> None:
    clock, samples = FrameClock(rate), noise(seconds)
    outputs = encoder_outputs(Sound(samples, RATE), CAUSAL)
    count = clock.edge(seconds)
    before, share = places_of(clock, np.arange(count), len(outputs))
    whole = mixed(outputs, before, share.astype(np.float32))
    stream, place, rows = EncoderStream(CAUSAL, clock), 0, []
    rng = np.random.default_rng(0)
    while place < len(samples):
        size = int(rng.choice([0, 1, 160, 1000, 5000]))
        rows.append(stream.push(samples[place : place + size]))
        place += size
        settled = (sum(map(len, rows)) + 0.5) / float(clock.rate)  # the first centre not told yet
        assert settled + 0.16 > min(place, len(samples)) / RATE - 1e-9
        assert len(stream._held) <= 30 * STEP and len(stream._outputs) <= 8
    rows.append(stream.finish())
    np.testing.assert_allclose(np.concatenate(rows), whole, rtol=0, atol=1e-9 + 1e-6)


def test_what_was_worked_out_is_kept(plain: list[int], tmp_path: Path) -> None:
    samples = noise(0.4)
    first = encoder_outputs(Sound(samples, RATE, tmp_path), Encoder())
    again = encoder_outputs(Sound(samples, RATE, tmp_path), Encoder())
    assert len(plain) == 1
    np.testing.assert_array_equal(first, again)
    encoder_outputs(Sound(samples * 0.5, RATE, tmp_path), Encoder())
    encoder_outputs(Sound(samples, RATE, tmp_path), Encoder(causal=True))
    assert len({*tmp_path.rglob("*.npz")}) == 3
    next((tmp_path / f"encoder-{Encoder().key}").iterdir()).write_bytes(b"no archive")
    with pytest.raises(DnnvssError, match=r"cannot be read.*Delete .*encoder-"):
        for part in (samples, samples * 0.5):
            encoder_outputs(Sound(part, RATE, tmp_path), Encoder())


def test_poor_sounds(plain: list[int]) -> None:
    for samples in (np.zeros(0), np.zeros(5), np.zeros(RATE), np.sign(noise(1)), np.full(RATE, 1e-30)):
        for form in (Encoder(), CAUSAL):
            got = encoder_outputs(Sound(samples, RATE), form)
            assert np.isfinite(got).all() and got.shape == (count_of(len(samples)), WIDTH)
    with pytest.raises(DnnvssError, match="no finite numbers"):
        encoder_outputs(Sound(np.array([np.nan, 0.0]), RATE), Encoder())


def test_weights_that_are_missing_or_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("ctranslate2")
    encoder_model._loaded.cache_clear()
    monkeypatch.setenv(encoder_model.VARIABLE, str(tmp_path / "model.bin"))
    with pytest.raises(DnnvssError, match=r"model.bin: no such file.*make extras"):
        encoder_outputs(Sound(noise(0.1), RATE), Encoder())
    (tmp_path / "model.bin").write_bytes(b"something else")
    with pytest.raises(DnnvssError, match="is not the encoder: its SHA-256 is"):
        encoder_outputs(Sound(noise(0.1), RATE), Encoder())
    monkeypatch.delenv(encoder_model.VARIABLE)
    monkeypatch.setattr(encoder_model, "_CARRIER", "no-such-package-of-ours")
    with pytest.raises(DnnvssError, match=r"its weights are not installed.*make extras"):
        weights_file()


@pytest.mark.parametrize(("settings", "message"), [
    ({"hop": 0}, "labels.encoder.hop=0 is too little"),
    ({"window": 20, "hop": 15, "ahead": 6}, "labels.encoder.window=20 does not hold hop=15 and ahead=6"),
])
def test_refusals(settings: dict, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        Encoder(**settings)
    with pytest.raises(DnnvssError, match=r"hears the whole recording.*encoder.causal=true"):
        EncoderStream(Encoder(), FrameClock(100))


@needs_weights
def test_the_real_encoder_streams_as_it_hears_the_whole() -> None:
    samples, clock = noise(0.5), FrameClock(100)
    outputs = encoder_outputs(Sound(samples, RATE), CAUSAL)
    before, share = places_of(clock, np.arange(50), len(outputs))
    stream = EncoderStream(CAUSAL, clock)
    rows = np.concatenate([stream.push(samples[:3000]), stream.push(samples[3000:]), stream.finish()])
    np.testing.assert_allclose(rows, mixed(outputs, before, share.astype(np.float32)), atol=1e-6)
    whole = encoder_outputs(Sound(samples, RATE), Encoder()).astype(float)
    assert 0.5 < whole.std() < 3  # its last layer normalises
