"""Every metric of the harness: its name, its written definition, and the function that computes it for one sentence."""

from collections.abc import Callable

import numpy as np

from dnnvss.evaluation.bench import POINTS, Bench, Measure, Pair, PairFunction, Sentence
from dnnvss.evaluation.lips import TALKER_SHARE, lip_events
from dnnvss.evaluation.metrics import centred_rmse, correlation, global_variance_ratio, mean_known, rmse
from dnnvss.evaluation.movement import CUTOFF, dtw, high_power, jerk, lag, landmark_error, speed
from dnnvss.face.base import APERTURE, LOWER_LIP, WIDTH
from dnnvss.phones import BILABIALS, LABIODENTALS

DTW_BAND = 0.2
"""Seconds by which the warp may leave the diagonal."""


def _known(value: float) -> Pair:
    return (0.0, 0.0) if np.isnan(value) else (float(value), 1.0)


def _first(metric: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> PairFunction:
    """Return the pair of a metric of :mod:`dnnvss.evaluation.metrics`: its average over the first coefficients, over
    speech."""

    def pair(bench: Bench, s: Sentence, x: np.ndarray) -> Pair:
        columns = slice(0, bench.first)
        return _known(float(mean_known(metric(s.reference[s.spoken, columns], x[s.spoken, columns]))))

    return pair


def _dtw(bench: Bench, s: Sentence, x: np.ndarray) -> Pair:
    r, p = (y[s.spoken, : bench.first] / bench.scale[: bench.first] for y in (s.reference, x))
    return _known(dtw(r, p, bench.clock.edge(DTW_BAND)))


def _true_points(bench: Bench, s: Sentence) -> np.ndarray:
    assert bench.face is not None
    return bench.face.points(s.reference) if s.landmarks is None else s.landmarks


def frame_errors(bench: Bench, s: Sentence, x: np.ndarray) -> np.ndarray:
    """Return the mean distance of the landmarks in each frame (T,), in the unit of the face."""
    assert bench.face is not None
    return landmark_error(_true_points(bench, s), bench.face.points(x))


def _landmarks(bench: Bench, s: Sentence, x: np.ndarray) -> Pair:
    return _known(float(mean_known(frame_errors(bench, s, x)[s.spoken])))


def _landmark_share(bench: Bench, s: Sentence, x: np.ndarray) -> Pair:
    amount, weight = _landmarks(bench, s, x)
    return (100 * amount / bench.mouth, weight) if weight else (0.0, 0.0)


def _lips(contact: bool, amount: str, weight: str, factor: float = 1.0) -> PairFunction:
    """Return the pair of two fields of :class:`LipEvents`: closures on p b m, or the lower lip's contact on f v."""

    def pair(bench: Bench, s: Sentence, x: np.ndarray) -> Pair:
        name, level, phones = ((LOWER_LIP, bench.contact, LABIODENTALS) if contact else
                               (APERTURE, bench.closed, BILABIALS))
        if np.isnan(level):
            return 0.0, 0.0
        gauge = bench.gauge(name)
        events = lip_events(gauge(s.reference), gauge(x), s.tier, bench.clock, level, s.spoken, phones,
                            s.valid)
        return factor * getattr(events, amount), getattr(events, weight)

    return pair


def _lag(bench: Bench, s: Sentence, x: np.ndarray) -> Pair:
    if not s.whole:
        return 0.0, 0.0
    aperture = bench.gauge(APERTURE)
    r, p = (aperture(y[s.speech]) for y in (s.reference, x))
    return _known(1000 * lag(r, p, bench.clock))


def _silence(bench: Bench, s: Sentence, x: np.ndarray) -> Pair:
    shown = (bench.face.points(x) if bench.face is not None and POINTS in bench.known else
             x[:, : bench.first] / bench.scale[: bench.first])
    return _known(speed(shown, bench.clock, s.still(bench.clock)))


def _jerk(bench: Bench, s: Sentence, x: np.ndarray) -> Pair:
    if not s.whole:
        return 0.0, 0.0
    scaled = x[s.speech, : bench.first] / bench.scale[: bench.first]
    return _known(jerk(scaled, bench.clock) / 1000)


def _high(bench: Bench, s: Sentence, x: np.ndarray) -> Pair:
    if not s.whole:
        return 0.0, 0.0
    scaled = x[s.speech, : bench.first] / bench.scale[: bench.first]
    return _known(100 * high_power(scaled, bench.clock))


_SPOKEN = "over the measured frames from the first phone's start to the last one's end"
_CLOSED = (f"The lips are closed at or below the level that {TALKER_SHARE:.0%} of the talker's p, b and m reach within "
           "the phone widened by 40 ms on both sides")

MEASURES: tuple[Measure, ...] = (
    Measure(
        "correlation", "correlation",
        f"Pearson's correlation of each coefficient {_SPOKEN}, averaged over the first coefficients, then over the "
        "sentences. 0 for a prediction that does not move.",
        _first(correlation), "high",
    ),
    Measure(
        "rmse", "RMSE",
        f"Root mean square error of each coefficient {_SPOKEN}, averaged over the first coefficients, then over "
        "the sentences. In the coefficients' unit.",
        _first(rmse), "low",
    ),
    Measure(
        "centred_rmse", "centred RMSE",
        "RMSE after each side's mean over the sentence is taken away.",
        _first(centred_rmse), "low",
    ),
    Measure(
        "gv_ratio", "GV ratio",
        f"Variance of the prediction over that of the truth {_SPOKEN}, averaged over the first coefficients, then "
        "over the sentences. Below 1 is under-articulated.",
        _first(global_variance_ratio), "one",
    ),
    Measure(
        "dtw", "DTW (sd)",
        "Mean distance a step of the best warping path, each of the first coefficients divided by its standard "
        f"deviation; the warp stays within {DTW_BAND * 1000:.0f} ms.",
        _dtw, "low",
    ),
    Measure(
        "landmarks", "landmarks (UNIT)",
        f"Mean distance of the landmarks from the truth {_SPOKEN}, in UNITS of the reference frame; the truth is "
        "tracked where the run kept it.",
        _landmarks, "low", (POINTS,),
    ),
    Measure(
        "landmark_share", "landmarks (% mouth)",
        "The same as a percentage of the talker's mean mouth width.",
        _landmark_share, "low", (POINTS, WIDTH),
    ),
    Measure(
        "closure_recall", "closure recall",
        f"{_CLOSED}. Share of those phones in which the prediction is closed too.",
        _lips(False, "reached", "asked"), "high", (APERTURE,),
    ),
    Measure(
        "closure_precision", "closure precision",
        "Share of the prediction's closures during speech at which the truth is closed too, give or take 40 ms.",
        _lips(False, "right", "predicted"), "high", (APERTURE,),
    ),
    Measure(
        "closure_onset", "closure onset (ms)",
        "Mean distance between the moments at which prediction and truth close, over the p, b and m at which both "
        "close during speech; of two closures near a phone the tighter one counts.",
        _lips(False, "onset_distance", "timed", 1000), "low", (APERTURE,),
    ),
    Measure(
        "closure_late", "closure late by (ms)",
        "The same with its sign: positive is late.",
        _lips(False, "onset_error", "timed", 1000), "zero", (APERTURE,),
    ),
    Measure(
        "closure_aperture", "aperture on p b m (UNIT)",
        "Mean over p, b and m of the least aperture within the phone widened by 40 ms, in UNITS.",
        _lips(False, "least", "phones"), "talker", (APERTURE,),
    ),
    Measure(
        "contact_recall", "f v contact recall",
        "The lower lip touches the teeth where its inner edge is as high (against the still points of the face) as in "
        f"{TALKER_SHARE:.0%} of the talker's f and v, within the phone widened by 40 ms. Share of those phones in "
        "which the prediction's lip is as high.",
        _lips(True, "reached", "asked"), "high", (LOWER_LIP,),
    ),
    Measure(
        "contact_place", "lower lip on f v (UNIT)",
        "Mean over f and v of the highest place of the lower lip's inner edge within the phone widened by 40 ms, in "
        "UNITS of the reference frame, y downward.",
        _lips(True, "least", "phones"), "talker", (LOWER_LIP,),
    ),
    Measure(
        "lag", "lag (ms)",
        "Lag of the greatest cross-correlation of the aperture's velocity with the truth's, within 200 ms; "
        "positive is late. As jerk and power, over sentences whose speech was measured throughout.",
        _lag, "zero", (APERTURE,),
    ),
    Measure(
        "silence", "motion in silence (UNIT/s)",
        "Root mean square speed of the landmarks in silence, 100 ms beside speech left out (of the first coefficients "
        "in standard deviations where there are no landmarks).",
        _silence, "talker",
    ),
    Measure(
        "jerk", "jerk (1000 sd/s³)",
        "Root mean square third derivative of the first coefficients, each in its standard deviation, over "
        "speech.",
        _jerk, "talker",
    ),
    Measure(
        "high_power", f"power above {CUTOFF:.0f} Hz (%)",
        f"Share of the power of the first coefficients above {CUTOFF:.0f} Hz, over speech, each less its mean and "
        "in its standard deviation, under a Hann window.",
        _high, "talker",
    ),
)
"""All metrics, in the order of the tables."""
