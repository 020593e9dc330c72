"""The units of recorded movement that fragments are cut from, and how they are found."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.features import phones_of
from dnnvss.phones import PHONES
from dnnvss.phones.questions import DISTANCES
from dnnvss.systems.base import Example
from dnnvss.systems.codebook_units import Inventory
from dnnvss.text.syllables import syllable_starts

UNITS = ("sentence", "word", "syllable", "diphone", "any")
"""What a fragment may be; ``any`` is any run of phones, which the paper's pseudocode finds too."""


@dataclass(frozen=True)
class Unit:
    """A stretch of a sentence, and the places of the corpus that can stand for it.

    Args:
        first, last: its phones in the sentence, both ends counted; neighbours share one.
        kind: of :data:`UNITS`.
        at: (n,) the first phone of each place, in the corpus.
        stands: (2,) codes of the diphone that stands for it where the corpus has it not; empty elsewhere.
    """

    first: int
    last: int
    kind: str
    at: np.ndarray
    stands: tuple[int, ...] = ()


@dataclass(frozen=True)
class FragmentCorpus:
    """Recorded trajectories with their phones, and which runs of phones are words, syllables and sentences.

    Args:
        recorded: the trajectories; only phones that own a frame are among its phones.
        word, syllable: (P,) how many phones the word or syllable has that begins at a phone; 0 where none does.
    """

    recorded: Inventory
    word: np.ndarray
    syllable: np.ndarray

    @classmethod
    def of(cls, examples: Sequence[Example]) -> "FragmentCorpus":
        """The corpus of measured examples.

        Raises:
            DnnvssError: no phone was measured throughout, or no two neighbouring ones.
        """
        whole = Inventory.of(examples)
        kept = whole.frames > 0
        marks = [_marked(e) for e in examples]
        word, syllable = (np.concatenate([m[k] for m in marks]) for k in (0, 1))
        parts = {
            name: getattr(whole, name)[kept]
            for name in ("code", "first", "frames", "owner", "usable")
        }
        made = cls(Inventory(whole.ids, whole.static, whole.bounds, **parts), word, syllable)
        if not made._diphones:
            raise DnnvssError(
                "no two neighbouring phones of the training examples were measured throughout",
                remedy="Train on measured utterances of more than one phone, or take model=codebook",
            )
        return made

    @cached_property
    def ends(self) -> np.ndarray:
        """The number (P,) of phones from each to the end of its sentence."""
        owner = self.recorded.owner
        last = np.searchsorted(owner, owner, side="right")
        return np.asarray(last - np.arange(len(owner)))

    @cached_property
    def begins(self) -> np.ndarray:
        """Whether (P,) each phone is the first of its sentence."""
        owner = self.recorded.owner
        return np.asarray(np.diff(owner, prepend=-1) != 0)

    @cached_property
    def unmeasured(self) -> np.ndarray:
        """Running number (P + 1,) of phones that were not measured throughout."""
        return np.append(0, np.cumsum(~self.recorded.usable))

    def units(self, codes: np.ndarray, kinds: Sequence[str], own: int) -> list[Unit]:
        """The units of a sentence, the longest first from its start on; neighbours share a phone.

        Args:
            codes: (S,) of its phones.
            kinds: of :data:`UNITS` that may be taken.
            own: a sentence of the corpus that is left out, or -1.

        **Source**: Edge et al. 2004, section 5.1.1, the selection algorithm; the back-off is ours.
        """
        if len(codes) == 1:
            found = np.flatnonzero((self.recorded.code == codes[0]) & self.recorded.usable)
            near = found if len(found) else self._nearest_phone(int(codes[0]))
            return [
                Unit(
                    0, 0, "diphone", near, () if len(found) else (int(self.recorded.code[near[0]]),)
                )
            ]
        units: list[Unit] = []
        first = 0
        while first < len(codes) - 1:
            unit = self._longest(codes, first, kinds, own)
            units.append(unit)
            first = unit.last
        return units

    def _longest(self, codes: np.ndarray, first: int, kinds: Sequence[str], own: int) -> Unit:
        recorded = self.recorded
        at = np.flatnonzero((recorded.code == codes[first]) & (recorded.owner != own))
        best: Unit | None = None
        for length in range(2, len(codes) - first + 1):
            at = at[self.ends[at] >= length]
            at = at[recorded.code[at + length - 1] == codes[first + length - 1]]
            if not len(at):
                break
            whole = at[self.unmeasured[at + length] == self.unmeasured[at]]
            for kind in kinds:
                places = whole[self._is(kind, whole, length)]
                if len(places):
                    best = Unit(first, first + length - 1, kind, places)
                    break
        return best if best is not None else self._stand_in(codes, first, own)

    def _is(self, kind: str, at: np.ndarray, length: int) -> np.ndarray:
        match kind:
            case "sentence":
                return np.asarray(self.begins[at] & (self.ends[at] == length))
            case "word":
                return np.asarray(self.word[at] == length)
            case "syllable":
                return np.asarray(self.syllable[at] == length)
            case "diphone":
                return np.full(len(at), length == 2)
        return np.ones(len(at), bool)

    @cached_property
    def _diphones(self) -> dict[tuple[int, int], np.ndarray]:
        """Each diphone that was measured, to its places."""
        code = self.recorded.code
        at = np.flatnonzero(
            (self.ends >= 2)[:-1] & self.recorded.usable[:-1] & self.recorded.usable[1:]
        )
        if not len(at):
            return {}
        pairs = code[at] * len(PHONES) + code[at + 1]
        order = np.argsort(pairs, kind="stable")
        values, starts = np.unique(pairs[order], return_index=True)
        parts = np.split(at[order], starts[1:])
        return {
            (int(v) // len(PHONES), int(v) % len(PHONES)): p
            for v, p in zip(values, parts, strict=True)
        }

    def _stand_in(self, codes: np.ndarray, first: int, own: int) -> Unit:
        """The diphone of the corpus that is nearest by articulation, both phones counted."""
        wanted, apart = codes[first : first + 2], []
        for pair, places in self._diphones.items():
            left = places[self.recorded.owner[places] != own]
            if len(left):
                apart.append(
                    (DISTANCES[wanted[0], pair[0]] + DISTANCES[wanted[1], pair[1]], pair, left)
                )
        if not apart:  # a corpus of one sentence: it may stand for itself
            apart = [(0.0, pair, places) for pair, places in self._diphones.items()]
        _, pair, places = min(apart, key=lambda each: (each[0], each[1]))
        same = pair == tuple(wanted.tolist())
        return Unit(first, first + 1, "diphone", places, () if same else pair)

    def _nearest_phone(self, code: int) -> np.ndarray:
        usable = np.flatnonzero(self.recorded.usable)
        apart = DISTANCES[code, self.recorded.code[usable]]
        return usable[apart == apart.min()]

    def state(self) -> dict[str, Any]:
        """Plain containers and arrays."""
        return {
            "recorded": self.recorded.state(),
            "word": self.word,
            "syllable": self.syllable,
        }

    @classmethod
    def from_state(cls, state: dict[str, Any]) -> "FragmentCorpus":
        """The corpus that :meth:`state` described."""
        return cls(
            Inventory.from_state(state["recorded"]),
            state["word"],
            state["syllable"],
        )


def _marked(example: Example) -> tuple[np.ndarray, np.ndarray]:
    """Phones with a frame of the word, and of the syllable, that begins at each phone with a frame; 0 elsewhere."""
    frames = phones_of(example.codes).frames
    tier, words = example.alignment["phones"], example.alignment["words"]
    middles = np.array([(s.start + s.end) / 2 for s in tier])
    kept = np.flatnonzero(frames > 0)
    word, syllable = np.zeros(len(kept), np.int64), np.zeros(len(kept), np.int64)
    for segment in words:
        inside = np.flatnonzero((middles >= segment.start) & (middles < segment.end))
        if not segment.label or not len(inside):
            continue
        starts = [
            *(inside[0] + k for k in syllable_starts([tier[i].label for i in inside.tolist()])),
            inside[-1] + 1,
        ]
        for marks, edges in ((word, [inside[0], inside[-1] + 1]), (syllable, starts)):
            cuts = np.searchsorted(kept, edges)
            for a, b in pairwise(cuts.tolist()):
                if b - a >= 2:
                    marks[a] = b - a
    return word, syllable
