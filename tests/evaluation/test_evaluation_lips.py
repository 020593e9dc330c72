"""Closures, contacts and their times, by hand."""

import numpy as np
import pytest

from dnnvss.evaluation.lips import closures, lip_events, spans, talker_level
from dnnvss.timing import FrameClock, Tier

CLOCK = FrameClock(100)
TIER = Tier("phones", [(0, 0.1, "sil"), (0.1, 0.2, "AA"), (0.2, 0.26, "B"), (0.26, 0.5, "AA"), (0.5, 0.56, "M"),
                       (0.56, 0.8, "AA"), (0.8, 0.9, "sil")])
SPEECH = np.array([10 <= t < 80 for t in range(90)])


def track(*closed: tuple[int, int]) -> np.ndarray:
    """Aperture 5, and 0 in the given half-open frame ranges; silence is closed."""
    x = np.full(90, 5.0)
    for a, b in [(0, 10), (80, 90), *closed]:
        x[a:b] = 0.0
    return x


def test_phones_are_widened_by_40_ms():
    assert spans(TIER, CLOCK, ("B", "M"), 90) == [slice(16, 30), slice(46, 60)]
    assert spans(TIER, CLOCK, ("B", "M"), 50) == [slice(16, 30), slice(46, 50)]


def test_the_talkers_level_is_a_quantile_of_the_least_apertures():
    deep, shallow = track((22, 25), (52, 54)), track((22, 25))
    shallow[51:53] = 1.0
    tiers = [TIER, TIER]
    assert talker_level([deep, shallow], tiers, CLOCK, ("B", "M"), share=1.0) == 1.0
    assert talker_level([deep, shallow], tiers, CLOCK, ("B", "M"), share=0.5) == 0.0
    assert np.isnan(talker_level([deep], [TIER], CLOCK, ("F",)))


def test_closures_are_runs_during_speech():
    assert closures(track((22, 25), (52, 54)), 0.5, SPEECH) == [(22, 25), (52, 54)]
    assert closures(track(), 0.5, SPEECH) == []


def test_events_by_hand():
    truth = track((22, 25), (52, 54))
    predicted = track((25, 28), (35, 37))  # B three frames late, M missed, one closure too many
    e = lip_events(truth, predicted, TIER, CLOCK, 0.5, SPEECH)
    assert (e.asked, e.reached, e.predicted, e.right, e.timed, e.phones) == (2, 1, 2, 1, 1, 2)
    assert e.onset_error == pytest.approx(0.03) and e.onset_distance == pytest.approx(0.03)
    assert e.least == pytest.approx(0.0 + 5.0)
    early = lip_events(truth, track((20, 24), (52, 54)), TIER, CLOCK, 0.5, SPEECH)
    assert early.onset_error == pytest.approx(-0.02) and early.onset_distance == pytest.approx(0.02)


def test_the_truth_that_is_late_closes_as_late_though_an_earlier_closure_reaches_into_the_phone():
    truth = track((14, 16), (22, 25))
    truth[14:16] = 0.4  # closed, and less so than the phone
    late = np.concatenate([truth[:1].repeat(4), truth[:-4]])
    e = lip_events(truth, late, TIER, CLOCK, 0.5, SPEECH, ("B",))
    assert e.timed == 1 and e.onset_error == pytest.approx(0.04) and e.onset_distance == pytest.approx(0.04)


def test_the_truth_itself_is_perfect():
    truth = track((22, 25), (52, 54))
    e = lip_events(truth, truth, TIER, CLOCK, 0.5, SPEECH)
    assert e.reached == e.asked == e.right == e.predicted == e.timed == 2 and e.onset_distance == 0


def test_a_mouth_that_was_closed_before_speech_has_no_onset():
    tier = Tier("phones", [(0, 0.1, "sil"), (0.1, 0.2, "B"), (0.2, 0.9, "AA")])
    truth = np.full(90, 5.0)
    truth[:15] = 0.0
    predicted = np.full(90, 5.0)
    predicted[:17] = 0.0
    e = lip_events(truth, predicted, tier, CLOCK, 0.5, np.arange(90) >= 10)
    assert e.reached == 1 and e.timed == 0


def test_phones_in_which_the_talker_does_not_close_are_not_asked_for():
    e = lip_events(track((22, 25)), track((22, 25), (52, 54)), TIER, CLOCK, 0.5, SPEECH)
    assert (e.asked, e.reached, e.predicted, e.right) == (1, 1, 2, 1)


def test_closures_beside_frames_that_were_not_measured_do_not_count():
    truth = track((22, 25))
    truth[33:37] = 0.0  # filled in
    valid = np.ones(90, bool)
    valid[32:38] = False
    e = lip_events(truth, track((22, 25), (39, 41), (52, 54)), TIER, CLOCK, 0.5, SPEECH & valid, valid=valid)
    assert (e.predicted, e.right) == (2, 1)
