"""Dictionaries of a user's own."""

from pathlib import Path

import pytest

from dnnvss.errors import DnnvssError
from dnnvss.text.overrides import read_overrides
from dnnvss.text.sentence import parse


def test_tabs_probabilities_and_curly_apostrophes_are_understood(tmp_path: Path) -> None:
    path = tmp_path / "own.dict"
    path.write_text("\ufeffGRID G R IH D\n# no word\nnow\tN UW1\nO\u2019Neil\t0.99\t0.1\t1.0\tOW N IY L\n", "utf-8")
    own = read_overrides(path)
    assert own == {"grid": "G R IH D", "now": "N UW1", "o'neil": "OW N IY L"}
    assert [w.source for w in parse("Now, O\u2019Neil grid O'Neil", overrides=own).words] == ["override"] * 4


@pytest.mark.parametrize(("line", "said"), [
    ("now\tN UU", "line 2: the pronunciation of 'now' has unknown phones UU"), ("now", "line 2: 'now' has no phones"),
    ("now\t0.5", "line 2: .* has no phones")])
def test_a_bad_line_is_named(tmp_path: Path, line: str, said: str) -> None:
    path = tmp_path / "own.dict"
    path.write_text(f"GRID G R IH D\n{line}\n")
    with pytest.raises(DnnvssError, match=said) as caught:
        read_overrides(path)
    assert str(path) in str(caught.value)
