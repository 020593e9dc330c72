"""Scores a text front end on sentences with known pronunciations: ``python -m dnnvss.text.score FILE [--peer]``.

A file has a row a sentence and five columns: category, variant, text, spoken words (``a | b``; ``*b`` is a homograph)
and phones of each word (``AH | B IY / B EH``; a slash between admissible ones).
"""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.phones import strip_stress
from dnnvss.text.sentence import parse

Phones = tuple[str, ...]
Speaker = Callable[[str, str], list[Phones]]
"""Text and variant to the phones of each word, without stress."""


@dataclass(frozen=True)
class Case:
    """A sentence, its words as spoken, and the admissible phones of each word."""

    category: str
    variant: str
    text: str
    words: tuple[str, ...]
    admissible: tuple[frozenset[Phones], ...]

    @property
    def homographs(self) -> np.ndarray:
        """True for the words that are homographs, shape (words,)."""
        return np.array([word.startswith("*") for word in self.words], dtype=bool)


@dataclass(frozen=True)
class Score:
    """Words of the reference, and how many of them had an admissible pronunciation; extra words count as errors."""

    words: int
    right: int
    extra: int

    @property
    def accuracy(self) -> float:
        """Right words less extra ones, as a share of the reference."""
        return (self.right - self.extra) / max(self.words, 1)


def read_cases(path: str | Path) -> list[Case]:
    """Return the sentences of a file.

    Raises:
        DnnvssError: the file is missing, or a row does not have its five columns or as many phones as words.
    """
    remedy = "Write five columns: category, variant, text, words between |, phones between |"
    lines = files.read(path, lambda p: p.read_text(encoding="utf-8").splitlines(), remedy)
    cases = []
    for number, line in enumerate(lines, 1):
        if not line or line.startswith("# "):
            continue
        columns = line.split("\t")
        words = tuple(w.strip() for w in columns[3].split("|")) if len(columns) == 5 else ()
        phones = columns[4].split("|") if len(columns) == 5 else [""]
        if len(words) != len(phones):
            raise DnnvssError(f"line {number} has {len(columns)} columns, {len(words)} words and {len(phones)} "
                              "pronunciations", file=path, remedy=remedy)
        admissible = tuple(frozenset(tuple(p.split()) for p in entry.split("/")) for entry in phones)
        category, variant, text = columns[:3]
        cases.append(Case(category, variant, text, words, admissible))
    return cases


def ours(text: str, variant: str) -> list[Phones]:
    """Return what :func:`~dnnvss.text.sentence.parse` makes of a text."""
    return [tuple(map(strip_stress, word.phones)) for word in parse(text, variant).words]


def g2p_en() -> Speaker:
    """Return g2p-en as it is shipped.

    Raises:
        DnnvssError: its taggers and dictionary, which it would download, are not there.
    """
    try:
        import nltk

        nltk.data.find("corpora/cmudict.zip")
        nltk.data.find("taggers/averaged_perceptron_tagger.zip")
        from g2p_en import G2p

        speaker = G2p()
    except (ImportError, LookupError, OSError) as error:
        raise DnnvssError("g2p-en cannot run here: its NLTK data is not installed",
                          remedy="Where the network allows, run nltk.download for cmudict and the tagger") from error

    def speak(text: str, variant: str) -> list[Phones]:
        words: list[Phones] = [()]
        for phone in speaker(text):
            if phone == " ":
                words.append(())
            elif phone[0].isalpha():
                words[-1] = (*words[-1], strip_stress(phone))
        return [w for w in words if w]

    return speak


def right_words(case: Case, said: Sequence[Phones]) -> tuple[np.ndarray, int]:
    """Return which words of the reference were said rightly (words,), and how many words were said beside them.

    Words are matched in order so that as many as possible are right.
    """
    n, m = len(case.words), len(said)
    fits = np.array([[phones in wanted for phones in said] for wanted in case.admissible]).reshape(n, m)
    best = np.zeros((n + 1, m + 1), int)
    for i in range(n):
        for j in range(m):
            best[i + 1, j + 1] = max(best[i, j] + fits[i, j], best[i, j + 1], best[i + 1, j])
    right, i, j = np.zeros(n, dtype=bool), n, m
    while i and j:
        if fits[i - 1, j - 1] and best[i, j] == best[i - 1, j - 1] + 1:
            i, j = i - 1, j - 1
            right[i] = True
        elif best[i, j] == best[i - 1, j]:
            i -= 1
        else:
            j -= 1
    return right, max(m - n, 0)


def score(cases: Sequence[Case], speaker: Speaker = ours) -> tuple[dict[str, Score], list[str]]:
    """Return scores by category, for ``homographs only`` and ``all``, and a line for each word that was wrong."""
    totals: dict[str, list[int]] = {}
    wrong: list[str] = []
    for case in cases:
        said = speaker(case.text, case.variant)
        right, extra = right_words(case, said)
        every = np.ones(len(right), dtype=bool)
        rows = ((case.category, every, extra), ("all", every, extra), ("homographs only", case.homographs, 0))
        for name, mask, surplus in rows:
            total = totals.setdefault(name, [0, 0, 0])
            for k, value in enumerate((int(mask.sum()), int((right & mask).sum()), surplus)):
                total[k] += value
        missed = [w for w, ok in zip(case.words, right, strict=True) if not ok]
        if missed or extra:
            wrong.append(f"{case.text}: {', '.join(missed)} in {' | '.join(map(' '.join, said))}")
    return {name: Score(*total) for name, total in totals.items()}, wrong


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table of scores, and with ``-v`` every sentence with a wrong word."""
    parser = argparse.ArgumentParser(prog="python -m dnnvss.text.score", description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--peer", action="store_true", help="score g2p-en as shipped as well (needs its NLTK data)")
    parser.add_argument("-v", "--verbose", action="store_true", help="name every wrong word")
    chosen = parser.parse_args(arguments)
    try:
        cases = read_cases(chosen.file)
        systems: dict[str, Speaker] = {"dnnvss": ours, **({"g2p-en": g2p_en()} if chosen.peer else {})}
    except DnnvssError as error:
        parser.exit(1, f"{error}\n")
    for system, speaker in systems.items():
        scores, wrong = score(cases, speaker)
        print(f"{system}: {len(cases)} sentences")
        for name, s in scores.items():
            counts = f"({s.words - s.right} wrong, {s.extra} extra)"
            print(f"  {name:16} {s.words:5} words  {100 * s.accuracy:6.2f} %  {counts}")
        for line in wrong if chosen.verbose else ():
            print(f"  {line}")


if __name__ == "__main__":
    main()
