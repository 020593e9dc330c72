"""The 57 questions and the neighbours of phones."""

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.phones import ANSWERS, ARTICULATION, BILABIALS, LABIODENTALS, PHONES, QUESTIONS, SPOKEN, nearest

NAMES = [q.name for q in QUESTIONS]


def yes(name: str) -> set[str]:
    return {PHONES[i] for i in np.flatnonzero(ANSWERS[:, NAMES.index(name)])}


def test_shape_and_names() -> None:
    assert ANSWERS.shape == (41, 57)
    assert ANSWERS.dtype == np.uint8
    assert set(np.unique(ANSWERS)) == {0, 1}
    assert len(set(NAMES)) == 57
    assert set(ARTICULATION) == set(PHONES)


def test_no_question_is_constant_or_asked_twice() -> None:
    assert ((ANSWERS.sum(0) > 0) & (ANSWERS.sum(0) < 41)).all()
    assert len(np.unique(ANSWERS, axis=1).T) == 57


def test_every_phone_is_told_from_every_other() -> None:
    assert len(np.unique(ANSWERS, axis=0)) == 41


@pytest.mark.parametrize(("question", "phones"), [
    ("lip_closing", "B M P"),
    ("labiodental", "F V"),
    ("bilabial", "B M P W"),
    ("stop", "B D G K P T"),
    ("nasal", "M N NG"),
    ("fricative", "DH F HH S SH TH V Z ZH"),
    ("affricate", "CH JH"),
    ("approximant", "L R W Y"),
    ("lateral", "L"),
    ("rhotic", "ER R"),
    ("glide", "W Y"),
    ("sibilant", "CH JH S SH Z ZH"),
    ("unvoiced", "CH F HH K P S SH T TH"),
    ("velar", "G K NG W"),
    ("dental", "DH TH"),
    ("alveolar", "D L N S T Z"),
    ("front_vowel", "AE EH EY IH IY"),
    ("central_vowel", "AH AW AY ER"),
    ("back_vowel", "AA AO OW OY UH UW"),
    ("high_vowel", "IH IY UH UW"),
    ("low_vowel", "AA AE AW AY"),
    ("diphthong", "AW AY EY OW OY"),
    ("fronting_diphthong", "AY EY OY"),
    ("rounding_diphthong", "AW OW"),
    ("lip_rounding", "AO CH ER JH OW OY R SH UH UW W ZH"),
    ("silence", "sil sp"),
    ("short_pause", "sp"),
])
def test_answers_by_hand(question: str, phones: str) -> None:
    assert yes(question) == set(phones.split())


def test_classes_partition_the_phones() -> None:
    assert yes("vowel") | yes("consonant") | yes("silence") == set(PHONES)
    assert yes("voiced") | yes("unvoiced") | yes("silence") == set(PHONES)
    assert yes("sonorant") | yes("obstruent") | yes("silence") == set(PHONES)
    assert yes("front_vowel") | yes("central_vowel") | yes("back_vowel") == yes("vowel")
    assert yes("high_vowel") | yes("mid_vowel") | yes("low_vowel") == yes("vowel")
    assert yes("tense_vowel") ^ yes("lax_vowel") == yes("rounded_vowel") ^ yes("unrounded_vowel") == yes("vowel")


@pytest.mark.parametrize(("phone", "known", "expected"), [
    ("ZH", "JH Z S T AH", "JH"),
    ("ZH", "SH JH", "SH"),
    ("OY", "AH AY AO OW", "AO"),
    ("P", "T K F M", "M"),
    ("V", "DH Z F B", "F"),
    ("UH", "IH AH UW OW", "UW"),
    ("W", "L V UW Y", "UW"),
    ("Y", "W G IY L", "IY"),
    ("TH", "S F T DH", "DH"),
    ("NG", "N M G IY", "G"),
    ("AW", "OW AH AY", "AY"),
    ("sp", "AH sil M", "sil"),
])
def test_nearest_by_hand(phone: str, known: str, expected: str) -> None:
    assert nearest(phone, known.split())[0][0] == expected


def test_neutral_phones_stand_in_for_h() -> None:
    lips = yes("lip_closing") | yes("labiodental") | yes("lip_rounding") | yes("lip_spreading") | yes("jaw_open")
    assert not lips & {p for p, _ in nearest("HH", set(SPOKEN) - {"HH"})[:8]}


def test_nearest_is_a_distance_in_order() -> None:
    for phone in PHONES:
        neighbours = nearest(phone, PHONES)
        assert neighbours[0] == (phone, 0.0)
        assert [d for _, d in neighbours] == sorted(d for _, d in neighbours)
        assert neighbours[1][1] > 0
        assert all(dict(nearest(p, PHONES))[phone] == d for p, d in neighbours)


def test_silence_is_the_last_choice_for_a_spoken_phone() -> None:
    for phone in SPOKEN:
        assert {p for p, _ in nearest(phone, PHONES)[-2:]} == {"sil", "sp"}


def test_nearest_refuses() -> None:
    with pytest.raises(DnnvssError, match="no phone is known"):
        nearest("AA", [])
    with pytest.raises(DnnvssError, match="unknown phone 'QQ'"):
        nearest("AA", ["QQ"])


def test_lips_close_on_three_phones_and_meet_the_teeth_on_two() -> None:
    assert BILABIALS == ("P", "B", "M")
    assert LABIODENTALS == ("F", "V")
