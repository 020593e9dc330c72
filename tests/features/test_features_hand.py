"""An utterance of three phones, every column written out by hand."""

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable, encode, expand
from dnnvss.features.block import Settings
from dnnvss.phones import PHONES
from dnnvss.timing import Alignment, FrameClock, Tier

# frame      0    1    2    3    4    5    6    7
# phone     sil  sil   M    M    M   IY   IY   IY      "me", one syllable, one word, one phrase
# viseme     4    4    4    7    7    7    7    0
UTTERANCE = Alignment([
    Tier("phones", [(0, 0.02, "sil"), (0.02, 0.05, "M"), (0.05, 0.08, "IY")]),
    Tier("words", [(0, 0.02, ""), (0.02, 0.08, "me")]),
    Tier("visemes", [(0, 0.03, "4"), (0.03, 0.07, "7"), (0.07, 0.08, "0")]),
])
ORDER = ["sil", "sil", "M", "M", "M", "IY", "IY", "IY"]


def columns(names: list[str], **settings: int) -> dict[str, list[float]]:
    """Return the columns that are not all zero, by name."""
    table = FeatureTable(tuple(names), Settings(**settings))
    dense = expand(encode(UTTERANCE, "me", table, FrameClock(100)))
    assert dense.shape == (8, table.width)
    assert dense.dtype == np.float32
    return {name: column.tolist() for name, column in zip(table.columns, dense.T, strict=True) if column.any()}


def test_frame_blocks_of_phones() -> None:
    assert columns(["centre_phone", "phone_position", "phone_frames", "phone_span"]) == {
        "centre_phone/IY": [0, 0, 0, 0, 0, 1, 1, 1],
        "centre_phone/M": [0, 0, 1, 1, 1, 0, 0, 0],
        "centre_phone/sil": [1, 1, 0, 0, 0, 0, 0, 0],
        "phone_position/start": [1, 0, 1, 0, 0, 1, 0, 0],
        "phone_position/middle": [0, 0, 0, 1, 0, 0, 1, 0],
        "phone_position/end": [0, 1, 0, 0, 1, 0, 0, 1],
        "phone_frames/frames": [2, 2, 3, 3, 3, 3, 3, 3],
        "phone_span/frames": [2, 1, 3, 2, 1, 3, 2, 1],
    }


def test_window_of_phones_sees_silence_outside() -> None:
    assert columns(["phone_window"], window_before=2, window_after=1) == {
        "phone_window/-2:sil": [1, 1, 1, 1, 0, 0, 0, 0],
        "phone_window/-2:M": [0, 0, 0, 0, 1, 1, 1, 0],
        "phone_window/-2:IY": [0, 0, 0, 0, 0, 0, 0, 1],
        "phone_window/-1:sil": [1, 1, 1, 0, 0, 0, 0, 0],
        "phone_window/-1:M": [0, 0, 0, 1, 1, 1, 0, 0],
        "phone_window/-1:IY": [0, 0, 0, 0, 0, 0, 1, 1],
        "phone_window/+1:sil": [1, 0, 0, 0, 0, 0, 0, 1],
        "phone_window/+1:M": [0, 1, 1, 1, 0, 0, 0, 0],
        "phone_window/+1:IY": [0, 0, 0, 0, 1, 1, 1, 0],
    }


def test_full_window_is_the_sequence_moved() -> None:
    dense = columns(["phone_window"])
    for offset in (*range(-16, 0), *range(1, 17)):
        for phone in PHONES:
            expected = [float((ORDER[t + offset] if 0 <= t + offset < 8 else "sil") == phone) for t in range(8)]
            assert dense.get(f"phone_window/{offset:+d}:{phone}", [0.0] * 8) == expected


def test_acoustic_class() -> None:
    dense = columns(["acoustic_class"])
    closed, spoken, vowel = [0, 0, 1, 1, 1, 0, 0, 0], [0, 0, 1, 1, 1, 1, 1, 1], [0, 0, 0, 0, 0, 1, 1, 1]
    consonant = ["lip_closing", "consonant", "nasal", "voiced_consonant", "bilabial", "labial", "anterior"]
    of_vowel = ["lip_spreading", "vowel", "continuant", "front_vowel", "high_vowel", "unrounded_vowel", "tense_vowel",
                "high_front_vowel"]
    assert dense == {
        "acoustic_class/silence": [1, 1, 0, 0, 0, 0, 0, 0],
        "acoustic_class/voiced": spoken, "acoustic_class/sonorant": spoken,
        **{f"acoustic_class/{name}": closed for name in consonant},
        **{f"acoustic_class/{name}": vowel for name in of_vowel},
    }  # fmt: skip


def test_context_of_phones() -> None:
    assert columns(["phone_context"]) == {
        "phone_context/-2:sil": [1, 1, 1, 1, 1, 1, 1, 1],
        "phone_context/-1:sil": [1, 1, 1, 1, 1, 0, 0, 0],
        "phone_context/-1:M": [0, 0, 0, 0, 0, 1, 1, 1],
        "phone_context/+0:sil": [1, 1, 0, 0, 0, 0, 0, 0],
        "phone_context/+0:M": [0, 0, 1, 1, 1, 0, 0, 0],
        "phone_context/+0:IY": [0, 0, 0, 0, 0, 1, 1, 1],
        "phone_context/+1:M": [1, 1, 0, 0, 0, 0, 0, 0],
        "phone_context/+1:IY": [0, 0, 1, 1, 1, 0, 0, 0],
        "phone_context/+1:sil": [0, 0, 0, 0, 0, 1, 1, 1],
        "phone_context/+2:IY": [1, 1, 0, 0, 0, 0, 0, 0],
        "phone_context/+2:sil": [0, 0, 1, 1, 1, 1, 1, 1],
    }


@pytest.mark.parametrize("segment", [1, 3, 7])
def test_segments_of_other_lengths(segment: int) -> None:
    reach = segment // 2
    phones = ["sil"] * 3 + ["sil", "M", "IY"] + ["sil"] * 3
    at = [0, 0, 1, 1, 1, 2, 2, 2]
    dense = columns(["phone_context"], segment=segment)
    for k in range(-reach, reach + 1):
        for phone in PHONES:
            expected = [float(phones[3 + s + k] == phone) for s in at]
            assert dense.get(f"phone_context/{k:+d}:{phone}", [0.0] * 8) == expected
    assert len({name.split(":")[0] for name in dense}) == segment


def test_a_segment_has_a_middle_one() -> None:
    with pytest.raises(DnnvssError, match=r"labels\.segment=4 has no middle one.*labels\.segment=3 or 5"):
        Settings(segment=4)


def test_higher_levels_are_zero_in_silence() -> None:
    spoken = [0, 0, 1, 1, 1, 1, 1, 1]
    assert columns(["syllable_phone_position", "syllable_phones", "word_syllable_position", "word_syllables",
                    "phrase_syllable_position", "phrase_syllables", "phrase_word_position", "phrase_words",
                    "utterance_syllable_position", "utterance_word_position", "utterance_phrase_position"]) == {
        "syllable_phone_position/start": [0, 0, 1, 1, 1, 0, 0, 0],
        "syllable_phone_position/end": [0, 0, 0, 0, 0, 1, 1, 1],
        "syllable_phones/phones": [0, 0, 2, 2, 2, 2, 2, 2],
        "word_syllable_position/middle": spoken, "word_syllables/syllables": spoken,
        "phrase_syllable_position/middle": spoken, "phrase_syllables/syllables": spoken,
        "phrase_word_position/middle": spoken, "phrase_words/words": spoken,
        "utterance_syllable_position/middle": spoken, "utterance_word_position/middle": spoken,
        "utterance_phrase_position/middle": spoken,
    }  # fmt: skip


def test_visemes() -> None:
    assert columns(["centre_viseme", "viseme_window", "viseme_position", "viseme_frames", "viseme_span",
                    "viseme_phones", "syllable_viseme_position", "syllable_visemes"], units=8,
                   window_before=1, window_after=0) == {
        "centre_viseme/0": [0, 0, 0, 0, 0, 0, 0, 1],
        "centre_viseme/4": [1, 1, 1, 0, 0, 0, 0, 0],
        "centre_viseme/7": [0, 0, 0, 1, 1, 1, 1, 0],
        "viseme_window/-1:4": [0, 1, 1, 1, 0, 0, 0, 0],
        "viseme_window/-1:7": [0, 0, 0, 0, 1, 1, 1, 1],
        "viseme_position/start": [1, 0, 0, 1, 0, 0, 0, 0],
        "viseme_position/middle": [0, 1, 0, 0, 1, 1, 0, 1],
        "viseme_position/end": [0, 0, 1, 0, 0, 0, 1, 0],
        "viseme_frames/frames": [3, 3, 3, 4, 4, 4, 4, 1],
        "viseme_span/frames": [3, 2, 1, 4, 3, 2, 1, 1],
        "viseme_phones/phones": [1, 1, 1, 2, 2, 2, 2, 1],
        "syllable_viseme_position/start": [0, 0, 1, 0, 0, 0, 0, 0],
        "syllable_viseme_position/middle": [0, 0, 0, 1, 1, 1, 1, 0],
        "syllable_viseme_position/end": [0, 0, 0, 0, 0, 0, 0, 1],
        "syllable_visemes/visemes": [0, 0, 3, 3, 3, 3, 3, 3],
    }


def test_context_of_visemes_has_no_bit_outside() -> None:
    assert columns(["viseme_context"], units=8) == {
        "viseme_context/-2:4": [0, 0, 0, 0, 0, 0, 0, 1],
        "viseme_context/-1:4": [0, 0, 0, 1, 1, 1, 1, 0],
        "viseme_context/-1:7": [0, 0, 0, 0, 0, 0, 0, 1],
        "viseme_context/+0:4": [1, 1, 1, 0, 0, 0, 0, 0],
        "viseme_context/+0:7": [0, 0, 0, 1, 1, 1, 1, 0],
        "viseme_context/+0:0": [0, 0, 0, 0, 0, 0, 0, 1],
        "viseme_context/+1:7": [1, 1, 1, 0, 0, 0, 0, 0],
        "viseme_context/+1:0": [0, 0, 0, 1, 1, 1, 1, 0],
        "viseme_context/+2:0": [1, 1, 1, 0, 0, 0, 0, 0],
    }


def test_own_blocks() -> None:
    dense = columns(["phone_fraction", "neighbour_frames", "class_context"])
    np.testing.assert_allclose(dense["phone_fraction/fraction"], [1 / 4, 3 / 4, *[1 / 6, 1 / 2, 5 / 6] * 2], rtol=1e-6)
    assert dense["neighbour_frames/-2:frames"] == [0, 0, 0, 0, 0, 2, 2, 2]
    assert dense["neighbour_frames/-1:frames"] == [0, 0, 2, 2, 2, 3, 3, 3]
    assert dense["neighbour_frames/+1:frames"] == [3, 3, 3, 3, 3, 0, 0, 0]
    assert dense["neighbour_frames/+2:frames"] == [3, 3, 0, 0, 0, 0, 0, 0]
    assert dense["class_context/-1:nasal"] == [0, 0, 0, 0, 0, 1, 1, 1]
    assert dense["class_context/+1:silence"] == [0, 0, 0, 0, 0, 1, 1, 1]
