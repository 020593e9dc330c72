"""Where in speech a frame lies: what blinks and movements of the head are linked to."""

import numpy as np

from dnnvss.phones import SILENCES
from dnnvss.text.tree import linguistic_tree
from dnnvss.timing import Alignment, FrameClock

CONTEXTS = ("silence", "after a phrase", "unstressed", "stressed", "phrase end")
"""Names of the contexts; the position is the code."""
_SILENCE, _AFTER, _UNSTRESSED, _STRESSED, _END = range(len(CONTEXTS))
_SPAN = 0.3
"""Seconds at the end of a phrase, and of the silence after it, that are contexts of their own."""


def speech_contexts(alignment: Alignment, text: str, clock: FrameClock, frames: int) -> np.ndarray:
    """Codes of :data:`CONTEXTS` (F,) of the frames of an utterance.

    Phrases and stress are those of :func:`dnnvss.text.tree.linguistic_tree`. Where only a voice is known, all frames
    are unstressed speech.

    Args:
        alignment: with tiers ``phones`` and ``words``, or without.
        text: as written; may be empty.
        clock: of the frames.
        frames: how many.
    """
    if "phones" not in alignment or "words" not in alignment:
        return np.full(frames, _UNSTRESSED)
    tree, tier = linguistic_tree(alignment, text), alignment["phones"]
    stress = np.where(tree.stress == 1, _STRESSED, _UNSTRESSED)
    spoken = np.array([label not in SILENCES for label in tier.labels])
    times = clock.centres(frames) + tier.start
    found = np.where(spoken, stress, _SILENCE)[tier.indices_at(times)]
    for phrase in range(tree.phrases):
        end = tier[int(np.flatnonzero(tree.phrase == phrase)[-1])].end
        late = (times >= end - _SPAN) & (times < end + _SPAN)
        found = np.where(late, np.where(found == _SILENCE, _AFTER, np.where(times < end, _END, found)), found)
    return found
