"""Side-by-side videos of test sentences: the recording, what was measured in it as the face shows that, and the face
from plain MLPG and in the run's style."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np

from dnnvss.archives import read_arrays
from dnnvss.corpus import Corpus, Utterance
from dnnvss.curves import resample
from dnnvss.evaluation import Report
from dnnvss.face.base import Textured
from dnnvss.media import SOUND_RATE, read_audio, read_video, write_video
from dnnvss.render.side_by_side import side_by_side
from dnnvss.runs.run import Run
from dnnvss.style import Style
from dnnvss.style.generator import PLAIN, make_style
from dnnvss.synthesis.outputs import write_spoken
from dnnvss.synthesis.request import Recording, Scene, SpeakRequest
from dnnvss.synthesis.speak import Spoken, speak

RECORDED, THROUGH = "recorded", "through the face"
_PALE = 0.3
"""Share of its contrast that a picture keeps in frames that were not measured."""
_COLUMNS = 4
"""Faces a row at most."""


def worst_middle_best(report: Report, among: Sequence[str], system: str = "model") -> list[str]:
    """The ids of those of some sentences of least, median and greatest correlation, fewer where there are fewer."""
    values = report.sentences(system, "correlation")
    ids = list(report.scores[system])
    order = [int(i) for i in np.argsort(values) if ids[i] in among and not np.isnan(values[i])]
    order = order or [ids.index(among[0])]
    return [ids[i] for i in dict.fromkeys((order[0], order[len(order) // 2], order[-1]))]


def say(run: Run, corpus: Corpus, utterance: Utterance, style: Style) -> Spoken:
    """An utterance of the corpus as a run says it at the recording's phone times, with the recorded sound."""
    sound = _sound(corpus, utterance)
    recording = None if sound is None else Recording(sound, SOUND_RATE, corpus.sound(utterance).samples)
    return speak(run, SpeakRequest(utterance.text, recording, utterance.alignment, engine="none", style=style,
                                   scene=Scene(rate=utterance.clock), id=utterance.id))


def write_samples(run: Run, corpus: Corpus, ids: Sequence[str], report: Report) -> list[Path]:
    """Write what a run is looked at by: a sentence in its style, and others beside their recordings.

    Args:
        run: the run.
        corpus: that it was trained on.
        ids: of the sentences that the run has not learnt from. The first is written with everything beside it.
        report: of the evaluation; of these sentences its worst, middle and best, and the first, are shown beside
            their recordings.
    """
    spoken = say(run, corpus, corpus.utterances[ids[0]], make_style(run.settings.style, run.face))
    write_spoken(spoken, run.files.sample, {"utterance": ids[0]})
    shown = dict.fromkeys([ids[0], *worst_middle_best(report, ids)])
    return [run.files.sample, *write_side_by_side(run, corpus, list(shown))]


def write_side_by_side(run: Run, corpus: Corpus, ids: Sequence[str]) -> list[Path]:
    """Write ``videos/<sentence>.mp4`` in the run folder, with the recorded sound, and return the paths."""
    style = make_style(run.settings.style, run.face)
    styles = {"plain MLPG": PLAIN} if style.plain else {"plain MLPG": PLAIN, run.settings.style.name: style}
    written = []
    for utterance in (corpus.utterances[i] for i in ids):
        faces = [say(run, corpus, utterance, s) for s in styles.values()]
        caption, truth = _truth(faces[0], corpus, utterance)
        seen, names = [truth], [caption]
        if caption == RECORDED:
            seen, names = [truth, _paled(*through_the_face(faces[0], utterance))], [caption, THROUGH]
        frames = side_by_side(*seen, *(face.frames() for face in faces), captions=[*names, *styles])
        written.append(_written(run.files.video(utterance.id), frames, corpus, utterance))
    return written


def write_systems(runs: Mapping[str, Run], corpus: Corpus, sentence: str, out: Path) -> Path:
    """Write one sentence as recorded and by the system of each run, and return the path.

    The faces alone are shown, in rows, each under its name.
    """
    utterance = corpus.utterances[sentence]
    faces = [say(run, corpus, utterance, PLAIN) for run in runs.values()]
    caption, truth = _truth(faces[-1], corpus, utterance)
    captions, size = [caption, *runs], faces[-1].stage.pictures.size
    box = _face_box(corpus, utterance, size) if caption == RECORDED else (slice(None), slice(None))
    cut = ((picture[box] for picture in pictures) for pictures in (truth, *(face.frames() for face in faces)))
    frames = side_by_side(*cut, captions=captions, columns=min(_COLUMNS, -(-len(captions) // 2)))
    return _written(out, frames, corpus, utterance)


def _written(path: Path, frames: Iterator[np.ndarray], corpus: Corpus, utterance: Utterance) -> Path:
    return write_video(path, frames, utterance.clock.rate, _sound(corpus, utterance), SOUND_RATE)


def _sound(corpus: Corpus, utterance: Utterance) -> np.ndarray | None:
    return read_audio(corpus.path(utterance, "audio"), SOUND_RATE) if utterance.audio else None


def _face_box(corpus: Corpus, utterance: Utterance, size: tuple[int, int]) -> tuple[slice, slice]:
    """Return rows and columns of a picture of (width, height) that hold the face with some room, even in number."""
    points, valid = corpus.landmarks(utterance)
    low, high = points[valid].min((0, 1)), points[valid].max((0, 1))
    room = 0.2 * (high - low)
    x0, y0 = np.maximum(low - room, 0).astype(int)
    x1, y1 = np.minimum(high + room, size).astype(int)
    return slice(y0, y1 - (y1 - y0) % 2), slice(x0, x1 - (x1 - x0) % 2)


def _truth(spoken: Spoken, corpus: Corpus, utterance: Utterance) -> tuple[str, Iterator[np.ndarray]]:
    """What predictions are shown beside: the recording, or what was measured in it where the face has no texture."""
    run, pictures = spoken.run, spoken.stage.pictures
    if isinstance(run.face, Textured):
        return RECORDED, recorded(corpus, utterance, pictures.size)
    measured = _kept(run, "reference", utterance)
    return "measured", pictures.frames(resample(measured, spoken.clock, utterance.clock))


def through_the_face(spoken: Spoken, utterance: Utterance) -> tuple[Iterator[np.ndarray], np.ndarray]:
    """The measured parameters of a test sentence as the face shows them, which is what systems learn.

    Args:
        spoken: the sentence by a run.
        utterance: of the corpus.

    Returns:
        Pictures at the recording's rate, and which of them (F,) were measured.
    """
    run, clock = spoken.run, spoken.clock
    measured, valid = (_kept(run, kind, utterance) for kind in ("reference", "valid"))
    shown = resample(measured, clock, utterance.clock)
    nearest = np.minimum((utterance.clock.centres(len(shown)) * float(clock.rate)).astype(int), len(valid) - 1)
    return spoken.stage.pictures.frames(shown), valid.astype(bool)[nearest]


def _kept(run: Run, kind: str, utterance: Utterance) -> np.ndarray:
    """What a run keeps of a test sentence; those of the others are not read."""
    return read_arrays(run.files.prediction(kind), names={utterance.id})[utterance.id]


def _paled(pictures: Iterator[np.ndarray], known: np.ndarray) -> Iterator[np.ndarray]:
    """Pictures, pale where nothing was measured."""
    for picture, measured in zip(pictures, known, strict=True):
        yield picture if measured else (255 - _PALE * (255.0 - picture)).astype(np.uint8)


def recorded(corpus: Corpus, utterance: Utterance, size: tuple[int, int]) -> Iterator[np.ndarray]:
    """Yield the pictures of a recording, brought to a width and height in pixels."""
    for image in read_video(corpus.path(utterance, "video")):
        same = image.shape[1::-1] == size
        yield image if same else cv2.resize(image, size, interpolation=cv2.INTER_AREA)


