"""The score of the front end on sentences with hand-checked pronunciations."""

from pathlib import Path

import pytest

from dnnvss.errors import DnnvssError
from dnnvss.text.score import Case, main, read_cases, right_words, score

DATA = Path(__file__).parent / "data"


@pytest.mark.parametrize(("name", "sentences"), [("sentences", 301), ("heldout", 100)])
def test_words_and_homographs_are_right(name: str, sentences: int) -> None:
    cases = read_cases(DATA / f"{name}.tsv")
    assert len(cases) == sentences
    scores, wrong = score(cases)
    assert scores["all"].accuracy >= 0.98, wrong
    assert scores["homographs only"].accuracy >= 0.95, wrong
    assert scores["homographs only"].words >= 70


def case(words: str, phones: str) -> Case:
    admissible = tuple(frozenset(tuple(p.split()) for p in w.split("/")) for w in phones.split("|"))
    return Case("x", "en_us", "", tuple(words.split()), admissible)


def test_right_words_are_matched_in_order() -> None:
    reference = case("the *read book", "DH AH / DH IY | R EH D | B UH K")
    right, extra = right_words(reference, [("DH", "IY"), ("R", "IY", "D"), ("B", "UH", "K")])
    assert right.tolist() == [True, False, True] and extra == 0
    right, extra = right_words(reference, [("B", "UH", "K"), ("DH", "AH"), ("R", "EH", "D"), ("UH",)])
    assert right.tolist() == [True, True, False] and extra == 1
    assert right_words(reference, [])[0].tolist() == [False] * 3
    assert reference.homographs.tolist() == [False, True, False]


def test_extra_words_cost() -> None:
    scores, wrong = score([case("a b", "AH | B IY")], lambda text, variant: [("AH",), ("B", "IY"), ("S",)])
    assert (scores["all"].words, scores["all"].right, scores["all"].extra) == (2, 2, 1)
    assert scores["all"].accuracy == 0.5 and len(wrong) == 1


def test_program_prints_the_table_and_names_bad_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good, bad = tmp_path / "good.tsv", tmp_path / "bad.tsv"
    good.write_text("x\ten_us\tHello now.\thello | now\tHH AH L OW | N OW\n", encoding="utf-8")
    main([str(good), "-v"])
    printed = capsys.readouterr().out
    assert "50.00 %" in printed and "Hello now.: now in HH AH L OW | N AW" in printed
    bad.write_text("x\ten_us\tHello.\thello\tHH | AH\n", encoding="utf-8")
    with pytest.raises(DnnvssError, match=r"bad\.tsv: line 1 has 5 columns, 1 words and 2 pronunciations"):
        read_cases(bad)
    with pytest.raises(SystemExit):
        main([str(bad)])
    assert "line 1" in capsys.readouterr().err
