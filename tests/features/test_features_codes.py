"""Frame codes against the plain reading, joined stores, disk, tensors."""

import gc
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import torch
from features.features_cases import alignments, frames_of
from features.features_oracle import dense
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dnnvss.errors import DnnvssError
from dnnvss.features import CodeStore, FeatureTable, FrameCodes, catalogue, encode, expand
from dnnvss.features.block import Settings
from dnnvss.text.tree import linguistic_tree
from dnnvss.timing import Alignment, FrameClock, Tier

UNITS = Settings(window_before=3, window_after=5, units=12)
ALL = FeatureTable(tuple(n for n, b in catalogue(UNITS).items() if {"phones", "visemes"} & {*b.reads}), UNITS)
CLOCK = FrameClock(100)


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(alignments(), st.sampled_from(["100", "29.97", "25"]))
def test_every_block_equals_a_plain_reading(alignment: Alignment, rate: str) -> None:
    clock = FrameClock(rate)
    codes = encode(alignment, "", ALL, clock)
    expected = dense(alignment, linguistic_tree(alignment, ""), clock, list(ALL.columns), list(UNITS.offsets))
    got = expand(codes)
    assert got.shape == expected.shape
    wrong = np.unique(np.nonzero(~np.isclose(got, expected))[1])
    assert not len(wrong), [ALL.columns[c] for c in wrong[:5]]


def _utterances(count: int = 6) -> list[tuple[str, FrameCodes]]:
    rng = np.random.default_rng(3)
    made = []
    for n in range(count):
        edges = np.concatenate([[0], np.cumsum(rng.uniform(0.004, 0.12, 9))])
        labels = ["sil", *rng.choice(["AA", "M", "UW", "S", "L", "IY"], 7), "sil"]
        words = [(edges[0], edges[1], ""), (edges[1], edges[4], "one"), (edges[4], edges[8], "two"),
                 (edges[8], edges[9], "")]
        cuts = [0, *np.sort(rng.uniform(0.02, edges[-1] - 0.02, 4)), edges[-1]]
        tiers = [Tier("phones", zip(edges[:-1], edges[1:], labels, strict=True)), Tier("words", words),
                 Tier("visemes", zip(cuts[:-1], cuts[1:], map(str, rng.integers(0, 12, 5)), strict=True))]
        made.append((f"u{n}", encode(Alignment(tiers), "one two", ALL, CLOCK)))
    return made


def test_a_store_serves_each_utterance_as_if_alone() -> None:
    parts = _utterances()
    store = CodeStore.join(parts)
    assert len(store) == sum(len(c) for _, c in parts)
    assert store.utterances == 6
    for name, codes in parts:
        np.testing.assert_array_equal(expand(store, frames_of(store, name)), expand(codes))
    mixed = np.random.default_rng(0).integers(0, len(store), 300)
    np.testing.assert_array_equal(store.active(mixed), store.active(np.arange(len(store)))[mixed])
    np.testing.assert_array_equal(store.numeric(mixed), store.numeric(np.arange(len(store)))[mixed])
    again = CodeStore.join([("all", CodeStore.join(parts[:3])), ("rest", CodeStore.join(parts[3:]))])
    assert again.ids == store.ids
    np.testing.assert_array_equal(expand(again), expand(store))


def test_active_is_a_padded_list_without_repeats() -> None:
    store = CodeStore.join(_utterances())
    active = store.active(np.arange(len(store)))
    assert active.dtype == np.int32
    assert active.shape == (len(store), ALL.active_width)
    assert active.min() >= 0
    assert active.max() == ALL.binary_width
    for row in active:
        used = row[row < ALL.binary_width]
        assert len(set(used)) == len(used)
    numeric = store.numeric(np.arange(len(store)))
    assert numeric.dtype == np.float32
    assert numeric.shape == (len(store), ALL.numeric_width)
    np.testing.assert_array_equal((active < ALL.binary_width).sum(1), expand(store)[:, ALL.binary_columns].sum(1))


def test_tensors_give_the_same_numbers() -> None:
    store = CodeStore.join(_utterances())
    tensors = store.to("cpu")
    frames = np.random.default_rng(1).integers(0, len(store), 100)
    active, numeric = tensors.active(torch.as_tensor(frames)), tensors.numeric(torch.as_tensor(frames))
    assert active.dtype == torch.int32
    assert numeric.dtype == torch.float32
    np.testing.assert_array_equal(active.numpy(), store.active(frames))
    np.testing.assert_array_equal(numeric.numpy(), store.numeric(frames))


def test_saved_and_opened_without_reading(tmp_path: Path) -> None:
    store = CodeStore.join(_utterances())
    opened = CodeStore.open(store.save(tmp_path / "codes"))
    assert opened.ids == store.ids
    assert opened.rate == "100"
    assert isinstance(opened.arrays["phone"].base, np.memmap)
    np.testing.assert_array_equal(expand(opened), expand(store))
    small = CodeStore.open(tmp_path / "codes", FeatureTable(("centre_phone",)))
    assert small.active(np.arange(4)).shape == (4, 1)
    np.save(tmp_path / "codes" / "phone.npy", store.arrays["phone"][:-1])
    with pytest.raises(DnnvssError, match=r"phone.npy: has \d+ rows"):
        CodeStore.open(tmp_path / "codes")
    with pytest.raises(DnnvssError, match="Encode the corpus first"):
        CodeStore.open(tmp_path / "nowhere")


def test_small_on_disk() -> None:
    store = CodeStore.join(_utterances())
    per_frame = sum(a.nbytes for a in store.arrays.values() if len(a) == len(store)) / len(store)
    assert per_frame == 11  # phone 1, its segment 4, viseme 2, its segment 4: whatever the table's thousands of columns


def test_codes_serve_any_table() -> None:
    codes = _utterances(1)[0][1]
    table = FeatureTable(("phone_span", "centre_viseme"), UNITS)
    assert expand(codes.with_table(table)).shape == (len(codes), 13)
    with pytest.raises(DnnvssError, match="outside the table's 2 units"):
        codes.with_table(FeatureTable(("centre_viseme",), Settings(units=2)))
    phones_only = encode(_simple(), "", FeatureTable(("centre_phone",)), CLOCK)
    with pytest.raises(DnnvssError, match="'centre_viseme' needs dynamic visemes"):
        phones_only.with_table(table)


def _simple(label: str = "3", length: float = 0.2) -> Alignment:
    return Alignment([Tier("phones", [(0, length, "AA")]), Tier("words", [(0, length, "a")]),
                      Tier("visemes", [(0, length, label)])])


@pytest.mark.parametrize("label", ["rest", "12", "-1", ""])
def test_unknown_unit(label: str) -> None:
    with pytest.raises(DnnvssError, match="is no unit from 0 to 11"):
        encode(_simple(label), "a", ALL, CLOCK)


def test_refusals() -> None:
    with pytest.raises(DnnvssError, match="shorter than half a frame"):
        encode(_simple(length=0.004), "a", ALL, CLOCK)
    with pytest.raises(DnnvssError, match="segment of 70000 frames"):
        encode(_simple(length=700), "a", ALL, CLOCK)
    with pytest.raises(DnnvssError, match="no tier 'visemes'"):
        encode(Alignment(_simple().tiers[:2]), "a", ALL, CLOCK)
    pair = _utterances(2)
    with pytest.raises(DnnvssError, match="each once"):
        CodeStore.join([pair[0], pair[0]])
    with pytest.raises(DnnvssError, match="utterance u1: codes of different"):
        CodeStore.join([pair[0], ("u1", pair[1][1].with_table(FeatureTable(("phone_span",))))])


def test_a_tier_whose_end_rounds_elsewhere_loses_no_frame() -> None:
    tiers = [Tier("phones", [(0, 0.2, "AA"), (0.2, 0.40496, "M")]), Tier("words", [(0, 0.40496, "am")]),
             Tier("visemes", [(0, 0.3, "1"), (0.3, 0.40503, "2")])]
    codes = encode(Alignment(tiers), "am", ALL, CLOCK)
    assert len(codes) == 40
    assert codes.arrays["viseme_frames"].sum() == 40


def test_a_batch_leaves_nothing_in_memory() -> None:
    """Not even until the next collection of circles: arrays of a batch are many MB."""
    codes = CodeStore.join(_utterances())
    frames = np.tile(np.arange(len(codes)), 20)
    codes.numeric(frames), codes.active(frames)  # what is kept for all batches
    gc.collect()
    gc.disable()
    tracemalloc.start()
    try:
        codes.numeric(frames), codes.active(frames)
        left = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
        gc.enable()
    assert left < 4 * len(frames)
