"""Fragments: the longest come first, its own sentence comes back, what is missing is backed off, joins are smooth."""

from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK, TABLE

from dnnvss.curves import STATIC_DELTA_DELTA2, derivatives
from dnnvss.errors import DnnvssError
from dnnvss.features import encode
from dnnvss.phones import phone_id
from dnnvss.systems import Example
from dnnvss.systems.examples import speech_frames
from dnnvss.systems.fragment_joins import WEIGHTINGS, blended, overlaps, resampled, warped
from dnnvss.systems.fragments import Fragments
from dnnvss.timing import Alignment, Tier


def sentence(
    name: str,
    words: list[tuple[str, list[str]]],
    frames: list[int],
    static: np.ndarray | None = None,
) -> Example:
    """A sentence of words with their phones; ``""`` is silence."""
    phones = [p for _, own in words for p in own]
    edges = np.cumsum([0, *frames]) / 100
    tier = Tier("phones", zip(edges[:-1], edges[1:], phones, strict=True))
    cuts = edges[np.cumsum([0, *(len(own) for _, own in words)])]
    spoken = Tier(
        "words", [(a, b, w) for a, b, (w, _) in zip(cuts[:-1], cuts[1:], words, strict=True)]
    )
    alignment = Alignment([tier, spoken])
    codes = encode(alignment, " ".join(w for w, _ in words if w), TABLE, CLOCK)
    if static is None:
        return Example(name, alignment, codes)
    return Example(
        name,
        alignment,
        codes,
        derivatives(static, STATIC_DELTA_DELTA2).astype(np.float32),
        np.ones(len(static), dtype=bool),
    )


def fitted(train: list[Example], **settings: object) -> Fragments:
    model = Fragments(TABLE, CLOCK, Fragments.Settings(**settings))  # type: ignore[arg-type]
    model.fit(train, train[:1], Path())
    return model


SIL = ("", ["sil"])
TALK = [("bat", ["B", "AE", "T"]), ("man", ["M", "AE", "N"])]


def ramp(frames: int, level: float = 0.0) -> np.ndarray:
    return np.stack([np.linspace(level, level + 1, frames), np.full(frames, level)], axis=1)


def test_its_own_sentence_comes_back_as_one_fragment(examples: dict) -> None:
    model = fitted(examples["train"])
    for example in examples["train"][:3]:
        found = model.fragments(example)
        assert [f.unit.kind for f in found] == ["sentence"] and found[0].sentences == (example.id,)
        assert np.abs(model.predict(example).mean[:, 0] - example.targets[:, 0]).max() < 1e-5


def test_the_longest_units_come_first_and_share_a_phone() -> None:
    one = sentence("one", [SIL, *TALK, SIL], [10, 8, 12, 8, 8, 12, 8, 10], ramp(76))
    two = sentence("two", [SIL, ("bad", ["B", "AE", "D"]), SIL], [10, 8, 12, 8, 10], ramp(48, 2.0))
    model = fitted([one, two])
    new = sentence(
        "new", [SIL, TALK[1], ("bad", ["B", "AE", "D"]), SIL], [10, 8, 12, 8, 8, 12, 8, 10]
    )
    told = model.report(new)["fragments"]
    assert [(f["unit"], f["phones"]) for f in told] == [
        ("diphone", "sil-M"),
        ("word", "M-AE-N"),
        ("diphone", "N-B"),
        ("word", "B-AE-D"),
        ("diphone", "D-sil"),
    ]
    assert [f.get("backed_off_to") for f in told] == ["sil-B", None, "T-M", None, None]
    runs = fitted([one, two], units=("any",)).report(new)["fragments"]
    assert [f["phones"] for f in runs] == ["sil-M", "M-AE-N", "N-B", "B-AE-D-sil"]


def test_ties_fall_by_timing_and_by_context() -> None:
    slow = sentence("slow", [SIL, TALK[0], SIL], [10, 16, 24, 16, 10], ramp(76))
    fast = sentence("fast", [SIL, TALK[0], SIL], [10, 8, 12, 8, 10], ramp(48, 2.0))
    met = sentence(
        "met", [("met", ["M", "EH", "T"]), TALK[0], SIL], [8, 8, 8, 8, 12, 8, 10], ramp(62, 4.0)
    )
    after = [("met", ["M", "EH", "T"]), TALK[0], ("", ["sil"])]
    wanted = sentence("new", [SIL, ("bats", ["B", "AE", "T", "S"]), SIL], [10, 15, 25, 16, 9, 10])
    found = fitted([slow, fast], units=("word", "diphone")).fragments(wanted)
    assert next(f for f in found if f.unit.kind == "word").sentences == ("slow",)
    model = fitted([fast, met], units=("word", "diphone"), timing=0.0)
    found = model.fragments(sentence("new", after, [8, 8, 8, 8, 12, 8, 10]))
    assert [f.sentences[0] for f in found if f.unit.kind == "word"][-1] == "met"


def test_boundaries_choose_pieces_that_agree_where_they_meet() -> None:
    flat = [
        sentence(f"s{k}", [SIL, TALK[0], SIL], [10, 8, 12, 8, 10], np.full((48, 2), level))
        for k, level in enumerate((0.0, 5.0))
    ]
    other = sentence(
        "o", [SIL, ("tap", ["T", "AE", "P"]), SIL], [10, 8, 12, 8, 10], np.full((48, 2), 5.0)
    )
    wanted = sentence("new", [SIL, TALK[0], ("app", ["AE", "P"]), SIL], [10, 8, 12, 8, 12, 8, 10])
    plain, agreed = fitted([*flat, other]), fitted([*flat, other], boundary=10.0)
    assert {f.sentences[0] for f in agreed.fragments(wanted)} == {"s1", "o"}
    assert {f.sentences[0] for f in plain.fragments(wanted)} == {"s0", "o"}


def test_averages_of_several_places_and_their_stretch(examples: dict) -> None:
    one, four = (
        fitted(examples["train"], examples=n, own=False, units=("diphone",)) for n in (1, 4)
    )
    spread = [
        np.concatenate([m.predict(e).mean[:, 0] for e in examples["test"]]).var()
        for m in (one, four)
    ]
    assert spread[1] < spread[0]
    wide = fitted(examples["train"], examples=4, own=False, units=("diphone",), stretch=True)
    still = fitted(examples["train"], examples=4, own=False, units=("diphone",))
    example = examples["train"][0]
    speech = speech_frames(example.alignment, CLOCK)
    said, plain = (m.predict(example).mean[:, 0][speech] for m in (wide, still))
    wanted = np.clip(example.targets[speech, 0].std(axis=0) / plain.std(axis=0), 1, 1.5)
    assert said.std(axis=0) == pytest.approx(wanted * plain.std(axis=0), rel=1e-4)


def test_validation_in_which_nobody_speaks_tells_no_stretch(examples: dict) -> None:
    hush = sentence("hush", [SIL], [30], ramp(30)[:, [0, 1, 1]])
    model = Fragments(TABLE, CLOCK, Fragments.Settings(stretch=True))
    model.fit(examples["train"], [hush], Path())
    assert model.stretch_.tolist() == [1.0] * 3
    plain = fitted(examples["train"]).predict(examples["test"][0]).mean
    assert model.predict(examples["test"][0]).mean == pytest.approx(plain)


def test_recordings_without_two_neighbouring_phones_are_refused() -> None:
    with pytest.raises(DnnvssError, match="no two neighbouring phones"):
        fitted([sentence(f"hush{k}", [SIL], [30], ramp(30)) for k in range(2)])


@pytest.mark.parametrize("count", [2, 3, 40, 300])
def test_the_interpolant_goes_through_every_frame_and_keeps_lines(count: int) -> None:
    values = np.random.default_rng(0).normal(size=(count, 4)).cumsum(axis=0)
    frames = np.arange(count, dtype=float)
    assert np.abs(resampled(values, frames) - values).max() < 1e-9
    between = np.linspace(0, count - 1, 77)
    assert resampled(2 * frames[:, None] + 1, between)[:, 0] == pytest.approx(2 * between + 1)
    wave = np.sin(frames / 6)[:, None]
    assert np.abs(resampled(wave, between)[:, 0] - np.sin(between / 6)).max() < 0.06  # at its ends


def test_frames_are_warped_by_the_edges_of_phones() -> None:
    source, target = np.array([10.0, 20, 40]), np.array([0.0, 20, 30])
    assert warped(np.array([10.0, 15, 20, 30, 40, 42, 8]), source, target).tolist() == [
        0,
        10,
        20,
        25,
        30,
        32,
        -2,
    ]


def test_overlaps_stay_below_the_shortest_phone_beside_them() -> None:
    edges = np.array([0.0, 20, 24, 44, 64])
    assert overlaps(edges, np.array([1, 2]), 0.5).tolist() == [1.0, 1.0]
    assert overlaps(edges, np.array([3]), 0.5).tolist() == [5.0]


@pytest.mark.parametrize("name", WEIGHTINGS)
def test_blends_are_weighted_means_and_leave_the_rest_alone(name: str) -> None:
    pieces = [(0, np.zeros((12, 1))), (8, np.ones((12, 1)))]
    out = blended(pieces, np.array([10.0]), np.array([2.0]), 20, name)[:, 0]
    assert (out[:8] == 0).all() and (out[12:] == 1).all() and (np.diff(out) >= 0).all()
    assert 0 < out[8] < out[11] < 1 and WEIGHTINGS[name](
        np.array([0.0, 1.0])
    ).tolist() == pytest.approx([1, 0])


def test_a_sentence_of_one_phone_and_one_of_unheard_phones_are_said() -> None:
    model = fitted([sentence("one", [SIL, *TALK, SIL], [10, 8, 12, 8, 8, 12, 8, 10], ramp(76))])
    assert model.predict(sentence("hush", [SIL], [30])).mean.shape == (30, 3, 2)
    odd = sentence("odd", [("joy", ["JH", "OY"])], [9, 21])
    assert np.isfinite(model.predict(odd).mean).all()
    assert model.report(odd)["fragments"][0]["backed_off_to"]
    assert phone_id("JH") != phone_id("OY")
