"""FrameClock: exact rates, rounding of edges, no drift."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dnnvss.errors import DnnvssError
from dnnvss.timing import FrameClock

RATES = ["25", "29.97", "30", "50", "59.94", "100", "119.88", "200", "23.976"]


@pytest.mark.parametrize(("given", "exact"), [
    (25, Fraction(25)), ("25", Fraction(25)), (25.0, Fraction(25)), ("30000/1001", Fraction(30000, 1001)),
    ("29.97", Fraction(30000, 1001)), (29.97, Fraction(30000, 1001)), (30000 / 1001, Fraction(30000, 1001)),
    (Fraction(30000, 1001), Fraction(30000, 1001)), ("59.94", Fraction(60000, 1001)), ("23.976", Fraction(24000, 1001)),
    ("12.5", Fraction(25, 2)),
])
def test_rates_are_exact(given: object, exact: Fraction) -> None:
    assert FrameClock(given).rate == exact
    assert FrameClock(str(FrameClock(given))) == FrameClock(given)


@pytest.mark.parametrize("rate", ["", "abc", 0, -25, "1/0", float("nan"), float("inf")])
def test_bad_rates(rate: object) -> None:
    with pytest.raises(DnnvssError, match="frame rate"):
        FrameClock(rate)


@pytest.mark.parametrize(("seconds", "edge"), [(0, 0), (0.004, 0), (0.005, 1), (0.285, 29), (0.2849, 28), (1.115, 112),
                                               (-0.005, 0), (-0.0051, -1)])
def test_halves_go_up_also_those_that_floats_miss(seconds: float, edge: int) -> None:
    assert FrameClock(100).edge(seconds) == edge  # 0.285 x 100 is 28.499999999999996


def test_ten_minutes_and_ten_hours_of_ntsc() -> None:
    clock = FrameClock("29.97")
    assert clock.edge(600) == 17982  # 600 x 30000 / 1001 = 17982.02
    assert clock.edge(36000) == 1078921  # .08; a clock of 29.97 exactly would be a frame and more behind
    assert clock.seconds(1078921) == pytest.approx(1078921 * 1001 / 30000, abs=1e-9)


@given(st.sampled_from(RATES), st.integers(0, 20_000_000))
def test_an_edge_survives_its_time(rate: str, edge: int) -> None:
    clock = FrameClock(rate)
    assert clock.edge(clock.seconds(edge)) == edge


@given(st.sampled_from(RATES), st.lists(st.floats(0, 36000), min_size=1, max_size=30))
def test_edges_are_nearest_and_in_order(rate: str, times: list[float]) -> None:
    clock = FrameClock(rate)
    seconds = np.sort(np.array(times))
    edges = clock.edges(seconds)
    assert (np.diff(edges) >= 0).all()
    for second, edge in zip(seconds, edges, strict=True):
        assert abs(Fraction(float(second)) * clock.rate - int(edge)) <= Fraction(1, 2) + Fraction(1, 10**7)
    assert [clock.edge(s) for s in seconds] == edges.tolist()


@given(st.sampled_from(RATES), st.integers(0, 500))
def test_centres_lie_halfway_between_edges(rate: str, count: int) -> None:
    clock = FrameClock(rate)
    centres = clock.centres(count)
    assert centres.shape == (count,)
    middles = [(clock.seconds(i) + clock.seconds(i + 1)) / 2 for i in range(count)]
    np.testing.assert_allclose(centres, middles, rtol=1e-12)
    np.testing.assert_array_equal(clock.times(np.arange(count)), [clock.seconds(i) for i in range(count)])
