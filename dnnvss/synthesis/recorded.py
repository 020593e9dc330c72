"""Speech from the corpus's own recordings: the units whose movement is played are heard, too.

**Source.** J. D. Edge, M. A. Sanchez, S. Maddock, 2004, conclusions: one choice of units for sound and
motion, which the paper asks for and does not have. That times are the recordings' own, so that no
sound is stretched, is ours.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.media import SPEECH_RATE
from dnnvss.phones import PHONES, SILENCES
from dnnvss.runs.run import Run
from dnnvss.speech.joining import Stretch, joined
from dnnvss.synthesis.plan import Plan
from dnnvss.synthesis.request import CORPUS, Recording, SpeakRequest
from dnnvss.systems import Example
from dnnvss.systems.codebook_units import Inventory
from dnnvss.systems.fragments import Fragment, Fragments, spoken_phones
from dnnvss.timing import Alignment, Tier

_ELSE = "Or take an engine: speech=auto"


def check_recordings(run: Run, request: SpeakRequest) -> None:
    """Refuse what recordings cannot say.

    Raises:
        DnnvssError: the run plays no fragments, or times are set that recordings would have to keep to.
    """
    if not isinstance(run.model, Fragments):
        raise DnnvssError(
            f"speech={CORPUS} joins the recordings of fragments, and the run's system is "
            f"{run.settings.model_name}",
            file=run.folder,
            remedy=f"Train one: dnnvss train model=fragments. {_ELSE}",
        )
    if request.timed:
        raise DnnvssError(
            f"speech={CORPUS} speaks in the time of its recordings",
            remedy="Leave out what sets the time: alignment, speed, total or durations=model",
        )


def with_recordings(run: Run, plan: Plan, example: Example) -> Plan:
    """The plan with the sound of the fragments that are chosen for it, at the times of their recordings.

    Neighbours share a phone, of which the first half is of the one and the second of the other.

    Args:
        run: of fragments.
        plan: what is said, at the times that the talker would take.
        example: of it.

    Raises:
        DnnvssError: the corpus is not there, or a fragment has no sound.
    """
    assert isinstance(run.model, Fragments)
    recorded = run.model.corpus_.recorded
    codes, wanted = spoken_phones(example)
    chosen = [f.best for f in run.model.fragments(example)]
    cuts = _cuts(chosen, recorded, codes, wanted)
    frames = np.zeros(len(codes), int)
    for cut in cuts:
        frames[cut.fragment.unit.first : cut.fragment.unit.last + 1] += cut.frames
    rate = float(run.task.clock.rate)
    sound = joined(_stretches(run, cuts, codes), SPEECH_RATE)
    return replace(
        plan,
        alignment=_timed(plan.alignment, example, frames / rate),
        sound=Recording(sound, SPEECH_RATE, sound),
        engine=CORPUS,
        fragments=tuple(chosen),
    )


@dataclass(frozen=True)
class _Cut:
    """What is heard of a fragment's recording.

    Args:
        fragment: of one place.
        first: frame of the recording.
        frames: of each of its phones (n,) that are heard.
    """

    fragment: Fragment
    first: int
    frames: np.ndarray


def _cuts(
    chosen: Sequence[Fragment], recorded: Inventory, codes: np.ndarray, wanted: np.ndarray
) -> list[_Cut]:
    """What is heard of each fragment: from the middle of its first phone to that of its last.

    At the ends of the sentence it is all of the phone; of a silence no more than wanted.
    """
    silent = np.isin(codes, [PHONES.index(p) for p in SILENCES if p in PHONES])
    cuts = []
    for k, fragment in enumerate(chosen):
        unit, place = fragment.unit, fragment.places[0]
        frames = recorded.frames[place : place + unit.last - unit.first + 1].astype(int)
        first = int(recorded.first[place] - recorded.bounds[recorded.owner[place]])
        if len(frames) > 1 or len(chosen) == 1:
            kept = min(frames[0], wanted[0]) if silent[0] and not k else frames[0]
            kept = kept if not k else frames[0] - frames[0] // 2
            first, frames = first + int(frames[0] - kept), np.r_[kept, frames[1:]]
            if k < len(chosen) - 1:
                frames[-1] = (frames[-1] + 1) // 2
            elif silent[-1]:
                frames[-1] = min(frames[-1], wanted[-1])
        cuts.append(_Cut(fragment, first, frames))
    return cuts


def _stretches(run: Run, cuts: Sequence[_Cut], codes: np.ndarray) -> list[Stretch]:
    """The sound of each cut; rounding to samples does not add up."""
    corpus, sounds = _corpus(run), dict[str, np.ndarray]()
    scale = SPEECH_RATE / float(run.task.clock.rate)
    edges = np.concatenate([[0], np.cumsum([cut.frames.sum() for cut in cuts])]) * scale
    lengths, made = np.diff(edges.round().astype(int)), []
    for cut, length in zip(cuts, lengths.tolist(), strict=True):
        (name,) = cut.fragment.sentences
        if name not in sounds:
            sounds[name] = _sound(corpus, cut.fragment, codes)
        start = round(cut.first * scale)
        made.append(Stretch(sounds[name], start, start + length))
    return made


def _corpus(run: Run) -> Corpus:
    try:
        return Corpus.open(run.settings.corpus_folder)
    except DnnvssError as error:
        raise DnnvssError(
            f"the recordings that speech={CORPUS} joins are not there: {error.problem}",
            file=error.file,
            remedy=f"Bring the prepared corpus there. {_ELSE}",
        ) from error


def _sound(corpus: Corpus, fragment: Fragment, codes: np.ndarray) -> np.ndarray:
    name = fragment.sentences[0]
    utterance = corpus.utterances.get(name)
    if utterance is None or utterance.audio is None:
        phones = fragment.described(codes)["phones"]
        raise DnnvssError(
            f"the fragment {phones} is from a sentence that has no sound",
            file=corpus.root,
            utterance=name,
            remedy=f"Prepare the corpus with its recordings. {_ELSE}",
        )
    return np.asarray(corpus.sound(utterance).samples)


def _timed(alignment: Alignment, example: Example, seconds: np.ndarray) -> Alignment:
    """Phones that last so long (S,), and the words that they make."""
    kept = np.flatnonzero(spoken_phones(example, every=True)[1] > 0)
    tier, words = alignment["phones"], list(alignment["words"])
    edges = [0.0, *np.cumsum(seconds).tolist()]
    rows = [(a, b, tier[i].label) for a, b, i in zip(edges, edges[1:], kept.tolist(), strict=False)]
    ends = np.array([w.end for w in words])
    middles = [(tier[i].start + tier[i].end) / 2 for i in kept.tolist()]
    owner = np.minimum(np.searchsorted(ends, middles, side="right"), len(words) - 1)
    spoken = []
    for word, phones in groupby(range(len(kept)), key=lambda k: int(owner[k])):
        own = list(phones)
        spoken.append((edges[own[0]], edges[own[-1] + 1], words[word].label))
    return Alignment([Tier("phones", rows), Tier("words", spoken)])
