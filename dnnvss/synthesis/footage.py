"""Reads what a face is drawn into: an utterance of the run's corpus, or a video and its landmarks."""

from fractions import Fraction
from pathlib import Path

import numpy as np

from dnnvss.corpus import Corpus, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Face
from dnnvss.face.landmarker import Landmarker, as_arrays, find_task, follow, mesh_groups, talker
from dnnvss.formats import Landmarks, read_marks, read_npz
from dnnvss.media import read_video, timed_frames, video_info
from dnnvss.progress import counted
from dnnvss.render import Footage
from dnnvss.render.filmed import Filmed, encode_footage
from dnnvss.render.footage import talker_model
from dnnvss.runs.run import Run
from dnnvss.timing.rates import even_frames, rate_of, rising

_LANDMARKS = ("Save points (frames, points, 2) there, in pixels, of the same kind as the corpus's; where those come "
              "from `dnnvss track LABELS VIDEOS`, that command writes it")


def footage_files(into: str) -> list[Path]:
    """The files that ``into`` names; none where it is an utterance of the corpus."""
    path = Path(into)
    return [path, path.with_suffix(".npz")] if path.is_file() else []


def read_footage(run: Run, into: str) -> Footage:
    """Return an utterance of the run's corpus, or a video file with its landmarks (``.npz``) beside it, as footage.

    Where ``landmarks.json`` lies beside the video, the landmarks are divided by its ``scale``. Where the run's face is
    of points that nets find, and none lie beside the video, they are found in its pictures.

    Raises:
        DnnvssError: a face without texture; there is no such utterance or video, or its landmarks are missing, of
            another kind or of another picture, or no frame of them is usable.
    """
    model = talker_model(run.face)  # what cannot be drawn is said before anything is read
    path = Path(into)
    if path.is_file():
        beside = path.with_suffix(".npz")
        task = None if beside.is_file() else _nets(beside, dict(model.landmark_groups) == mesh_groups())
        info, frames = video_info(path), list(timed_frames(path))
        landmarks = _beside(path) if task is None else _found(path, task, [image for _, image in frames])
        points, valid, pixel = landmarks.points.astype(float), landmarks.valid, info.pixel
        _check_count(len(frames), len(points), path)
        times = rising([time for time, _ in frames], info.told[0] if info.told else info.rate)
        rate = rate_of(times, info.told)
        index, taken = even_frames(times, rate)
        images, points, valid = np.stack([frames[k][1] for k in index]), points[index], valid[index] & taken
    else:
        corpus = Corpus.open(run.settings.corpus_folder)
        if into not in corpus.utterances:
            raise DnnvssError(f"into: no utterance and no video file is named {into!r}",
                              remedy=f"Give an id of {corpus.root} or the path of a video")
        return recorded_footage(run.face, corpus, corpus.utterances[into])
    return encode_footage(run.face, Filmed(images, points, valid, rate, str(path), pixel),
                          {"file": beside if task is None else path})


def recorded_footage(face: Face, corpus: Corpus, utterance: Utterance) -> Footage:
    """The recording of an utterance as footage.

    Raises:
        DnnvssError: a face without texture, or no frame of the recording is usable.
    """
    points, valid = corpus.landmarks(utterance)
    images = read_video(corpus.path(utterance, "video"))
    _check_count(len(images), len(points), utterance.id)
    return encode_footage(face, Filmed(images, points, valid, utterance.rate, utterance.id, Fraction(1)),
                          {"utterance": utterance.id})


def _beside(path: Path) -> Landmarks:
    """The landmarks beside a video."""
    described = path.parent / "landmarks.json"
    return read_npz(path.with_suffix(".npz"), read_marks(described)[1] if described.is_file() else 1.0)


def _nets(beside: Path, found: bool) -> Path:
    """The file of the nets that find landmarks where none lie beside a video, and the face is of points ``found``."""
    if not found:
        raise DnnvssError("no such file, and the footage has to have its landmarks there", file=beside,
                          remedy=_LANDMARKS)
    try:
        return find_task()
    except DnnvssError as error:
        raise DnnvssError(f"no such file, and {error.problem}", file=beside, remedy=error.remedy) from error


def _found(path: Path, task: Path, images: list[np.ndarray]) -> Landmarks:
    """The landmarks of a video's pictures: of several faces, that which is there longest."""
    tracks, frames = follow(Landmarker(task), counted(images, "points", unit="pictures"))
    if not tracks:
        raise DnnvssError("shows no face", file=path, remedy="Choose footage of a face seen from the front")
    chosen, note = talker(tracks, frames, None)
    if note:
        print(f"{path}: {note}")
    return Landmarks(*as_arrays(tracks[chosen], frames))


def _check_count(pictures: int, rows: int, source: str | Path) -> None:
    if pictures != rows:
        raise DnnvssError(f"has {pictures} pictures and {rows} frames of landmarks", file=source,
                          remedy="Track the video again")
