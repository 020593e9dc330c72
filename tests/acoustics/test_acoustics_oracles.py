"""Each analysis against one written independently, and against sounds whose feature is known."""

import numpy as np
import pytest
import scipy.fft
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from dnnvss.acoustics import RATE, Analysis, Energy, Formants, Lpc, Lsf, Mfcc, Voicing, analyse
from dnnvss.acoustics.pairs import line_spectrum
from dnnvss.errors import DnnvssError
from dnnvss.media import Sound
from dnnvss.timing import FrameClock

CLOCK = FrameClock(100)
LENGTHS = [10.0, 40.0]


def speech_like(seconds: float = 1.0, seed: int = 0) -> np.ndarray:
    """Noise through resonances that change over time."""
    rng = np.random.default_rng(seed)
    parts = [lfilter([1], np.poly(_poles(rng.uniform(300, 7000, 4))), rng.normal(0, 0.01, 4000))
             for _ in range(round(seconds * RATE / 4000))]
    return np.concatenate(parts)


def _poles(hertz: np.ndarray, band: float = 150.0) -> np.ndarray:
    turns = np.exp(-np.pi * band / RATE + 2j * np.pi * np.asarray(hertz) / RATE)
    return np.concatenate([turns, turns.conj()])


def at(samples: np.ndarray, frame: int, window: float) -> np.ndarray:
    """The window around a frame's centre, counted in whole samples by hand."""
    size = round(window * 16)
    begin = int(np.floor((frame + 0.5) * 160 - size / 2 + 0.5))
    return samples[begin : begin + size]


def pressed(x: np.ndarray, factor: float) -> np.ndarray:
    """Pre-emphasis and a Hamming window, sample by sample."""
    size = len(x)
    before = [x[0], *x[:-1]]
    return np.array([(x[t] - factor * before[t]) * (0.54 - 0.46 * np.cos(2 * np.pi * t / (size - 1)))
                     for t in range(size)])


def one(analysis: Analysis, samples: np.ndarray, frame: int) -> np.ndarray:
    return analyse(Sound(samples, RATE), analysis, CLOCK, frame, 1, np.float64)[0]


@pytest.mark.parametrize("window", LENGTHS)
@pytest.mark.parametrize(("count", "zeroth"), [(13, True), (12, False)])
def test_mfcc_are_the_cosine_transform_of_the_logarithm_of_mel_powers(
        window: float, count: int, zeroth: bool) -> None:
    samples, bands = speech_like(), 26
    y = pressed(at(samples, 30, window), 0.97)
    points = max(512, 2 ** int(np.ceil(np.log2(len(y)))))
    shape = 0.54 - 0.46 * np.cos(2 * np.pi * np.arange(len(y)) / (len(y) - 1))
    spectrum = np.abs(np.fft.fft(y, points)[: points // 2 + 1]) ** 2 / (shape**2).sum()
    top = 2595 * np.log10(1 + 8000 / 700)
    edges = [700 * (10 ** (top * i / (bands + 1) / 2595) - 1) for i in range(bands + 2)]
    energies = []
    for a, b, c in zip(edges, edges[1:], edges[2:], strict=False):
        w = [max(0.0, min((f - a) / (b - a), (c - f) / (c - b)))
             for f in np.arange(points // 2 + 1) * RATE / points]
        energies.append(np.log(max(1e-9, np.dot(w, spectrum) / sum(w))))
    expected = scipy.fft.dct(energies, type=2, norm="ortho")
    got = one(Mfcc(count=count, zeroth=zeroth, window=window), samples, 30)
    np.testing.assert_allclose(got, expected[:13] if zeroth else expected[1:13], rtol=1e-9)


def correlation(x: np.ndarray, order: int) -> np.ndarray:
    shape = 0.54 - 0.46 * np.cos(2 * np.pi * np.arange(len(x)) / (len(x) - 1))
    r = np.array([sum(x[t] * x[t + k] for t in range(len(x) - k)) for k in range(order + 1)])
    r /= (shape**2).sum()
    r[0] += 1e-9
    return r


@pytest.mark.parametrize("window", LENGTHS)
def test_lpc_solve_the_toeplitz_equations(window: float) -> None:
    samples = speech_like()
    r = correlation(pressed(at(samples, 20, window), 0.97), 16)
    np.testing.assert_allclose(one(Lpc(window=window), samples, 20), solve_toeplitz(r[:-1], -r[1:]),
                               rtol=1e-6, atol=1e-8)


def test_lpc_find_the_filter_that_made_the_sound() -> None:
    made = np.poly(_poles(np.array([700.0, 2200, 5000]), 600)).real
    samples = lfilter([1], made, np.random.default_rng(0).normal(0, 0.1, RATE))
    got = one(Lpc(order=6, window=500, emphasis=0), samples, 50)
    np.testing.assert_allclose(got, made[1:], atol=0.15)


@pytest.mark.parametrize("order", [1, 2, 9, 15, 16])
def test_line_spectrum_is_where_the_sum_and_the_difference_have_their_roots(order: int) -> None:
    samples = speech_like()
    filters = [[1, *one(Lpc(order=order), samples, k)] for k in range(10, 80, 7)]
    for made, got in zip(filters, line_spectrum(np.array(filters)), strict=True):
        longer = np.append(made, 0)
        roots = np.concatenate([np.roots(longer + longer[::-1]), np.roots(longer - longer[::-1])])
        angles = np.sort(np.angle(roots))
        angles = angles[(angles > 1e-4) & (angles < np.pi - 1e-4)]
        assert got.shape == (order,)
        np.testing.assert_allclose(got, angles, atol=1e-6)
        assert (np.diff(got) > 0).all()


def test_line_spectrum_by_hand() -> None:
    # A = 1 - z^-1 / 2: P = 1 - z^-1 + z^-2 is zero at cos w = 1/2; Q = 1 - z^-2 at 0 and pi alone.
    np.testing.assert_allclose(line_spectrum(np.array([[1.0, -0.5], [1.0, 0.0]])),
                               [[np.pi / 3], [np.pi / 2]])
    white = line_spectrum(np.array([[1.0, *np.zeros(15)]]))[0]  # P and Q are 1 +- z^-16
    np.testing.assert_allclose(white, np.arange(1, 16) * np.pi / 16, atol=1e-12)


def test_lsf_are_those_of_its_own_filter() -> None:
    samples = speech_like()
    np.testing.assert_allclose(one(Lsf(), samples, 33),
                               line_spectrum(np.array([[1, *one(Lpc(order=15), samples, 33)]]))[0])


@pytest.mark.parametrize("hertz", [(730, 1090, 2440), (270, 2290, 3010), (300, 870, 2240), (530, 1840, 2480)])
def test_formants_of_vowels_that_a_known_tube_makes(hertz: tuple[float, ...]) -> None:
    """Peterson and Barney's men: pulses at 110 Hz through five resonances, and the lips' slope."""
    pulses = np.zeros(RATE)
    pulses[:: RATE // 110] = 1
    poles = [_poles([f], b) for f, b in zip((*hertz, 3500, 4500), (60, 80, 120, 150, 200), strict=True)]
    sound = lfilter([1], np.poly(np.concatenate(poles)).real, lfilter([1], [1, -0.95], pulses))
    got = analyse(Sound(0.1 * sound / np.abs(sound).max(), RATE), Formants(), CLOCK, 30, 40)
    np.testing.assert_allclose(np.median(got, axis=0), hertz, rtol=0.06, atol=25)


def test_formants_of_silence_are_those_of_a_plain_tube() -> None:
    np.testing.assert_array_equal(one(Formants(), np.zeros(RATE), 30), [500, 1500, 2500])


def test_energy_by_hand() -> None:
    sine = 0.5 * np.sin(2 * np.pi * 500 * np.arange(RATE) / RATE)
    np.testing.assert_allclose(one(Energy(), sine, 30), [np.log(0.125)], atol=1e-3)
    np.testing.assert_allclose(one(Energy(window=10), np.full(RATE, 0.1), 30), [np.log(0.01)])
    np.testing.assert_allclose(one(Energy(floor=1e-5), np.zeros(RATE), 30), [np.log(1e-5)])
    x = np.zeros(RATE)
    x[30 * 160 + 80] = 1.0  # at the centre the window is 1, and sum w^2 is 3 N / 8
    np.testing.assert_allclose(one(Energy(window=10), x, 30), [np.log(1 / 60)])


def test_voicing_tells_voices_from_noise() -> None:
    time = np.arange(RATE) / RATE
    for hertz in (90, 150, 330):
        voice = sum(np.sin(2 * np.pi * hertz * k * time + k) / k for k in range(1, 9))
        assert one(Voicing(), 0.1 * voice, 30)[0] > 0.98
    noise = np.random.default_rng(0).normal(0, 0.1, 10 * RATE)
    found = analyse(Sound(noise, RATE), Voicing(), CLOCK, 0, 1000)
    assert np.quantile(found, 0.95) < 0.4
    assert one(Voicing(), np.zeros(RATE), 30)[0] == 0
    assert one(Voicing(), np.full(RATE, 0.3), 30)[0] < 1e-9  # what stands still is no voice


@pytest.mark.parametrize(("make", "message"), [
    (lambda: Mfcc(count=30), "labels.mfcc.count=30: 26 mel bands have not so many"),
    (lambda: Mfcc(count=26, zeroth=False), "26 mel bands have not so many"),
    (lambda: Mfcc(low=5000, high=4000), "low=5000 is not below high=4000"),
    (lambda: Mfcc(bands=300), "cannot tell bands apart"),
    (lambda: Voicing(window=20), "a voice of 70 Hz has not two periods in it.*29 ms"),
    (lambda: Voicing(low=500), "low=500 is not below high=400"),
    (lambda: Lpc(window=1), "labels.lpc.window=1.* is too little"),
    (lambda: Formants(top=20000), "labels.formants.top=20000 is too much"),
])
def test_refusals(make, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        make()
