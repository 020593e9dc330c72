"""The feature table: widths, names, configuration, mismatches; the scaler of numeric columns."""

import json
from pathlib import Path

import numpy as np
import pytest
from omegaconf import OmegaConf

from dnnvss.errors import DnnvssError
from dnnvss.features import CodeStore, FeatureTable, NumericScaler, Settings, catalogue, encode
from dnnvss.timing import Alignment, FrameClock, Tier

CONF = Path(__file__).parents[2] / "conf" / "labels"


def load(name: str) -> FeatureTable:
    return FeatureTable.from_config(OmegaConf.load(CONF / f"{name}.yaml"))


@pytest.mark.parametrize(("name", "width"), [
    # 41 centre, 57 classes, 205 context, 3 + 1 syllable, 3 + 1 word, 2 (3 + 1) phrase, 3 x 3 utterance
    ("ph_a", 41 + 57 + 205 + 4 + 4 + 8 + 9),
    ("ph_b", 328 + 3 + 1),
    ("ph_c", 328 + 32 * 41 + 1),
    ("ph_d", 328 + 32 * 41 + 1 + 3 + 1),
    ("ph_e", 328 + 32 * 41 + 1 + 3 + 1 - 57),
    ("ph", 1645),
    # 160 centre, window, 3 + 1 position and number, span, context, phones in viseme, 3 + 1 syllable; word and above 21
    ("dv", 160 + 32 * 160 + 4 + 1 + 5 * 160 + 1 + 4 + 21),
    ("ph_dv", 1645 + 6090),
    ("mel", 40 + 10 * 40),
    ("ph_mel", 1645 + 440),
])
def test_width_of_the_configured_tables(name: str, width: int) -> None:
    table = load(name)
    assert table.width == width == len(set(table.columns))
    assert table.binary_width + table.numeric_width == width


def test_the_paper_sets_name_the_blocks_of_table_2() -> None:
    crosses = {"centre_phone": "abcde", "phone_window": "cde", "phone_position": "bde", "phone_frames": "bde",
               "phone_span": "cde", "acoustic_class": "abcd"}
    higher = {b.name for b in load("ph_a").blocks if b.level != "frame"}
    for letter in "abcde":
        blocks = load(f"ph_{letter}").blocks
        assert {b.name for b in blocks if b.level == "frame"} == {n for n, sets in crosses.items() if letter in sets}
        assert {b.name for b in blocks if b.level != "frame"} == higher
    assert load("ph").hash == load("ph_d").hash


def test_every_configuration_loads_and_ours_stays_out_of_the_papers() -> None:
    for path in CONF.glob("*.yaml"):
        table, config = load(path.stem), OmegaConf.load(path)
        assert config.name == path.stem
        ours = any(b.paper == "ours" and "phones" in b.reads for b in table.blocks)
        assert (path.stem in ("ph_plus", "ph_class")) == ours


@pytest.mark.parametrize(("name", "numeric", "needs"), [
    ("voice", 384 * 5, {"sound"}),  # at the frame and at four around
    ("voice_mel", 40 * 11, {"sound"}),
    ("ph_voice", 384 * 5 + load("ph").numeric_width, {"sound", "phones", "words"}),
    ("ph_dv_voice", 384 * 5 + load("ph_dv").numeric_width, {"sound", "phones", "words", "visemes"}),
])
def test_labels_of_the_voice(name: str, numeric: int, needs: set[str]) -> None:
    table = load(name)
    assert (table.numeric_width, table.needs) == (numeric, needs)
    assert table.settings.logmel.causal == (name == "voice_mel")


def test_every_row_of_table_1_is_a_block() -> None:
    sources = {b.paper.removeprefix("Thangthai 2016, Table 1, ") for b in catalogue(Settings()).values()
               if b.paper.startswith("Thangthai")}
    assert sources == {
        "frame: centre phoneme", "frame: phonetic window context", "frame: position and number of frames in phoneme",
        "frame: forward phoneme span", "frame: acoustic class", "frame: centre dynamic viseme",
        "frame: dynamic viseme window context", "frame: position and number of frames in dynamic viseme",
        "frame: forward dynamic viseme span", "segment: phoneme context", "segment: dynamic viseme context",
        "segment: number of phonemes in dynamic viseme", "syllable: position and number of phonemes in syllable",
        "syllable: position and number of dynamic visemes in syllable",
        "word: position and number of syllables in word", "phrase: position and number of syllables in phrase",
        "phrase: position and number of words in phrase",
        "utterance: position of syllable in utterance", "utterance: position of word in utterance",
        "utterance: position of phrase in utterance",
    }  # fmt: skip


def test_slices_cover_the_columns_in_order() -> None:
    table = FeatureTable(("phone_frames", "centre_phone", "phone_span", "phone_position"))
    assert table.slices == {"phone_frames": slice(0, 1), "centre_phone": slice(1, 42), "phone_span": slice(42, 43),
                            "phone_position": slice(43, 46)}
    assert table.binary_slices == {"centre_phone": slice(0, 41), "phone_position": slice(41, 44)}
    assert table.numeric_slices == {"phone_frames": slice(0, 1), "phone_span": slice(1, 2)}
    assert table.binary_columns.tolist() == [*range(1, 42), 43, 44, 45]
    assert table.numeric_columns.tolist() == [0, 42]
    assert table.active_width == 2
    assert table.columns[1] == "centre_phone/AA"


def test_description_survives_json() -> None:
    table = FeatureTable(("viseme_window", "phone_span"), Settings(window_before=2, window_after=0, units=5))
    again = FeatureTable.from_description(json.loads(json.dumps(table.describe())))
    assert again == table
    assert again.hash == table.hash
    assert again.width == 11


@pytest.mark.parametrize(("other", "message"), [
    (FeatureTable(("centre_phone", "phone_span")), "block 'phone_window' stands where the run has 'phone_span'"),
    (FeatureTable(("centre_phone", "phone_window", "phone_span"), Settings(window_before=3)),
     "block 'phone_window' has 1312 columns, in the run 779"),
    (FeatureTable(("centre_phone",)), "block 'phone_window' is only here"),
    (FeatureTable(("centre_phone", "phone_window", "phone_span", "phone_frames")),
     "block 'phone_frames' is only in the run"),
    (FeatureTable(("centre_phone", "phone_window", "phone_span"), Settings(window_before=15, window_after=17)),
     "block 'phone_window' means something else in the run"),
])
def test_the_first_block_that_differs_is_named(other: FeatureTable, message: str) -> None:
    table = FeatureTable(("centre_phone", "phone_window", "phone_span"))
    assert other.hash != table.hash
    with pytest.raises(DnnvssError, match=message):
        table.check(other.describe())
    table.check(table.describe())


@pytest.mark.parametrize(("config", "message"), [
    ({"blocks": ["centre_phone", "phone_winow"]}, "no feature block 'phone_winow'.*phone_window"),
    ({"blocks": ["centre_phone", "centre_phone"]}, "hold one twice"),
    ({"blocks": []}, "are none or hold one twice"),
    ({"blocks": ["centre_phone"], "window": 3}, "labels.window is no setting"),
    ({"blocks": ["centre_phone"], "window_before": -1}, "labels.window_before=-1 is too little"),
    ({"blocks": ["centre_phone"], "units": 0}, "labels.units=0 is too little"),
    ({"blocks": ["phone_window"], "window_before": 0, "window_after": 0}, "no feature block 'phone_window'"),
])
def test_bad_configurations(config: dict, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        FeatureTable.from_config(config)


def _store() -> CodeStore:
    tiers = [Tier("phones", [(0, 0.02, "sil"), (0.02, 0.06, "AA")]), Tier("words", [(0, 0.02, ""), (0.02, 0.06, "a")])]
    table = FeatureTable(("phone_frames", "centre_phone", "phone_span", "phrase_words"))
    return CodeStore.join([("a", encode(Alignment(tiers), "a", table, FrameClock(100)))])


def test_scaler_by_hand() -> None:
    store = _store()  # frames 2 2 4 4 4 4; spans 2 1 4 3 2 1
    scaler = NumericScaler.fit(store)
    np.testing.assert_allclose(scaler.mean, [20 / 6, 13 / 6, 4 / 6], rtol=1e-6)
    np.testing.assert_allclose(scaler.deviation, [np.std([2, 2, 4, 4, 4, 4]), np.std([2, 1, 4, 3, 2, 1]),
                                                  np.std([0, 0, 1, 1, 1, 1])], rtol=1e-6)
    scaled = scaler(store.numeric(np.arange(6)))
    np.testing.assert_allclose(scaled.mean(0), 0, atol=1e-6)
    np.testing.assert_allclose(scaled.std(0), 1, rtol=1e-6)
    again = NumericScaler.from_description(json.loads(json.dumps(scaler.describe())))
    np.testing.assert_array_equal(again(store.numeric(np.arange(6))), scaled)


def test_a_constant_column_becomes_zero() -> None:
    store = _store()
    scaler = NumericScaler.fit(store, np.arange(2, 6))
    assert scaler.deviation[0] == scaler.deviation[2] == 1
    assert (scaler(store.numeric(np.arange(2, 6)))[:, [0, 2]] == 0).all()
    with pytest.raises(DnnvssError, match="no training frame"):
        NumericScaler.fit(store, np.arange(0))
