"""What is said in a test: sentences of the test split, or words cut out of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.corpus import Utterance
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.viewing.design import Design
from dnnvss.phones import ARTICULATION
from dnnvss.timing import Alignment

ROOM = 0.12
"""Seconds before and after a word that are shown with it."""
SHORTEST = 0.1
"""Seconds of the shortest word that is taken."""


@dataclass(frozen=True)
class Item:
    """A sentence, or a word in it.

    Args:
        utterance: of the corpus.
        word: its place among the words of the utterance, counted from 0; None for the whole.
        text: what is said.
    """

    utterance: Utterance
    word: int | None
    text: str

    @property
    def id(self) -> str:
        """In tables."""
        return self.utterance.id if self.word is None else f"{self.utterance.id}:{self.word}"

    def span(self, alignment: Alignment) -> tuple[float, float]:
        """Seconds from which to which it is shown, of an alignment of the utterance."""
        tier = alignment["words"] if self.word is not None else alignment["phones"]
        if self.word is None:
            return 0.0, float(tier.end)
        word = [segment for segment in tier if segment.label][self.word]
        return max(word.start - ROOM, 0.0), min(word.end + ROOM, float(tier.end))


def choose_items(utterances: Mapping[str, Utterance], design: Design) -> tuple[list[Item], list[Item]]:
    """The items of a test, drawn at random, and others for the trial run.

    Args:
        utterances: that no run has learnt from.
        design: how many, and of what kind.

    Returns:
        Items, and as many for the trial run as are left of those that are wanted; of sentences, the first again where
        none are left.

    Raises:
        DnnvssError: there are too few.
    """
    rng = np.random.default_rng([design.seed, 2])
    found = _sentences(utterances) if design.material == "sentences" else _words(utterances, design.monosyllables, rng)
    order = [found[int(i)] for i in rng.permutation(len(found))]
    if len(order) < design.sentences:
        raise DnnvssError(f"sentences={design.sentences} were asked for, and there are {len(order)} {design.material} "
                          "of the test that no run has learnt from",
                          remedy=f"Set sentences: {len(order)} at most, or test runs that keep a test split: folds=0")
    chosen, left = order[:design.sentences], order[design.sentences:]
    return chosen, (left or chosen)[:design.practice]


def _sentences(utterances: Mapping[str, Utterance]) -> list[Item]:
    return [Item(u, None, u.text) for _, u in sorted(utterances.items())]


def _words(utterances: Mapping[str, Utterance], monosyllables: bool, rng: np.random.Generator) -> list[Item]:
    """One item of each word that is said, from an utterance drawn at random."""
    said: dict[str, list[Item]] = {}
    for _, u in sorted(utterances.items()):
        if "words" not in u.alignment:
            continue
        words = [segment for segment in u.alignment["words"] if segment.label]
        for place, word in enumerate(words):
            long = word.end - word.start >= SHORTEST
            if long and (not monosyllables or _vowels(u.alignment, word.start, word.end) == 1):
                said.setdefault(word.label.lower(), []).append(Item(u, place, word.label.lower()))
    return [items[int(rng.integers(len(items)))] for _, items in sorted(said.items())]


def _vowels(alignment: Alignment, start: float, end: float) -> int:
    """How many vowels lie between two times."""
    inside = [s.label for s in alignment["phones"] if start <= (s.start + s.end) / 2 < end]
    return sum(ARTICULATION[phone].manner == "vowel" for phone in inside)


def alternatives(words: Sequence[str], index: int, count: int, seed: int) -> tuple[str, ...]:
    """A word with others of the test to choose from, in a random order."""
    rng = np.random.default_rng([seed, index, 3])
    others = sorted(set(words) - {words[index]})
    drawn = [others[int(i)] for i in rng.permutation(len(others))[:count - 1]]
    row = [*drawn, words[index]]
    return tuple(row[int(i)] for i in rng.permutation(len(row)))
