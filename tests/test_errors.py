"""Messages are sentences."""

import pytest

from dnnvss.errors import DnnvssError


@pytest.mark.parametrize("problem, remedy, message", [
    ("is no rate", "Give 25", "a.csv: is no rate. Give 25."),
    ("is no rate.", "Give 25.", "a.csv: is no rate. Give 25."),
    ("is no rate", "Meant rate=25?", "a.csv: is no rate. Meant rate=25?"),
    ("begins with 0a1b...", "Name some of jawOpen, mouthClose, ...",
     "a.csv: begins with 0a1b... Name some of jawOpen, mouthClose, ..."),
])
def test_sentences_end_as_they_were_written_or_with_a_full_stop(problem: str, remedy: str, message: str) -> None:
    assert str(DnnvssError(problem, file="a.csv", remedy=remedy)) == message
