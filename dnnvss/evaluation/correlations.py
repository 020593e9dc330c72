"""How much of what is seen can be heard: canonical correlations of acoustic features and a face's parameters.

**Source**: Theobald and Wilkinson 2007, section 4 (Figures 3 to 5).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from dnnvss.corpus import Corpus, Utterance
from dnnvss.curves import resample
from dnnvss.errors import DnnvssError
from dnnvss.face.base import largest_groups
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.features import FeatureTable, expand
from dnnvss.features.encode import encode_recording
from dnnvss.features.recording import Recording
from dnnvss.media import Sound
from dnnvss.settings import check_settings, setting
from dnnvss.systems.canonical import correlations
from dnnvss.systems.context import with_context
from dnnvss.systems.examples import speech_frames
from dnnvss.timing import FrameClock

FIRST = 2
"""Canonical correlations that are kept, the largest."""


@dataclass(frozen=True, kw_only=True)
class Series:
    """One kind of sound in a study.

    Args:
        name: of its features; series of one name and different context are points of one line.
        labels: the features; they read the sound alone.
        rate: frames a second at which they are worked out. Where the video has another, its parameters are brought
            to this rate by cubic splines, and the frames at the centres of the video's are compared.
        context: frames of this rate on each side that are appended (t); every (2t + 1)th frame is kept.
    """

    name: str
    labels: FeatureTable
    rate: float = setting(25.0, above=0)
    context: int = setting(0, least=0)

    def __post_init__(self) -> None:
        check_settings(self, "study.series")
        if self.labels.needs != {"sound"}:
            raise DnnvssError(f"study.series: the labels of {self.name} read more than the sound",
                              remedy="Name acoustic blocks alone, such as mfcc")


@dataclass(frozen=True, kw_only=True)
class Study:
    """A file of ``conf/study``: which sounds, how many frames, how often.

    Args:
        name: of the study, and of what is written.
        series: see :class:`Series`.
        first, last, step: numbers of frames that are drawn (N).
        repeats: how often. A repeat draws ``last`` frames in random order, the same ones for all series of one
            context, and a smaller number is the first of them: each number is drawn as if by itself.
        parameters: group of the face to how many of its leading parameters are looked at; all of other groups.
        speech: whether only frames between the first and the last phone of a sentence are drawn.
        seed: of the draws.
    """

    name: str
    series: tuple[Series, ...]
    first: int = setting(50, least=2)
    last: int = setting(2500, least=2)
    step: int = setting(50, least=1)
    repeats: int = setting(100, least=1)
    parameters: Mapping[str, int] = setting({}, least=1)
    speech: bool = False
    seed: int = setting(0, least=0)

    def __post_init__(self) -> None:
        check_settings(self, "study")
        if self.first > self.last or not self.series:
            raise DnnvssError(f"study={self.name} compares nothing: first={self.first}, last={self.last}, "
                              f"{len(self.series)} series", remedy="Give a series, and last above first")

    @property
    def sizes(self) -> np.ndarray:
        """The numbers of frames (S,)."""
        return np.arange(self.first, self.last + 1, self.step)


@dataclass(frozen=True)
class Correlated:
    """What a study found.

    Args:
        study: that was made.
        values: place of a series and group of the face to correlations (repeats, S, FIRST).
        widths: group of the face to its number of parameters.
        frames: how many there were to draw from.
    """

    study: Study
    values: Mapping[tuple[int, str], np.ndarray]
    widths: Mapping[str, int]
    frames: int = field(default=0)

    def summary(self, series: int, group: str, which: int) -> np.ndarray:
        """Mean, 2.5th and 97.5th percentile over the repeats, (3, S), of a correlation counted from 0."""
        values = self.values[series, group][:, :, which]
        return np.stack([values.mean(axis=0), *np.percentile(values, (2.5, 97.5), axis=0)])


def correlate(study: Study, corpus: Corpus, encoded: EncodedCorpus, utterances: Sequence[Utterance]) -> Correlated:
    """The canonical correlations that a study asks for.

    Raises:
        DnnvssError: fewer frames than are to be drawn.
    """
    groups = {name: own[: study.parameters.get(name)] for name, own in largest_groups(encoded.face.groups).items()}
    heard, seen = _rows(study, corpus, encoded, utterances)
    values: dict[tuple[int, str], np.ndarray] = {}
    for context in sorted({s.context for s in study.series}):
        chosen = [k for k, s in enumerate(study.series) if s.context == context]
        every = 2 * context + 1
        values |= _drawn(study, [(k, heard[k][::every], seen[k][::every]) for k in chosen], groups)
    return Correlated(study, values, {name: len(own) for name, own in groups.items()}, len(seen[0]))


def _rows(study: Study, corpus: Corpus, encoded: EncodedCorpus,
          utterances: Sequence[Utterance]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """What each series hears and sees in each measured frame of the video, (n, r) and (n, D)."""
    kept = [u for u in utterances if u.id not in encoded.dropped]
    found: list[list[tuple[np.ndarray, np.ndarray]]] = [[] for _ in study.series]
    for utterance in kept:
        code, sound = encoded.clip(utterance.id), corpus.sound(utterance)
        wanted = _wanted(study, utterance, code.valid)
        for own, series in zip(found, study.series, strict=True):
            own.append(_heard(series, sound, code.parameters, utterance.clock, wanted))
    return ([np.concatenate([x for x, _ in own]) for own in found],
            [np.concatenate([y for _, y in own]) for own in found])


def _wanted(study: Study, utterance: Utterance, valid: np.ndarray) -> np.ndarray:
    """The measured frames (n,) of a clip that a study draws from."""
    wanted = valid.copy()
    if study.speech:
        spoken = speech_frames(utterance.alignment, utterance.clock)
        wanted[: len(spoken)] &= spoken[: len(wanted)]
        wanted[len(spoken):] = False
    return np.flatnonzero(wanted)


def _heard(series: Series, sound: Sound, parameters: np.ndarray, source: FrameClock,
           wanted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Features (n, r) and parameters (n, D) at the wanted frames of the video."""
    clock = FrameClock(series.rate)
    codes = encode_recording(Recording(None, "", sound), series.labels, clock)
    rows = with_context(expand(codes), tuple(range(-series.context, series.context + 1)))
    seen = parameters if clock == source else resample(parameters, source, clock)
    at = ((wanted + 0.5) / float(source.rate) * float(clock.rate) + 1e-6).astype(int)
    inside = at < min(len(rows), len(seen))
    return rows[at[inside]].astype(np.float64), seen[at[inside]].astype(np.float64)


def _drawn(study: Study, parts: Sequence[tuple[int, np.ndarray, np.ndarray]],
           groups: Mapping[str, Sequence[int]]) -> dict[tuple[int, str], np.ndarray]:
    """The correlations (repeats, S, FIRST) of series that share their frames.

    Frames are drawn in random order; sums of products over the first 50, 100, ... of them are running sums, from which
    the covariances of all sizes follow without looking at a frame twice.
    """
    count = min(len(x) for _, x, _ in parts)
    if count < study.last:
        raise DnnvssError(f"study={study.name} draws {study.last} frames, and there are {count}",
                          remedy=f"Give study.last={count} or less, or a larger corpus")
    rng = np.random.default_rng(study.seed)
    found: dict[tuple[int, str], list[np.ndarray]] = {}
    joint = {(k, name): _whitened(np.hstack([x[:count], y[:count][:, list(own)]]))
             for k, x, y in parts for name, own in groups.items()}
    widths = {k: x.shape[1] for k, x, _ in parts}
    for _ in range(study.repeats):
        drawn = rng.permutation(count)[: study.last]
        for key, rows in joint.items():
            each = correlations(_covariances(rows[drawn], study.sizes), widths[key[0]])[:, :FIRST]
            found.setdefault(key, []).append(each)
    return {key: np.stack(each) for key, each in found.items()}


def _whitened(rows: np.ndarray) -> np.ndarray:
    """Rows with mean 0 and deviation 1: products of such numbers lose no digits."""
    spread = rows.std(axis=0)
    return (rows - rows.mean(axis=0)) / np.where(spread > 0, spread, 1)


def _covariances(rows: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """The covariances (S, C, C) of the first ``sizes`` rows (n, C)."""
    starts = [0, *sizes[:-1].tolist()]
    parts = [rows[a:b] for a, b in zip(starts, sizes.tolist(), strict=True)]
    products = np.cumsum([part.T @ part for part in parts], axis=0)
    means = np.cumsum([part.sum(axis=0) for part in parts], axis=0) / sizes[:, None]
    return products / sizes[:, None, None] - means[:, :, None] * means[:, None, :]
