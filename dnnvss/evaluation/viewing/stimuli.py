"""Stimuli: what a condition shows of a sentence, as a video in step with its sound."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import __version__, files
from dnnvss.corpus import Corpus
from dnnvss.curves import resample, smoothing_spline
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.anchors import stretched
from dnnvss.evaluation.bench import Sentence
from dnnvss.evaluation.runs import RunData, by_face, not_learnt, open_corpus, read_run
from dnnvss.evaluation.videos import recorded
from dnnvss.evaluation.viewing.design import Condition, Design, sound_of
from dnnvss.evaluation.viewing.material import Item
from dnnvss.evaluation.viewing.sheet import CHANGED, Shown
from dnnvss.evaluation.viewing.sounds import cut, in_noise
from dnnvss.face.base import Textured
from dnnvss.media import SOUND_RATE, read_audio, write_video
from dnnvss.render.pictures import Pictures
from dnnvss.runs.run import Run
from dnnvss.settings import read_settings
from dnnvss.style import Style
from dnnvss.style.generator import PLAIN, StyleSettings, make_style
from dnnvss.synthesis.request import Recording, SpeakRequest
from dnnvss.synthesis.speak import Spoken, speak
from dnnvss.timing import FrameClock


@dataclass(frozen=True)
class Studio:
    """What stimuli are made with: the runs that were given, opened, and their corpus.

    Args:
        design: of the test.
        runs: opened.
        data: what they were tested on.
        corpus: that they share.
        drawn: what draws the face of each run.
    """

    design: Design
    runs: tuple[Run, ...]
    data: tuple[RunData, ...]
    corpus: Corpus
    drawn: tuple[Pictures, ...]
    _spoken: dict[str, Spoken] = field(default_factory=dict)

    @classmethod
    def open(cls, design: Design, folders: Sequence[Path]) -> "Studio":
        """The runs in some folders.

        Raises:
            DnnvssError: a folder of no finished run, or runs of other test sentences, rates or pictures.
        """
        data = tuple(read_run(folder) for folder in folders)
        by_face({str(d.folder): d for d in data})
        runs = tuple(Run.open(folder) for folder in folders)
        drawn = tuple(run.pictures(design.scale) for run in runs)
        if len({pictures.size for pictures in drawn}) > 1:
            raise DnnvssError("the runs' faces have pictures of different sizes",
                              remedy="Test runs of one kind of face at a time")
        return cls(design, runs, data, open_corpus(data[0].folder, data[0].corpus), drawn)

    @property
    def tested(self) -> list[str]:
        """The ids of the sentences that the runs were tested on."""
        return list(self.data[0].arrays["reference"])

    @property
    def unlearnt(self) -> list[str]:
        """Those of them that no run has learnt from."""
        kept = [set(not_learnt(self.tested, self.corpus, own.settings.split)) for own in self.data]
        return [i for i in self.tested if i in set.intersection(*kept)]

    def shown(self, condition: Condition) -> Shown:
        """What the sheet says of a condition."""
        if condition.shows == "recording":
            return Shown(condition.name, condition.shows)
        run = self.runs[condition.run - 1]
        own = condition.style == "own" and condition.shows == "run"
        changed = bool(condition.dials) or condition.smooth is not None or (
            sound_of(self.design, condition) != self.design.sound)
        style = CHANGED if changed else run.settings.style.name if own else "plain"
        learnt = run.files.model if condition.shows == "run" else run.files.face
        return Shown(condition.name, condition.shows, style, str(run.folder.resolve()), files.digest(learnt)[:16])


@dataclass(frozen=True)
class Clip:
    """A stimulus before it is written: pictures, how many, their clock, and the sound."""

    pictures: Iterator[np.ndarray]
    count: int
    clock: FrameClock
    sound: np.ndarray | None

    @property
    def seconds(self) -> float:
        """It lasts."""
        return self.count / float(self.clock.rate)


def stimulus_id(studio: Studio, condition: Condition, shown: Shown, item: Item) -> str:
    """A name that says nothing to a viewer and follows from all that a stimulus depends on."""
    design = studio.design
    depends: dict[str, Any] = {
        "shown": {**vars(shown), "name": "", "run": Path(shown.run).name}, "dials": dict(condition.dials),
        "smooth": condition.smooth, "item": item.id, "digest": item.utterance.digest,
        "sound": sound_of(design, condition), "engine": design.engine, "noise": design.noise,
        "scale": design.scale, "quality": design.quality, "seed": design.seed, "version": __version__,
        "corpus": studio.corpus.fingerprint}
    return hashlib.sha256(files.json_text(depends, sort_keys=True).encode()).hexdigest()[:16]


def make_clip(studio: Studio, condition: Condition, item: Item) -> Clip:
    """What a condition shows of an item.

    Raises:
        DnnvssError: a run that cannot speak it, or a recording that is missing.
    """
    clock = item.utterance.clock
    if sound_of(studio.design, condition) == "engine":
        voice = _voiced(studio, item)
        alignment, heard = voice.plan.alignment, voice.plan.sound
        assert heard is not None
        samples, rate = heard.samples, heard.rate
    else:
        alignment, samples, rate = item.utterance.alignment, _recorded_sound(studio, item), SOUND_RATE
    start, end = item.span(alignment)
    first, last = clock.edge(start), max(clock.edge(end), clock.edge(start) + 1)
    pictures = _pictures(studio, condition, item, slice(first, last))
    sound = cut(samples, rate, first / float(clock.rate), (last - first) / float(clock.rate), item.word is not None)
    return Clip(pictures, last - first, clock, _heard(studio, condition, item, sound, rate))


def write_clip(clip: Clip, path: Path, quality: int) -> Path:
    """Write a stimulus as H.264 with AAC and return its path."""
    return write_video(path, clip.pictures, clip.clock.rate, clip.sound, SOUND_RATE, quality)


def _heard(studio: Studio, condition: Condition, item: Item, sound: np.ndarray, rate: int) -> np.ndarray | None:
    """What is heard of a sound that was cut, at :data:`SOUND_RATE`."""
    design = studio.design
    if sound_of(design, condition) == "silent":
        return None
    if rate != SOUND_RATE:
        count = round(len(sound) * SOUND_RATE / rate)
        sound = np.interp(np.arange(count) / SOUND_RATE, np.arange(len(sound)) / rate, sound).astype(np.float32)
    if design.noise is None:
        return sound
    own = int.from_bytes(hashlib.sha256(item.id.encode()).digest()[:4], "big")
    return in_noise(sound, SOUND_RATE, design.noise, (design.seed, own))


def _recorded_sound(studio: Studio, item: Item) -> np.ndarray:
    silent = studio.design.sound == "silent" and not item.utterance.audio
    return np.zeros(0, np.float32) if silent else read_audio(studio.corpus.path(item.utterance, "audio"), SOUND_RATE)


def _voiced(studio: Studio, item: Item) -> Spoken:
    """An utterance said by an engine, at the times of the first run, which all others follow."""
    if item.utterance.id not in studio._spoken:
        studio._spoken[item.utterance.id] = speak(studio.runs[0], SpeakRequest(
            item.utterance.text, engine=studio.design.engine, id=item.utterance.id))
    return studio._spoken[item.utterance.id]


def _pictures(studio: Studio, condition: Condition, item: Item, frames: slice) -> Iterator[np.ndarray]:
    """The pictures (F, H, W_, 3) of a span of frames, the last one held where there are too few."""
    run = studio.runs[condition.run - 1]
    if condition.shows == "recording":
        if not isinstance(run.face, Textured):
            raise DnnvssError("a face without pictures is not compared with a recording",
                              remedy="Leave the recording out, or take through, what was measured in it")
        whole = list(recorded(studio.corpus, item.utterance, studio.drawn[condition.run - 1].size))
        return iter([whole[min(k, len(whole) - 1)] for k in range(frames.start, frames.stop)])
    moved = _movement(studio, condition, item)
    if condition.smooth is not None:
        moved = smoothing_spline(moved, item.utterance.clock, condition.smooth)
    rows = np.minimum(np.arange(frames.start, frames.stop), len(moved) - 1)
    return studio.drawn[condition.run - 1].frames(moved[rows])


def _movement(studio: Studio, condition: Condition, item: Item) -> np.ndarray:
    """Parameters (F, D) of the whole utterance at the rate of the video."""
    run, data, clock = studio.runs[condition.run - 1], studio.data[condition.run - 1], item.utterance.clock
    reference = data.arrays["reference"]
    if condition.shows == "run":
        spoken = _says(studio, condition, item)
        return resample(spoken.trajectory, spoken.clock, clock)
    if condition.shows == "frozen":
        return np.zeros((1, len(run.face.names)))
    if condition.shows == "through":
        return resample(reference[item.utterance.id], run.task.clock, clock)
    other = _other(studio, item)
    moved = stretched(_sentence(studio, data, other), _sentence(studio, data, item.utterance.id))
    return resample(moved, run.task.clock, clock)


def _other(studio: Studio, item: Item) -> str:
    """The id of another sentence of the test split, the same whenever it is asked for."""
    others = sorted(set(studio.tested) - {item.utterance.id})
    if not others:
        raise DnnvssError("the movement of another sentence needs two test sentences", remedy="Leave random out")
    own = int.from_bytes(hashlib.sha256(item.utterance.id.encode()).digest()[:4], "big")
    return others[int(np.random.default_rng([studio.design.seed, own, 4]).integers(len(others)))]


def _sentence(studio: Studio, data: RunData, name: str) -> Sentence:
    arrays: Mapping[str, np.ndarray] = {kind: data.arrays[kind][name] for kind in ("reference", "speech", "valid")}
    return Sentence(name, arrays["reference"].astype(float), studio.corpus.utterances[name].alignment["phones"],
                    arrays["speech"].astype(bool), arrays["valid"].astype(bool))


def _says(studio: Studio, condition: Condition, item: Item) -> Spoken:
    """An utterance as the run of a condition says it, to the sound of the recording or of an engine."""
    run, utterance = studio.runs[condition.run - 1], item.utterance
    style = _style(run, condition)
    if sound_of(studio.design, condition) == "engine":
        plan = _voiced(studio, item).plan
        return speak(run, SpeakRequest(plan.text, plan.sound, plan.alignment, engine="none", style=style,
                                       id=utterance.id))
    recording = None
    if utterance.audio:
        recording = Recording(read_audio(studio.corpus.path(utterance, "audio"), SOUND_RATE), SOUND_RATE,
                              studio.corpus.sound(utterance).samples)
    return speak(run, SpeakRequest(utterance.text, recording, utterance.alignment, engine="none", style=style,
                                   id=utterance.id))


def _style(run: Run, condition: Condition) -> Style:
    """The style of a condition: plain or the run's own, with its own dials."""
    if condition.style == "plain" and not condition.dials:
        return PLAIN
    settings = run.settings.style if condition.style == "own" else StyleSettings(name="plain")
    changed = read_settings(StyleSettings, {**vars(settings), **condition.dials}, f"conditions.{condition.name}.dials")
    return make_style(changed, run.face)
