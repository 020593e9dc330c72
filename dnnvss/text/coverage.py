"""What a talker has said of what speech is made of, and which sentences would add most to it."""

from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from itertools import pairwise

from dnnvss.phones import SILENCE, SPOKEN
from dnnvss.text.sentence import parse

Pairs = Counter[tuple[str, str]]

NEW_PHONE = 10
"""How many new pairs of sounds a sound is worth that was never heard at all."""
EXAMPLES = {
    "AA": "father", "AE": "cat", "AH": "cup", "AO": "law", "AW": "cow", "AY": "my", "B": "be", "CH": "church",
    "D": "do", "DH": "this", "EH": "bed", "ER": "bird", "EY": "day", "F": "for", "G": "go", "HH": "he", "IH": "sit",
    "IY": "see", "JH": "judge", "K": "cat", "L": "lay", "M": "me", "N": "no", "NG": "sing", "OW": "go", "OY": "boy",
    "P": "pea", "R": "ray", "S": "so", "SH": "she", "T": "tea", "TH": "thin", "UH": "book", "UW": "you", "V": "vase",
    "W": "we", "Y": "yes", "Z": "zoo", "ZH": "measure",
}
"""A word with each phone."""


@dataclass(frozen=True)
class Coverage:
    """What was heard of a talker.

    Args:
        phones: how often each was heard.
        pairs: neighbouring sounds, silence at the ends and pauses, that were heard.
        heard: the triphones, written ``left-phone+right``.
    """

    phones: Counter[str]
    pairs: frozenset[tuple[str, str]]
    heard: frozenset[str]

    @classmethod
    def of(cls, phones: Counter[str], triphones: Collection[str]) -> "Coverage":
        """The coverage of counted phones and of triphones, written ``left-phone+right``."""
        parts = [name.replace("+", "-").split("-") for name in triphones]
        return cls(phones, frozenset(pair for a, b, c in parts for pair in ((a, b), (b, c))),
                   frozenset(triphones))

    @property
    def triphones(self) -> int:
        """How many different triphones were heard."""
        return len(self.heard)

    @property
    def untold(self) -> bool:
        """Whether one phone stands for all that was said, as where nobody wrote down the words."""
        return len(self.phones) <= 1

    @property
    def missing(self) -> tuple[str, ...]:
        """The phones that were never heard."""
        return tuple(p for p in SPOKEN if not self.phones[p])

    def share(self, variant: str) -> float:
        """The share of the neighbouring sounds of ordinary sentences, as often as they come, that were heard."""
        wanted: Pairs = Counter()
        for pairs in prompt_pairs(variant).values():
            wanted.update(pairs)
        return sum(n for pair, n in wanted.items() if pair in self.pairs) / max(wanted.total(), 1)


def next_prompts(coverage: Coverage, variant: str, count: int = 10) -> list[str]:
    """The sentences that add most to what was heard, the first one first.

    Each is the one that adds most behind those before it: a pair of neighbouring sounds counts once, a sound that was
    never heard as ten of them.

    Args:
        coverage: what was heard so far.
        variant: of English, ``en_us`` or ``en_gb``.
        count: how many sentences at most.
    """
    pairs, phones = set(coverage.pairs), {p for p, n in coverage.phones.items() if n}
    left, chosen = dict(prompt_pairs(variant)), list[str]()
    while left and len(chosen) < count:
        worth = {text: _worth(own, pairs, phones) for text, own in left.items()}
        best = max(worth, key=lambda text: worth[text])
        if not worth[best]:
            break
        chosen.append(best)
        own = left.pop(best)
        pairs |= own.keys()
        phones |= {p for pair in own for p in pair}
    return chosen


def unsaid(coverage: Coverage, variant: str) -> tuple[list[str], int]:
    """The triphones of ordinary sentences that were not heard, the most frequent first, and how many there are in all.

    Args:
        coverage: what was heard.
        variant: of English.
    """
    wanted = Counter(triphone for own in prompt_triphones(variant).values() for triphone in own)
    return [t for t, _ in wanted.most_common() if t not in coverage.heard], len(wanted)


def _worth(own: Pairs, pairs: Collection[tuple[str, str]], phones: Collection[str]) -> int:
    new = {p for pair in own for p in pair} - {SILENCE} - set(phones)
    return len(own.keys() - set(pairs)) + NEW_PHONE * len(new)


def prompts() -> Sequence[str]:
    """Sentences to be read aloud, written for this package so that all sounds and most pairs of them occur."""
    return resources.files("dnnvss.text").joinpath("prompts.txt").read_text("utf-8").splitlines()


@cache
def prompt_pairs(variant: str) -> dict[str, Pairs]:
    """Each of :func:`prompts` with the neighbouring sounds in it."""
    return {text: Counter(pairwise(row)) for text, row in _rows(variant).items()}


@cache
def prompt_triphones(variant: str) -> dict[str, list[str]]:
    """Each of :func:`prompts` with its triphones, silence at the ends, as :class:`Coverage` writes them."""
    return {text: [f"{a}-{b}+{c}" for a, b, c in zip(row, row[1:], row[2:], strict=False)]
            for text, row in _rows(variant).items()}


@cache
def _rows(variant: str) -> dict[str, tuple[str, ...]]:
    return {text: (SILENCE, *parse(text, variant).phones, SILENCE) for text in prompts()}
