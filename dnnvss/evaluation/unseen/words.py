"""Which words a split holds back: those of one phone, so that nobody heard it, and others drawn by chance."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.phones import SILENCES
from dnnvss.systems import Example
from dnnvss.timing import Alignment

SHARE = 0.15
"""Share of the sentences that a split may hold back at most."""


@dataclass(frozen=True)
class HeldOut:
    """What a split holds back.

    Args:
        words: that no sentence of training says.
        phones: that occur in none but these words; empty where every phone of the corpus is too frequent to be spared.
    """

    words: tuple[str, ...]
    phones: tuple[str, ...]


def pronounced(alignment: Alignment) -> set[tuple[str, str]]:
    """Word and phone of all phones of an utterance, each in the word that its middle lies in."""
    phones, words = alignment["phones"], alignment["words"]
    owners = words.indices_at(phones.middles)
    return {(words[int(i)].label, p) for i, p in zip(owners, phones.labels, strict=True)
            if p not in SILENCES and words[int(i)].label}


def held_out(alignments: Sequence[Alignment], splits: int = 4, seed: int = 0, share: float = SHARE) -> list[HeldOut]:
    """What each of some random splits holds back; a phone is held back by one split as long as there are others.

    A split takes a phone whose words are said in few sentences, and further words in random order, as long as no more
    than a share of the sentences is lost.

    Args:
        alignments: of the sentences that are split.
        splits: how many.
        seed: of chance.
        share: of the sentences.

    Raises:
        DnnvssError: every word is said too often to be held back.
    """
    said = [pronounced(each) for each in alignments]
    within = [{word for word, _ in each} for each in said]
    by_phone: dict[str, set[str]] = defaultdict(set)
    for word, phone in set().union(*said):
        by_phone[phone].add(word)
    most, words = share * len(said), sorted(set().union(*within))

    def lost(chosen: Iterable[str]) -> int:
        return sum(not each.isdisjoint(chosen) for each in within)

    rare = [phone for phone in sorted(by_phone) if lost(by_phone[phone]) <= most]
    random = np.random.default_rng([seed, 7])
    order = [rare[i] for i in random.permutation(len(rare))]
    found = []
    for k in range(splits):
        chosen = set(by_phone[order[k % len(order)]]) if order else set[str]()
        for word in (words[i] for i in random.permutation(len(words))):
            if lost(chosen | {word}) <= most:
                chosen.add(word)
        if not chosen:
            raise DnnvssError(f"every word is said in more than {share:.0%} of the sentences",
                              remedy="Record more sentences of different words")
        found.append(HeldOut(tuple(sorted(chosen)), tuple(p for p in sorted(by_phone) if by_phone[p] <= chosen)))
    return found


def without(examples: Sequence[Example], held: HeldOut) -> tuple[list[Example], list[Example]]:
    """The examples that say none of the words held back, and those that say some."""
    says = [not set(e.alignment["words"].labels).isdisjoint(held.words) for e in examples]
    return ([e for e, own in zip(examples, says, strict=True) if not own],
            [e for e, own in zip(examples, says, strict=True) if own])
