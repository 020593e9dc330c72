"""A user's own dictionary."""

import re
from itertools import dropwhile
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.text.lexicon import check_phones

_NUMBER = re.compile(r"\d+(\.\d+)?")


def read_overrides(path: str | Path) -> dict[str, str]:
    """Return the pronunciations in a dictionary file: word in lower case to phones.

    Each line holds a word and its phones, ``WORD PH PH ...``, with spaces or tabs between them; empty lines and lines
    that begin with ``#`` or ``;`` are passed over. Apostrophes become straight. Probabilities between word and phones,
    as the Montreal Forced Aligner writes them, are left out.

    Raises:
        DnnvssError: the file is missing, or a line has no phones or unknown ones; the message gives its number.
    """
    remedy = "Write a word and its ARPAbet phones on each line, e.g. GRID G R IH D"
    lines = files.read_text(path, remedy).splitlines()
    found = {}
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip()[0] in "#;":
            continue
        word, *phones = line.split()
        phones = list(dropwhile(_NUMBER.fullmatch, phones))
        if not phones:
            raise DnnvssError(f"line {number}: {line.strip()!r} has no phones", file=path, remedy=remedy)
        try:
            check_phones(" ".join(phones), word)
        except DnnvssError as error:
            raise DnnvssError(f"line {number}: {error.problem}", file=path, remedy=error.remedy) from error
        found[word.lower().replace("\u2019", "'").replace("\u02bc", "'")] = " ".join(phones)
    return found
