"""A take: one sentence as the talker says it, before anything is drawn."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dnnvss.corpus.talker.durations import speak
from dnnvss.corpus.talker.geometry import SHEET, landmark_track
from dnnvss.corpus.talker.grammar import compose, spoken_words
from dnnvss.corpus.talker.motion import Motion, perform
from dnnvss.corpus.talker.vocabulary import spoken_forms, word_classes
from dnnvss.phones import SPOKEN, strip_stress
from dnnvss.timing import Alignment, FrameClock, Tier

RATE = 30
"""Frames of video a second."""
_JITTER = 0.05  # pixels of a 320 picture by which the saved landmarks tremble, as a tracker's do


@dataclass(frozen=True)
class Take:
    """A sentence, when and how it is said.

    Args:
        id: ``demo_000`` and so on.
        text: the words as written.
        alignment: tiers ``phones``, ``words`` and ``gestures``; it ends with a frame.
        motion: the articulators at any time.
        seed: of what is drawn and tracked.
    """

    id: str
    text: str
    alignment: Alignment
    motion: Motion
    seed: tuple[int, int]

    @property
    def frames(self) -> int:
        """The number of video frames."""
        return FrameClock(RATE).edge(self.alignment.end)

    @cached_property
    def articulators(self) -> np.ndarray:
        """The articulators at the centre of each frame, (F, 12)."""
        return self.motion.at(FrameClock(RATE).centres(self.frames))

    def landmarks(self, size: int = SHEET) -> np.ndarray:
        """Return the landmarks (F, 82, 2), float32 pixels, with the small jitter of a good tracker."""
        track = landmark_track(self.articulators, size)
        jitter = np.random.default_rng([*self.seed, 3]).normal(0, _JITTER * size / SHEET, track.shape)
        return (track + jitter).astype(np.float32)


def script(sentences: int, seed: int = 0) -> dict[str, str]:
    """Return the text of each utterance by id."""
    return {f"demo_{index:03d}": text for index, text in enumerate(compose(sentences, seed))}


def perform_take(name: str, text: str, seed: int = 0) -> Take:
    """Return the take of a text; the same for the same id, text and seed."""
    number = (seed, int(name.rsplit("_", 1)[1]))
    random = np.random.default_rng([*number, 2])
    alignment = _whole_frames(speak(text, random))
    motion, gestures = perform(alignment, random)
    return Take(name, text, alignment.with_tier(gestures), motion, number)


def _whole_frames(alignment: Alignment) -> Alignment:
    """Return the alignment with its last silence drawn out to the end of a frame."""
    end = FrameClock(RATE).seconds(int(np.ceil(alignment.end * RATE - 1e-6)))
    return Alignment(Tier(t.name, [*t.segments[:-1], t.segments[-1]._replace(end=end)]) for t in alignment.tiers)


def unseen_splits(texts: dict[str, str], seed: int = 0, val: float = 0.075, test: float = 0.12) -> dict[str, list[str]]:
    """Return ``unseen_train``, ``unseen_val`` and ``unseen_test``: certain words occur in the test sentences only.

    Words of the grammar's classes are held out in random order, as long as every phone stays with the rest and until
    the test sentences are the share asked for. The words that were held out are those of the test that the others lack.
    """
    said = {name: {word for phrase in spoken_words(text) for word in phrase} for name, text in texts.items()}
    classed = {word for words in word_classes().values() for word in words}
    present = sorted(classed & set().union(*said.values()))
    order = np.random.default_rng([seed, 4]).permutation(len(present))
    chosen: set[str] = set()
    for word in (present[i] for i in order):
        with_word = chosen | {name for name, words in said.items() if word in words}
        if len(with_word) > max(1, round(test * len(texts))) or not _same_phones(said, with_word):
            continue
        chosen = with_word
    rest = [name for name in texts if name not in chosen]
    every = max(2, round(1 / val))
    return {
        "unseen_train": [name for k, name in enumerate(rest) if k % every != 1],
        "unseen_val": rest[1::every],
        "unseen_test": sorted(chosen),
    }


def _same_phones(said: dict[str, set[str]], without: Sequence[str] | set[str]) -> bool:
    """Tell whether the other sentences have all the phones of the whole."""

    def phones(names: set[str]) -> set[str]:
        words = set().union(*(said[name] for name in names)) if names else set()
        return {strip_stress(phone) for word in words for phone in spoken_forms()[word]} & set(SPOKEN)

    return phones(set(said) - set(without)) == phones(set(said)) or len(said) < 20
