"""What a talker does between words: which pauses, and how long."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dnnvss.corpus.utterance import Utterance
from dnnvss.phones import SHORT_PAUSE, SILENCE
from dnnvss.text.sentence import Word
from dnnvss.text.tree import linguistic_tree, phrase_ends

SHORTEST = 0.01
"""Seconds below which no phone and no pause is believed or made."""
_DEFAULT_PAUSES = {"minor": (SHORT_PAUSE, 0.18), "major": (SHORT_PAUSE, 0.4)}


@dataclass(frozen=True)
class Pauses:
    """What a corpus does after the breaks ``none``, ``minor`` and ``major``: a label and seconds, or None."""

    none: tuple[str, float] | None
    minor: tuple[str, float] | None
    major: tuple[str, float] | None


def usual_pauses(utterances: Iterable[Utterance]) -> Pauses:
    """Return the pauses that the corpus makes after each kind of break.

    Defaults after punctuation where it has fewer than five. Where it pauses after fewer than half of them, none after a
    comma and the default after a sentence, of which few recordings hold two.
    """
    seen: dict[bool, list[tuple[str, float]]] = {False: [], True: []}
    for utterance in utterances:
        ends = phrase_ends(utterance.alignment, utterance.text)
        tree = linguistic_tree(utterance.alignment, utterance.text)
        segments = list(utterance.alignment["phones"])
        spoken = np.flatnonzero(tree.word >= 0)
        for a, b in pairwise(spoken):
            if tree.word[a] == tree.word[b]:
                continue
            between = segments[a + 1 : b]
            label = SILENCE if any(s.label == SILENCE for s in between) else SHORT_PAUSE if between else ""
            seen[bool(ends[a])].append((label, sum(s.duration for s in between)))
    minor, major = _DEFAULT_PAUSES["minor"], _DEFAULT_PAUSES["major"]
    return Pauses(_usual(seen[False], None, None), _usual(seen[True], minor, None),
                  _usual(seen[True], major, major, 1.6))


def _usual(seen: list[tuple[str, float]], unknown: tuple[str, float] | None, rare: tuple[str, float] | None,
           longer: float = 1.0) -> tuple[str, float] | None:
    """The pause at breaks of a kind: ``unknown`` where few were seen, ``rare`` where most have no pause."""
    paused = [(label, seconds) for label, seconds in seen if label]
    if len(seen) < 5:
        return unknown
    if len(paused) < len(seen) / 2:
        return rare
    label = Counter(label for label, _ in paused).most_common(1)[0][0]
    return label, float(np.median([s for _, s in paused])) * longer


def pause_after(word: Word, pauses: Pauses) -> tuple[str, float] | None:
    """The pause that a word is followed by: what the text asks for, or what is usual."""
    usual = {"none": pauses.none, "minor": pauses.minor, "major": pauses.major}[word.break_after]
    if word.pause is None:
        return usual
    return ((usual or _DEFAULT_PAUSES["major"])[0], word.pause) if word.pause >= SHORTEST else None
