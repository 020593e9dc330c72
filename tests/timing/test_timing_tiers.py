"""Tier and Alignment: contiguous, no frame lost, whatever the rate."""

import json
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dnnvss.errors import DnnvssError
from dnnvss.timing import Alignment, FrameClock, Segment, Tier

RATES = st.sampled_from(["25", "29.97", "30", "60", "100", "200", "12.5"])


@st.composite
def tiers(draw: st.DrawFn, name: str = "phones", start: float | None = None) -> Tier:
    """Segments of 0.3 ms to 0.5 s, as decimals of a tenth of a millisecond, as files have them."""
    begin = draw(st.integers(0, 50_000)) if start is None else round(start * 1e4)
    lengths = draw(st.lists(st.integers(3, 5_000), min_size=1, max_size=40))
    edges = [begin, *(begin + np.cumsum(lengths)).tolist()]
    return Tier(name, [(a / 1e4, b / 1e4, str(i)) for i, (a, b) in enumerate(pairwise(edges))])


@given(tiers(), RATES)
def test_no_frame_is_lost(tier: Tier, rate: str) -> None:
    clock = FrameClock(rate)
    edges, index = tier.frame_edges(clock), tier.frame_index(clock)
    durations = np.diff(edges)
    assert (durations >= 0).all()
    assert durations.sum() == clock.edge(tier.end) - clock.edge(tier.start) == len(index)
    assert np.bincount(index, minlength=len(tier)).tolist() == durations.tolist()
    assert (np.diff(index) >= 0).all()


@given(tiers(), RATES)
def test_each_frame_centre_lies_in_its_segment(tier: Tier, rate: str) -> None:
    clock = FrameClock(rate)
    first = clock.edge(tier.start)
    half = 0.5 / float(clock.rate)
    for frame, segment in enumerate(tier.frame_index(clock)):
        centre = clock.seconds(first + frame) + half
        assert tier[segment].start - 1e-8 <= centre + 1e-8
        assert centre <= tier[segment].end + 1e-8


@given(tiers(), RATES)
def test_segments_shorter_than_a_frame_keep_their_place_and_own_nothing(tier: Tier, rate: str) -> None:
    clock = FrameClock(rate)
    owned = set(tier.frame_index(clock).tolist())
    for i, segment in enumerate(tier):
        if clock.edge(segment.start) == clock.edge(segment.end):
            assert i not in owned
            assert segment.duration <= 1 / float(clock.rate) + 1e-9
        else:
            assert i in owned
    assert len(tier.labels) == len(tier) == len(tier.edges) - 1


def test_a_phone_of_no_frame_by_hand() -> None:
    tier = Tier("phones", [(0, 0.011, "A"), (0.011, 0.014, "B"), (0.014, 0.03, "C")])
    assert tier.frame_edges(FrameClock(100)).tolist() == [0, 1, 1, 3]
    assert tier.frame_index(FrameClock(100)).tolist() == [0, 2, 2]
    assert tier.labels == ("A", "B", "C")


def test_many_short_phones_at_ntsc_lose_nothing() -> None:
    edges = np.arange(7501) * 0.08  # ten minutes; each phone is 2.4 frames, so rounding durations would lose a sixth
    tier = Tier("phones", zip(edges[:-1], edges[1:], ["AH"] * 7500, strict=True))
    assert len(tier.frame_index(FrameClock("29.97"))) == 17982
    assert set(np.diff(tier.frame_edges(FrameClock("29.97"))).tolist()) == {2, 3}


@given(tiers(), st.floats(0, 6))
def test_the_segment_at_a_time(tier: Tier, seconds: float) -> None:
    index = int(tier.indices_at(np.array([seconds]))[0])
    inside = tier.start <= seconds < tier.end
    if inside:
        assert tier[index].start <= seconds < tier[index].end
    else:
        assert index == (0 if seconds < tier.start else len(tier) - 1)


@given(tiers(), st.floats(-1, 1))
def test_moved_and_renamed(tier: Tier, by: float) -> None:
    moved = tier.moved(by)
    np.testing.assert_allclose(moved.edges, tier.edges + by)
    assert moved.labels == tier.labels
    assert tier.renamed(["x"] * len(tier)).labels == ("x",) * len(tier)
    assert tier.moved(by).moved(-by).renamed(tier.labels).labels == tier.labels


@given(tiers())
def test_json_round_trip(tier: Tier) -> None:
    alignment = Alignment([tier, Tier("words", [(tier.start, tier.end, "")])])
    assert Alignment.from_json(json.loads(json.dumps(alignment.to_json()))) == alignment


@given(tiers(), st.floats(-9e-5, 9e-5), st.floats(-9e-5, 9e-5), RATES)
def test_tiers_that_nearly_agree_get_the_same_frames(tier: Tier, early: float, late: float, rate: str) -> None:
    middle = (tier.start + tier.end) / 2
    other = Tier("visemes", [(tier.start + early, middle, "1"), (middle, tier.end + late, "2")])
    alignment = Alignment([tier, other])
    clock = FrameClock(rate)
    assert len(alignment["visemes"].frame_index(clock)) == len(alignment["phones"].frame_index(clock))
    assert (alignment["visemes"].start, alignment["visemes"].end) == (tier.start, tier.end)
    assert alignment.start == tier.start


def test_edges_within_the_tolerance_are_joined() -> None:
    tier = Tier("phones", [(0, 0.50004, "A"), (0.5, 1.0, "B"), (1.00009, 2, "C")])
    assert tier.edges.tolist() == [0, 0.50004, 1.0, 2]
    assert tier[1] == Segment(0.50004, 1.0, "B")
    assert tier[1].duration == pytest.approx(0.49996)


@pytest.mark.parametrize(("segments", "message"), [
    ([], "tier 'phones' has no segment"),
    ([(0, 0.1, "A"), (0.2, 0.3, "B")], "gap of 0.1000 s between 'A', which ends at 0.1000 s, and 'B'"),
    ([(0, 0.1, "A"), (0.05, 0.3, "B")], "overlap of 0.0500 s between 'A'"),
    ([(0.1, 0.1, "A")], "segment 'A' runs from 0.1 to 0.1 s"),
    ([(0.2, 0.1, "A")], "segment 'A' runs from 0.2 to 0.1 s"),
    ([(0, float("nan"), "A")], "segment 'A' runs from 0 to nan s"),
    ([(0, float("inf"), "A")], "segment 'A' runs from 0 to inf s"),
    ([(0, 0.1, "A"), (0.09995, 0.1, "B"), (0.1, 0.2, "C")], "segment 'B' ends at 0.1 s, where the one before it ends"),
])
def test_bad_tiers(segments: list, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        Tier("phones", segments)


def test_bad_alignments() -> None:
    phones = Tier("phones", [(0, 1, "A")])
    with pytest.raises(DnnvssError, match="tiers of different names"):
        Alignment([])
    with pytest.raises(DnnvssError, match="tiers of different names"):
        Alignment([phones, phones])
    with pytest.raises(DnnvssError, match=r"tier 'words' spans 0.0000 to 1.1000 s, tier 'phones' 0.0000 to 1.0000 s"):
        Alignment([phones, Tier("words", [(0, 1.1, "")])])
    with pytest.raises(DnnvssError, match=r"no tier 'visemes' among \['phones'\]"):
        Alignment([phones])["visemes"]


def test_tiers_are_added_and_replaced() -> None:
    phones, words = Tier("phones", [(0, 1, "A")]), Tier("words", [(0, 1, "a")])
    alignment = Alignment([phones]).with_tier(words)
    assert "words" in alignment
    assert "visemes" not in alignment
    replaced = alignment.with_tier(Tier("words", [(0, 0.5, "b"), (0.5, 1, "c")]))
    assert replaced["words"].labels == ("b", "c")
    assert replaced["phones"] == phones
    assert (replaced.start, replaced.end) == (0, 1)


def test_a_tier_ahead_keeps_its_span() -> None:
    tier = Tier("phones", [(0.5, 0.75, "A"), (0.75, 1.0, "B"), (1.0, 2.0, "C")])
    assert [tuple(s) for s in tier.ahead(0.25)] == [(0.5, 0.75, "B"), (0.75, 2.0, "C")]
    assert [tuple(s) for s in tier.ahead(-0.5)] == [(0.5, 1.25, "A"), (1.25, 1.5, "B"), (1.5, 2.0, "C")]
    assert [s.label for s in tier.ahead(9)] == ["C"] and [s.label for s in tier.ahead(-9)] == ["A"]
    assert tier.ahead(0) == tier
