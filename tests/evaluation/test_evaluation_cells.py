"""How numbers stand in tables: one form for values, intervals and p, whoever writes them."""

import math

from dnnvss.evaluation.cells import NONE, interval, number, number_of, p_value
from dnnvss.evaluation.statistics import Difference, Estimate
from dnnvss.evaluation.viewing.shares import Share
from dnnvss.evaluation.viewing.tables import Score

NAN = math.nan


def test_three_decimals_and_two_from_ten_on() -> None:
    assert [number(v) for v in (0.12345, -9.9994, 10.0, -123.456, NAN)] == ["0.123", "-9.999", "10.00", "-123.46", NONE]
    assert [number(v, 1) for v in (0.16, 55.55, -100.0, NAN)] == ["0.2", "55.5", "-100.0", NONE]


def test_zero_has_no_sign() -> None:
    assert [number(-0.0002), number(-0.04, 1), number(-0.0006)] == ["0.000", "0.0", "-0.001"]


def test_an_interval_stands_the_same_behind_a_system_and_behind_viewers() -> None:
    kinds = (Estimate(12.3, 0.5, 20), Difference(12.3, 0.5, 20, 0.1), Share(12.3, 0.5, 20, 0.1), Score(12.3, 0.5, 20))
    assert {interval(found) for found in kinds} == {"12.30 (0.500 to 20.00)"}
    assert {interval(found, 1) for found in kinds} == {"12.3 (0.5 to 20.0)"}
    assert interval(Estimate(0.5, NAN, NAN)) == "0.500" and interval(Estimate(NAN, NAN, NAN)) == NONE


def test_counts_and_p() -> None:
    assert [number_of(n, "sentence") for n in (0, 1, 2)] == ["0 sentences", "1 sentence", "2 sentences"]
    assert [p_value(p) for p in (0.00009, 0.0001, 0.25, NAN)] == ["< .0001", "0.0001", "0.2500", NONE]
