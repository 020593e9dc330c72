"""Log-mel energies against a transform written out by hand, and what must hold of any."""

import numpy as np
import pytest

from dnnvss.acoustics import RATE, LogMel, analyse
from dnnvss.acoustics.mel import mel_filters
from dnnvss.errors import DnnvssError
from dnnvss.media import Sound
from dnnvss.timing import FrameClock

CLOCK = FrameClock(100)


def noise(seconds: float, rate: int = RATE, seed: int = 0) -> Sound:
    return Sound(np.random.default_rng(seed).normal(0, 0.1, round(seconds * rate)).astype(np.float32), rate)


def by_hand(samples: np.ndarray, centre: float, d: LogMel) -> np.ndarray:
    """One frame: a sum over samples for each frequency, a sum over frequencies for each band."""
    size = round(d.window * 16)
    begin = int(np.floor(centre * 16000 - size / 2 + 0.5))
    n = np.arange(size)
    hann = 0.5 - 0.5 * np.cos(2 * np.pi * n / size)
    points = 2 ** int(np.ceil(np.log2(size)))
    power = []
    for k in range(points // 2 + 1):
        turn = 2 * np.pi * k * n / points
        x = samples[begin : begin + size] * hann
        power.append(((x * np.cos(turn)).sum() ** 2 + (x * np.sin(turn)).sum() ** 2) / (hann**2).sum())

    def mel(f: float) -> float:
        return 2595 * np.log10(1 + f / 700)

    places = [mel(d.low) + (mel(d.high) - mel(d.low)) * i / (d.bands + 1) for i in range(d.bands + 2)]
    edges = [700 * (10 ** (m / 2595) - 1) for m in places]
    out = []
    for a, b, c in zip(edges, edges[1:], edges[2:], strict=False):
        weights = [max(0.0, min((f - a) / (b - a), (c - f) / (c - b)))
                   for f in (k * 16000 / points for k in range(points // 2 + 1))]
        out.append(np.log(max(d.floor, np.dot(weights, power) / sum(weights))))
    return np.array(out)


@pytest.mark.parametrize("definition", [LogMel(), LogMel(bands=12, window=40, low=0, high=8000, floor=1e-3)])
@pytest.mark.parametrize("rate", ["100", "29.97"])
def test_each_frame_equals_a_transform_by_hand(definition: LogMel, rate: str) -> None:
    clock, sound = FrameClock(rate), noise(1.0)
    got = analyse(sound, definition, clock, 3, 20)
    assert got.dtype == np.float32
    assert got.shape == (20, definition.bands)
    for k in range(20):
        centre = float((3 + k + 0.5) / clock.rate)
        np.testing.assert_allclose(got[k], by_hand(sound.samples, centre, definition), rtol=1e-5, atol=1e-5)


def test_a_frame_holds_the_sound_around_its_centre() -> None:
    samples = np.zeros(RATE)
    samples[round(0.505 * RATE)] = 1.0  # a click at the centre of frame 50
    loud = analyse(Sound(samples, RATE), LogMel(), CLOCK, 0, 100).mean(axis=1)
    assert loud.argmax() == 50
    np.testing.assert_allclose(loud[49], loud[51], atol=1e-3)
    assert (np.flatnonzero(loud > loud.min()) == [49, 50, 51]).all()  # 25 ms reach to the frames beside, no further


def test_a_tone_falls_into_its_band() -> None:
    definition = LogMel()
    for hertz in (250, 1000, 4000):
        tone = Sound(np.sin(2 * np.pi * hertz * np.arange(RATE) / RATE), RATE)
        band = analyse(tone, definition, CLOCK, 40, 1)[0].argmax()
        filters = mel_filters(40, 60, 7000, definition.transform)
        nearest = filters[:, round(hertz * definition.transform / RATE)].argmax()
        assert abs(band - nearest) <= 1


def test_white_noise_has_its_variance_in_every_band() -> None:
    energies = analyse(noise(60), LogMel(), CLOCK, 0, 6000).astype(float)
    np.testing.assert_allclose(np.exp(energies).mean(axis=0), 0.01, rtol=0.05)


def test_silence_is_the_floor() -> None:
    got = analyse(Sound(np.zeros(8000), RATE), LogMel(floor=1e-6), CLOCK, 0, 50)
    np.testing.assert_allclose(got, np.log(1e-6), rtol=1e-6)


def test_the_ends_are_held() -> None:
    sound = noise(0.5)
    got = analyse(sound, LogMel(), CLOCK, 0, 80)
    np.testing.assert_array_equal(got[50:], np.repeat(got[49:50], 30, axis=0))
    np.testing.assert_allclose(got[0], by_hand(sound.samples, 0.0125, LogMel()), rtol=1e-5, atol=1e-5)
    short = analyse(Sound(sound.samples[:100], RATE), LogMel(), CLOCK, 0, 3)
    assert (short == short[0]).all()
    assert short.max() > np.log(LogMel().floor) + 5


def test_other_rates_of_sound_give_the_same() -> None:
    time = np.arange(48000) / 48000
    tones = [np.sin(2 * np.pi * f * time + f) for f in np.arange(100, 7000, 61.0)]
    wide = Sound(0.01 * np.sum(tones, axis=0), 48000)
    narrow = Sound(wide.samples[::3], RATE)  # nothing above 7 kHz: every third sample is the whole sound
    ours, theirs = (analyse(s, LogMel(), CLOCK, 10, 80) for s in (wide, narrow))
    np.testing.assert_allclose(ours, theirs, atol=0.02)


def test_long_sounds_are_worked_out_in_parts_alike() -> None:
    sound = noise(50)
    whole = analyse(sound, LogMel(), CLOCK, 0, 5000)
    np.testing.assert_array_equal(whole[4090:4100], analyse(sound, LogMel(), CLOCK, 4090, 10))


@pytest.mark.parametrize(("settings", "message"), [
    ({"bands": 0}, "labels.logmel.bands=0 is too little"),
    ({"bands": 300}, "labels.logmel.bands=300: a window of 25 ms cannot tell bands apart"),
    ({"window": 0}, "labels.logmel.window=0.* is too little"),
    ({"low": 3000, "high": 2000}, "low=3000 is not below high=2000"),
    ({"floor": 0}, "labels.logmel.floor=0.* is too little"),
])
def test_refusals(settings: dict, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        LogMel(**settings)


def test_the_key_tells_definitions_apart() -> None:
    assert LogMel().key == LogMel().key
    assert len({LogMel().key, LogMel(bands=39).key, LogMel(window=30).key, LogMel(floor=1e-6).key}) == 4
