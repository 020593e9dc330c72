"""From a prepared corpus to the examples that models see."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.acoustics import alter
from dnnvss.corpus import SPLITS, Corpus, Utterance
from dnnvss.curves import Windows, derivatives, resample
from dnnvss.errors import DnnvssError
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.features import FeatureTable, encode
from dnnvss.media import Sound
from dnnvss.phones import SILENCES
from dnnvss.systems.base import Example
from dnnvss.timing import Alignment, FrameClock, Tier

_VOICES = 40
"""Recordings from which voices under another are taken."""


@dataclass(frozen=True)
class Task:
    """What a system is trained on: labels, clock and streams.

    Args:
        table: the feature table.
        clock: the trajectory clock.
        windows: static and derivative windows of the targets.
    """

    table: FeatureTable
    clock: FrameClock
    windows: Windows

    def example(self, utterance: Utterance, parameters: np.ndarray | None = None, valid: np.ndarray | None = None,
                visemes: Sequence[Tier] = (), sound: Sound | None = None) -> Example:
        """Return an utterance as models see it.

        Args:
            utterance: with the tiers ``phones`` and ``words``.
            parameters: measured parameters (F, D) of the face at the source rate, or None at synthesis.
            valid: (F,) bool, source frames that were measured.
            visemes: tiers of dynamic visemes that may all be true; the first goes into the alignment, the others make
                the alternatives. Where there is none, the utterance's own is used if the labels ask for it.
            sound: what is heard; needed where the labels read it.
        """
        if visemes:
            first, *others = (replace(utterance, alignment=utterance.alignment.with_tier(tier)) for tier in visemes)
            example = self.example(first, parameters, valid, sound=sound)
            alternatives = tuple(encode(u.alignment, u.text, self.table, self.clock, sound) for u in others)
            return replace(example, alternatives=alternatives)
        codes = encode(utterance.alignment, utterance.text, self.table, self.clock, sound)
        if parameters is None or valid is None:
            return Example(utterance.id, utterance.alignment, codes)
        source = utterance.clock
        static = resample(parameters, source, self.clock, count=len(codes))
        nearest = np.minimum((self.clock.centres(len(codes)) * float(source.rate)).astype(int), len(valid) - 1)
        known = _reached(valid[nearest], self.windows.reach)
        return Example(utterance.id, utterance.alignment, codes, derivatives(static, self.windows).astype(np.float32),
                       known)

    def sound(self, corpus: Corpus, utterance: Utterance) -> Sound | None:
        """The recorded sound of an utterance where the labels read it."""
        return corpus.sound(utterance) if "sound" in self.table.needs else None


def _reached(valid: np.ndarray, reach: int) -> np.ndarray:
    """The frames (T,) whose derivatives look at none that is not ``valid``."""
    unknown = np.convolve(~valid, np.ones(2 * reach + 1, int), "full")[reach : reach + len(valid)] > 0
    return ~unknown


def split_examples(task: Task, corpus: Corpus, encoded: EncodedCorpus, variant: str,
                   visemes: Mapping[str, Sequence[Tier]] | None = None,
                   scratch: Path | None = None) -> dict[str, list[Example]]:
    """Return the examples of ``train``, ``val`` and ``test``.

    Args:
        task: what the examples are for.
        corpus, encoded: utterances and their parameters.
        variant: of the split.
        visemes: the tiers of each utterance, by id.
        scratch: folder of a file without a name from which the targets are mapped, so that a corpus of many hours does
            not fill the memory; in memory if left out.

    Raises:
        DnnvssError: a split has no utterance with a measured frame, or none whose movement was measured.
    """
    splits = {name: corpus.split(name, variant) for name in SPLITS}
    for name, given in splits.items():
        kept = [u for u in given if u.id not in encoded.dropped]
        if not any(encoded.clip(u.id).valid.any() for u in kept):
            raise DnnvssError(f"the split {name!r} has no measured frame: {len(kept)} utterances, and "
                              f"{len(given) - len(kept)} left out (see above)", file=corpus.root,
                              remedy="Mend or replace these clips, or give the split more of them, and prepare again")
    made = {name: _in(scratch, make_examples(task, corpus, given, encoded, visemes)) for name, given in splits.items()}
    for name, examples in made.items():
        if not any(e.measured[1].any() for e in examples):
            raise DnnvssError(f"the split {name!r} has no frame that was measured together with those beside it, which "
                              "tell how fast it moves", file=corpus.root,
                              remedy="Mend or replace its clips, or give the split more of them, and prepare again")
    return made


def _in(scratch: Path | None, examples: Iterator[Example]) -> list[Example]:
    if scratch is None:
        return list(examples)
    bare: list[Example] = []

    def targets() -> Iterator[np.ndarray]:
        for example in examples:
            bare.append(replace(example, targets=None))
            yield example.measured[0]

    whole = files.mapped(targets(), scratch)
    ends = np.cumsum([len(e.codes) for e in bare])
    return [replace(e, targets=whole[end - len(e.codes) : end]) for e, end in zip(bare, ends, strict=True)]


def make_examples(task: Task, corpus: Corpus, utterances: Sequence[Utterance], encoded: EncodedCorpus,
                  visemes: Mapping[str, Sequence[Tier]] | None = None) -> Iterator[Example]:
    """Return the examples of utterances, one after the other, without those that were not encoded."""
    for u in utterances:
        if u.id not in encoded.dropped:
            clip = encoded.clip(u.id)
            tiers = visemes[u.id] if visemes else ()
            yield task.example(u, clip.parameters, clip.valid, tiers, task.sound(corpus, u))


def with_altered(task: Task, corpus: Corpus, examples: Iterable[Example], copies: int, others: Sequence[Utterance]
                 ) -> Iterator[Example]:
    """Examples with their codes under altered sounds, the same in every run; as they are where the labels read none.

    Args:
        task, corpus: what the examples are for, and of.
        examples: to learn from.
        copies: altered sounds of each.
        others: whose voices are heard under theirs, the first 40 of them.
    """
    if not copies or "sound" not in task.table.needs:
        yield from examples
        return
    voices = [corpus.sound(u).samples for u in [u for u in others if u.audio][:_VOICES]]
    for example in examples:
        utterance, own = corpus.utterances[example.id], corpus.sound(corpus.utterances[example.id])
        rng = np.random.default_rng(list(example.id.encode()))
        sounds = [replace(own, samples=alter.altered(rng, own.samples, voices)) for _ in range(copies)]
        codes = [encode(example.alignment, utterance.text, task.table, task.clock, sound) for sound in sounds]
        yield replace(example, altered=tuple(codes))


def word_frames(alignment: Alignment, clock: FrameClock, known: Collection[str]) -> np.ndarray:
    """Return (T,) bool: True inside words that are not among the ``known`` ones."""
    tier = alignment["words"]
    return np.array([bool(w) and w not in known for w in tier.labels])[tier.frame_index(clock)]


def speech_frames(alignment: Alignment, clock: FrameClock) -> np.ndarray:
    """Return (T,) bool: True from the start of the first phone to the end of the last one that is not silence."""
    tier = alignment["phones"]
    spoken = [i for i, label in enumerate(tier.labels) if label not in SILENCES]
    edges = tier.frame_edges(clock)
    mask = np.zeros(edges[-1], dtype=bool)
    if spoken:
        mask[edges[spoken[0]] : edges[spoken[-1] + 1]] = True
    return mask
