"""Watches a run's test sentences: the talker's own videos and those that the run draws, by one tracker."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2
import numpy as np

from dnnvss.archives import read_arrays
from dnnvss.corpus import Corpus, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.lips import talker_level
from dnnvss.evaluation.outside.drawn_in import Redrawn
from dnnvss.evaluation.outside.judged import (
    CEILING,
    IN_STILL,
    IN_TEXT,
    IN_VOICE,
    LATE,
    OTHER,
    OWN,
    ROWS,
    TEXT,
    VOICE,
    Judged,
)
from dnnvss.evaluation.outside.lips import Lips, at, see
from dnnvss.evaluation.outside.scores import MEASURES, Watched, laid_over, scores
from dnnvss.evaluation.runs import not_learnt, open_corpus
from dnnvss.evaluation.videos import say, through_the_face
from dnnvss.face.base import Textured
from dnnvss.face.landmarker import Landmarker
from dnnvss.media import video_frames
from dnnvss.phones import SILENCES
from dnnvss.progress import counted
from dnnvss.runs.run import Run
from dnnvss.style import Style
from dnnvss.style.generator import make_style
from dnnvss.synthesis.request import Scene, SpeakRequest
from dnnvss.synthesis.speak import Spoken, speak
from dnnvss.timing import FrameClock, Tier

_BLUR, _QUALITY = 0.8, 60
"""Pixels of the blur of the copy, and its quality as JPEG."""
_LATE = 0.04


def judge(folder: Path, landmarker: Landmarker, *, count: int = 20, seed: int = 0, progress: bool = True) -> Judged:
    """A run's test sentences, as far as it has not learnt from them, beside the talker's own videos.

    Args:
        folder: of a finished run.
        landmarker: the tracker.
        count: sentences at most, drawn at random from those of the test.
        seed: of the draw.
        progress: whether to show how far it is.

    Raises:
        DnnvssError: no finished run, its face has no pictures, or its corpus is not there.
    """
    run = Run.open(folder)
    if not isinstance(run.face, Textured):
        raise DnnvssError(f"its face ({run.face.kind}) has no pictures for a tracker to see", file=folder,
                          remedy="Judge a run of face=aam")
    corpus = open_corpus(run.folder, run.settings.corpus_folder)
    tested = not_learnt(read_arrays(run.files.prediction("reference")), corpus, run.settings.split)
    ids = _drawn(tested, count, seed)
    filmed = [u for u in (corpus.utterances[i] for i in ids) if u.video]
    if not filmed:
        raise DnnvssError("none of the test sentences that it has not learnt from has a video", file=folder,
                          remedy="Judge a run of filmed speech with a test split of its own: folds=0")
    style = make_style(run.settings.style, run.face)
    watched = counted(filmed, "watching sentences", unit="sentences", disable=not progress)
    still = replace(style, life=0.0)  # lips are judged, not what moves them with the head
    seen = [_watch(run, corpus, utterance, still, landmarker) for utterance in watched]
    return score_all(seen, run.settings.style.name)


@dataclass(frozen=True)
class Sentence:
    """What was seen of a sentence.

    Args:
        utterance: of the corpus.
        truth: lips in the talker's own video.
        made: lips in other videos by the name of their row.
        lost: rows that there are none for, and why.
    """

    utterance: Utterance
    truth: Lips
    made: Mapping[str, Lips]
    lost: Mapping[str, str] = field(default_factory=dict)


def _watch(run: Run, corpus: Corpus, utterance: Utterance, style: Style, landmarker: Landmarker) -> Sentence:
    """All videos of a sentence, one after the other: of each no more than a picture is held, but of the recording."""
    truth, copy = (see(landmarker, map(change, _recorded(corpus, utterance))) for change in (np.asarray, _copied))
    spoken = say(run, corpus, utterance, style)
    made = {CEILING: copy, VOICE: see(landmarker, spoken.frames()), OWN: _own(landmarker, spoken, utterance)}
    shown, lost = {IN_VOICE: spoken.shown, IN_STILL: np.zeros_like(spoken.shown)}, dict[str, str]()
    if not run.heard:  # without a sound there is nothing to hear
        alone = speak(run, SpeakRequest(utterance.text, engine="none", style=style, scene=Scene(rate=utterance.clock),
                                        id=utterance.id))
        moments = laid_over(alone.plan.alignment["words"], utterance.alignment["words"], utterance.clock,
                            len(truth.seen))
        if moments is None:
            lost = dict.fromkeys((TEXT, IN_TEXT), "says other words")
        else:
            made[TEXT] = see(landmarker, alone.frames()).at(moments)
            shown[IN_TEXT] = at(alone.shown, moments)
    try:
        recording = Redrawn.open(run.face, corpus, utterance)
    except DnnvssError as error:
        return Sentence(utterance, truth, made, lost | dict.fromkeys(shown, f"cannot be drawn: {error}"))
    drawn = {row: recording.see(landmarker, parameters) for row, parameters in shown.items()}
    return Sentence(utterance, truth, made | drawn, lost)


def _own(landmarker: Landmarker, spoken: Spoken, utterance: Utterance) -> Lips:
    """The lips of what was measured in the recording, as the face shows it; not seen where nothing was measured."""
    pictures, known = through_the_face(spoken, utterance)
    lips = see(landmarker, pictures)
    return replace(lips, seen=lips.seen & known)


def score_all(seen: Sequence[Sentence], style: str) -> Judged:
    """All rows over all sentences; those beside the run's are made of the recordings."""
    clocks, tiers = [s.utterance.clock for s in seen], [s.utterance.alignment["phones"] for s in seen]
    level = talker_level([s.truth.tracks[:, 0] for s in seen], tiers, clocks, valid=[s.truth.seen for s in seen])
    found: dict[str, dict[str, list[tuple[float, float]]]] = {row: {m: [] for m in MEASURES} for row in ROWS}
    lost = []
    for k, sentence in enumerate(seen):
        truth, clock = sentence.truth, clocks[k]
        watched = Watched(_speech(tiers[k], clock, len(truth.seen)), level, clock)
        made: dict[str, Lips | None] = {
            **sentence.made, LATE: truth.at(np.arange(len(truth.seen)) - _LATE * float(clock.rate)),
            OTHER: _stretched(seen[(k + 1) % len(seen)], sentence) if len(seen) > 1 else None}
        lost += [f"{sentence.utterance.id}: {row} {why}" for row, why in sentence.lost.items()]
        for row, by in found.items():
            lips = made.get(row)
            own = dict.fromkeys(MEASURES, (0.0, 0.0)) if lips is None else \
                scores(truth, _as_long(lips, len(truth.seen)), watched)
            for measure, pair in own.items():
                by[measure].append(pair)
    pairs = {row: {m: tuple(own) for m, own in by.items()} for row, by in found.items()}
    return Judged(tuple(s.utterance.id for s in seen), style, pairs, tuple(lost))


def _drawn(ids: Sequence[str], count: int, seed: int) -> list[str]:
    chosen = np.random.default_rng(seed).permutation(len(ids))[:count]
    return [ids[k] for k in sorted(chosen)]


def _recorded(corpus: Corpus, utterance: Utterance) -> Iterable[np.ndarray]:
    return video_frames(corpus.path(utterance, "video"))


def _copied(picture: np.ndarray) -> np.ndarray:
    """A picture blurred and compressed again."""
    blurred = cv2.cvtColor(cv2.GaussianBlur(picture, (0, 0), _BLUR), cv2.COLOR_RGB2BGR)
    _, data = cv2.imencode(".jpg", blurred, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
    return np.asarray(cv2.cvtColor(np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR)), cv2.COLOR_BGR2RGB))


def _as_long(lips: Lips, frames: int) -> Lips:
    """The same in so many frames, the last one held."""
    rows = np.minimum(np.arange(frames), len(lips.seen) - 1)
    return replace(lips, tracks=lips.tracks[rows], seen=lips.seen[rows])


def _speech(tier: Tier, clock: FrameClock, frames: int) -> np.ndarray:
    times = [(s.start, s.end) for s in tier if s.label not in SILENCES]
    inside = np.zeros(frames, bool)
    if times:
        first, last = clock.edges(np.array([times[0][0], times[-1][1]]) - tier.start)
        inside[max(int(first), 0):int(last)] = True
    return inside


def _stretched(other: Sentence, sentence: Sentence) -> Lips | None:
    """The recording of another sentence, its speech as long as that of this one; None where one of them has none."""
    own, theirs = (_ends(s) for s in (sentence, other))
    if not own or not theirs:
        return None
    return other.truth.at(np.interp(np.arange(len(sentence.truth.seen)), own, theirs))


def _ends(sentence: Sentence) -> tuple[int, ...]:
    """The first and the last frame of speech; nothing where there is none."""
    inside = np.flatnonzero(_speech(sentence.utterance.alignment["phones"], sentence.utterance.clock,
                                    len(sentence.truth.seen)))
    return (int(inside[0]), int(inside[-1])) if len(inside) else ()
