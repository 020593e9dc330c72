"""Movement stays within what the talker showed: by hand, smoothly, and not where a key asks for more."""

import numpy as np
import pytest

from dnnvss.curves import derivatives
from dnnvss.face.base import Gauge
from dnnvss.style import Key, Style, Talker, generate, key_constraints
from dnnvss.style.within import OVER, Reach, reach_of
from dnnvss.synthesis.risks import key_risks
from dnnvss.timing import FrameClock, Tier

SUM = Gauge("aperture", np.array([1.0, 1.0]), 2.0)
REACH = Reach(np.array([-1.0, -2.0]), np.array([1.0, 2.0]), {"aperture": SUM}, {"aperture": (0.0, 4.0)})
CLOCK = FrameClock(100)
TIER = Tier("phones", [(0, 1, "AA")])


def test_the_bend_is_the_formula_and_inside_nothing_changes() -> None:
    x = np.array([[0.5, -1.0], [1.0, 1.0], [0.0, 2.5], [-1.3, 0.0]])
    assert REACH.limited(x[:1]) is not None and (REACH.limited(x[:2]) == x[:2]).all()
    free = Reach(REACH.low, REACH.high, {}, {})
    room = OVER * 4.0
    once = 2.0 + room * (1 - np.exp(-0.5 / room))
    assert free.limited(x)[2, 1] == pytest.approx(2.0 + room * (1 - np.exp(-(_bend(once) - 2.0) / room)))
    assert free.limited(x)[3, 0] > -1 - OVER * 2
    assert free.limited(x)[0].tolist() == x[0].tolist()


def _bend(value: float) -> float:
    room = OVER * 4.0
    return 2.0 + room * (1 - np.exp(-(value - 2.0) / room))


def test_gauges_stay_within_too_and_the_way_is_smooth() -> None:
    way = np.linspace(-3, 3, 20001)[:, None] * np.array([1.0, 2.0])
    bent = REACH.limited(way)
    assert SUM(bent).min() > 0 - OVER * 4 - 0.01 and SUM(bent).max() < 4 + OVER * 4 + 0.01
    speed = np.diff(bent, axis=0) / np.diff(way, axis=0)
    assert (np.diff(SUM(bent)) > -1e-6).all() and speed.max() < 1.1
    assert np.abs(np.diff(speed, axis=0)).max() < 0.02  # no corner at the ends of the range


def test_an_exaggerating_dial_widens_the_range() -> None:
    wide = REACH.widened(1.5)
    assert wide.low.tolist() == [-1.5, -3.0] and wide.spans["aperture"] == (-1.0, 5.0)
    assert REACH.widened(Style(articulation=0.5).widest) is REACH and Style(by_group={"jaw": 2.0}).widest == 2.0


def test_what_trajectories_reach() -> None:
    found = reach_of([np.array([[0.0, 1.0], [2.0, -1.0]]), np.array([[1.0, 3.0]]), np.zeros((0, 2))], {"aperture": SUM})
    assert found.low.tolist() == [0.0, -1.0] and found.high.tolist() == [2.0, 3.0]
    assert found.spans["aperture"] == (3.0, 6.0)


def _talker() -> Talker:
    return Talker(np.ones(2), np.zeros(2), np.ones(2), {"aperture": SUM}, {"aperture": 0.1}, np.ones(2), REACH)


def test_generated_movement_stays_within_and_a_key_is_obeyed() -> None:
    mean = derivatives(3.0 * np.sin(np.arange(100) / 9)[:, None] * np.ones(2)).astype(np.float32)
    variance = np.array([0.3, 0.03, 0.01])[:, None] * np.ones(2)
    style = Style(within=True, closures=True)
    x = generate(mean, variance, TIER, CLOCK, _talker(), style)
    over = OVER * (REACH.high - REACH.low) + 1e-2
    assert (x < REACH.high + over).all() and (x > REACH.low - over).all()
    key = Key(0.5, "aperture", 9.0, 9.0)
    held = generate(mean, variance, TIER, CLOCK, _talker(), style,
                    constraints=key_constraints([key], {"aperture": SUM}, CLOCK, 100, TIER))
    assert SUM(held)[50] == pytest.approx(9.0, abs=1e-3)
    assert (SUM(held)[:20] < 4.4).all()


def test_a_key_beyond_the_talker_is_told() -> None:
    keys = [Key(0.5, "aperture", 9.0, 9.0), Key(0.6, "aperture", 3.0, 9.0), Key(0.7, "aam02", -np.inf, -5.0)]
    told = key_risks(keys, REACH, ("aam01", "aam02"))
    assert [(time, risk["name"]) for time, risk in told] == [(0.5, "aperture"), (0.7, "aam02")]
    assert told[0][1]["showed"] == [0.0, 4.0] and not key_risks(keys, None, ())


def test_ranges_are_kept_with_the_talker(tmp_path) -> None:  # type: ignore[no-untyped-def]
    kept = Talker.load(_talker().save(tmp_path / "talker.npz"))
    assert kept.reach is not None and kept.reach.spans == REACH.spans
    assert (kept.reach.low == REACH.low).all() and kept.levels == {"aperture": 0.1}


def test_few_phones_and_few_sentences_are_shrunk() -> None:
    rng = np.random.default_rng(1)
    x = [rng.normal(size=(100, 2)) for _ in range(3)]
    few = _talker().knowing([0.5 * v for v in x[:1]], x[:1], [TIER], CLOCK)
    assert few.own == pytest.approx(np.exp(np.log(0.25) / 1.25) * np.ones(2), rel=1e-6)  # one sentence: 1 / (1 + .25)
    many = _talker().knowing([0.5 * v for v in x], x, [TIER] * 3, CLOCK)
    assert many.own == pytest.approx(0.25 * np.ones(2), rel=1e-6)  # three that agree leave no doubt
    assert _talker().knowing([0.01 * v for v in x], x, [TIER] * 3, CLOCK).own == pytest.approx([1 / 9] * 2)
