"""Side-by-side videos of test sentences: the recording, the face from plain MLPG, and the face in the run's style."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import cv2
import numpy as np

from dnnvss import files
from dnnvss.corpus import Corpus, Utterance
from dnnvss.curves import resample
from dnnvss.evaluation import Report
from dnnvss.face.base import Textured
from dnnvss.media import SOUND_RATE, read_audio, read_video, write_video
from dnnvss.render.pictures import Pictures
from dnnvss.render.side_by_side import side_by_side
from dnnvss.runs.run import Run
from dnnvss.style.generator import PLAIN, make_style

RECORDED = "recorded"
_COLUMNS = 4
"""Faces a row at most."""


def worst_middle_best(report: Report, system: str = "model") -> list[str]:
    """Return the ids of the sentences of least, median and greatest correlation, fewer where there are fewer."""
    values = report.sentences(system, "correlation")
    ids = list(report.scores[system])
    order = [int(i) for i in np.argsort(values) if not np.isnan(values[i])] or [0]
    return [ids[i] for i in dict.fromkeys((order[0], order[len(order) // 2], order[-1]))]


def write_side_by_side(run: Run, corpus: Corpus, ids: list[str]) -> list[Path]:
    """Write ``videos/<sentence>.mp4`` in the run folder, with the recorded sound, and return the paths."""
    style = make_style(run.settings.style, run.face)
    pictures = run.pictures()
    styles = {"plain MLPG": PLAIN} if style.plain else {"plain MLPG": PLAIN, run.settings.style_name: style}
    written = []
    for utterance in (corpus.utterances[i] for i in ids):
        example, clock = run.recorded(corpus, utterance), run.task.clock
        faces = [pictures.frames(resample(run.generator(example, s), clock, utterance.clock)) for s in styles.values()]
        sound = read_audio(corpus.path(utterance, "audio"), SOUND_RATE) if utterance.audio else None
        caption, truth = _truth(run, pictures, corpus, utterance)
        frames = side_by_side(truth, *faces, captions=[caption, *styles])
        path = run.files.video(utterance.id)
        written.append(write_video(path, frames, utterance.clock.rate, sound, SOUND_RATE))
    return written


def write_systems(runs: Mapping[str, Run], corpus: Corpus, sentence: str, out: Path) -> Path:
    """Write one sentence as recorded and by the system of each run, and return the path.

    The faces alone are shown, in rows, each under its name.
    """
    utterance = corpus.utterances[sentence]
    drawn = {name: run.pictures() for name, run in runs.items()}
    faces = []
    for name, run in runs.items():
        trajectory = run.generator(run.recorded(corpus, utterance), PLAIN)
        faces.append(drawn[name].frames(resample(trajectory, run.task.clock, utterance.clock)))
    last = list(runs)[-1]
    caption, truth = _truth(runs[last], drawn[last], corpus, utterance)
    captions = [caption, *runs]
    sound = read_audio(corpus.path(utterance, "audio"), SOUND_RATE) if utterance.audio else None
    box = _face_box(corpus, utterance, drawn[last].size) if caption == RECORDED else (slice(None), slice(None))
    cut = ((picture[box] for picture in face) for face in (truth, *faces))
    frames = side_by_side(*cut, captions=captions, columns=min(_COLUMNS, -(-len(captions) // 2)))
    return write_video(out, frames, utterance.clock.rate, sound, SOUND_RATE)


def _face_box(corpus: Corpus, utterance: Utterance, size: tuple[int, int]) -> tuple[slice, slice]:
    """Return rows and columns of a picture of (width, height) that hold the face with some room, even in number."""
    points, valid = corpus.landmarks(utterance)
    low, high = points[valid].min((0, 1)), points[valid].max((0, 1))
    room = 0.2 * (high - low)
    x0, y0 = np.maximum(low - room, 0).astype(int)
    x1, y1 = np.minimum(high + room, size).astype(int)
    return slice(y0, y1 - (y1 - y0) % 2), slice(x0, x1 - (x1 - x0) % 2)


def _truth(run: Run, pictures: Pictures, corpus: Corpus, utterance: Utterance) -> tuple[str, Iterator[np.ndarray]]:
    """What predictions are shown beside: the recording, or what was measured in it where the face has no texture."""
    if isinstance(run.face, Textured):
        return RECORDED, _recorded(corpus, utterance, pictures.size)
    measured = files.read_arrays(run.files.prediction("reference"))[utterance.id]
    return "measured", pictures.frames(resample(measured, run.task.clock, utterance.clock))


def _recorded(corpus: Corpus, utterance: Utterance, size: tuple[int, int]) -> Iterator[np.ndarray]:
    for image in read_video(corpus.path(utterance, "video")):
        same = image.shape[1::-1] == size
        yield image if same else cv2.resize(image, size, interpolation=cv2.INTER_AREA)


