"""Times of words and phones in NIST's CTM, as Kaldi, NeMo and the Montreal aligner write it."""

from pathlib import Path

import pytest

from data_prep.folder import written
from data_prep.long_told import long_script
from data_prep.shelf import Shelf
from dnnvss.errors import DnnvssError
from dnnvss.formats import read_alignment, read_timed_text

PHONES = (";; kaldi\nu1 1 0.00 0.10 SIL\nu1 1 0.10 0.07 HH_B\nu1 1 0.18 0.10 AY1_E\nu1 1 0.28 0.30 SIL\n")
WORDS = "u1 1 0.50 0.30 Hi NA lex\nu1 1 0.82 0.10 <eps>\nu1 1 0.80 0.04 I 0.9 lex\nu1 1 1.20 0.30 see 0.9 lex\n" \
        "u1 1 1.50 0.20 cough 0.9 non-lex\nu1 1 1.70 0.00 you\n"


def tiers(path: Path, utterance: str | None = None) -> dict[str, list[tuple[float, float, str]]]:
    return {tier.name: [(round(s.start, 3), round(s.end, 3), s.label) for s in tier]
            for tier in read_alignment(path, utterance).tiers}


def put(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_phones_of_kaldi_meet_where_a_rounding_parts_them(tmp_path: Path) -> None:
    assert tiers(put(tmp_path / "a.ctm", PHONES)) == {
        "phones": [(0, 0.1, "sil"), (0.1, 0.18, "HH"), (0.18, 0.28, "AY"), (0.28, 0.58, "sil")]}


def test_words_are_put_in_order_and_what_is_no_word_is_a_pause(tmp_path: Path) -> None:
    path = put(tmp_path / "a.ctm", WORDS)
    assert tiers(path, "another name") == {
        "words": [(0, 0.5, ""), (0.5, 0.8, "Hi"), (0.8, 0.84, "I"), (0.84, 1.2, ""), (1.2, 1.5, "see"), (1.5, 1.7, ""),
                  (1.7, 1.71, "you")]}
    assert [cue.text for cue in read_timed_text(path)] == ["Hi", "I", "see", "you"]


def test_letters_and_fillers_are_words(tmp_path: Path) -> None:
    """F and B are phones too, and a speech without a vowel is none."""
    path = put(tmp_path / "a.ctm", "".join(f"a 1 {k / 5} 0.2 {w}\n" for k, w in enumerate("FBSL")))
    assert list(tiers(path)) == ["words"]


def test_of_many_recordings_the_one_is_taken_that_is_named(tmp_path: Path) -> None:
    path = put(tmp_path / "all.ctm", PHONES + PHONES.replace("u1", "clips/u2.wav").replace("AY1", "OW1"))
    assert [label for *_, label in tiers(path, "u2")["phones"]] == ["sil", "HH", "OW", "sil"]
    with pytest.raises(DnnvssError, match="holds 2 utterances, not 'u3'"):
        tiers(path, "u3")


@pytest.mark.parametrize(("text", "said"), [
    ("", "holds no label"),
    ("u1 1 0.5 hello\n", "line 1: 'u1 1 0.5 hello' is not FILE CHANNEL START DURATION LABEL"),
    ("u1 1 0.5 -0.1 hello\n", "line 1: .* is not FILE CHANNEL"),
    ("u1 1 0.5 0.1 12\nu1 1 0.6 0.1 45\n", "its labels are numbers"),
    ("u1 A 0.5 0.1 hi\nu1 B 0.6 0.1 you\n", "utterance u1: holds the channels A and B of one recording"),
    ("u1 1 0.5 1.0 hi\nu1 1 0.7 0.1 you\n", "utterance u1: line 2: 'you' starts at 0.700 s, before 1.500 s"),
    (PHONES.replace("HH_B", "SPN_S"), "utterance u1: phone 'spn' marks a word that the aligner did not know"),
])
def test_what_cannot_be_meant_is_named(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(DnnvssError, match=f"a.ctm: {said}"):
        tiers(put(tmp_path / "a.ctm", text))


def test_beside_a_recording_phones_are_its_times_and_words_its_script(tmp_path: Path) -> None:
    for name, text in (("one", PHONES), ("two", WORDS)):
        put(tmp_path / f"{name}.mp4", "")
        put(tmp_path / f"{name}.ctm", text)
    put(tmp_path / "one.txt", "Hi")
    for name in ("three", "four"):
        put(tmp_path / f"{name}.mp4", "")
        put(tmp_path / f"{name}.txt", "Hi")
    put(tmp_path / "ali.ctm", PHONES.replace("u1", "three"))
    shelf = Shelf(tmp_path)
    assert written(shelf, "one") == (tmp_path / "one.txt", tmp_path / "one.ctm")
    assert long_script(shelf, "one", tmp_path / "one.mp4") is None
    assert long_script(shelf, "two", tmp_path / "two.mp4") == (tmp_path / "two.ctm", "beside it lies two.ctm")
    assert written(shelf, "three") == (tmp_path / "three.txt", tmp_path / "ali.ctm")
    assert written(shelf, "four") == (tmp_path / "four.txt", None)
    put(tmp_path / "aligned.mlf", '#!MLF!#\n"*/four.lab"\n0 1000000 sil\n1000000 2000000 AY\n.\n')
    times = written(Shelf(tmp_path), "four")[1]
    assert times == tmp_path / "aligned.mlf"
    assert tiers(times, "four")["phones"] == [(0, 0.1, "sil"), (0.1, 0.2, "AY")]
    put(tmp_path / "aligned.mlf", "nothing")
    with pytest.raises(DnnvssError, match=r"aligned\.mlf: line 1 is not #!MLF!#"):
        written(Shelf(tmp_path), "four")
