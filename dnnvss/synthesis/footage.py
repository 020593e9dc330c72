"""Reads what a face is drawn into: an utterance of the run's corpus, or a video with its landmarks beside it."""

from pathlib import Path
from typing import Any

from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.formats import read_marks, read_npz
from dnnvss.media import read_video, video_info
from dnnvss.render import Footage
from dnnvss.render.filmed import Filmed, encode_footage
from dnnvss.render.footage import talker_model
from dnnvss.runs.run import Run

_LANDMARKS = ("Save points (frames, points, 2) there, in pixels, of the same kind as the corpus's; where those come "
              "from `dnnvss track LABELS VIDEOS`, that command writes it")


def footage_files(into: str) -> list[Path]:
    """The files that ``into`` names; none where it is an utterance of the corpus."""
    path = Path(into)
    return [path, path.with_suffix(".npz")] if path.is_file() else []


def read_footage(run: Run, into: str) -> Footage:
    """Return an utterance of the run's corpus, or a video file with its landmarks (``.npz``) beside it, as footage.

    Where ``landmarks.json`` lies beside the video, the landmarks are divided by its ``scale``.

    Raises:
        DnnvssError: a face without texture; there is no such utterance or video, or its landmarks are missing, of
            another kind or of another picture, or no frame of them is usable.
    """
    talker_model(run.face)  # what cannot be drawn is said before anything is read
    path = Path(into)
    if path.is_file():
        beside = path.with_suffix(".npz")
        if not beside.is_file():
            raise DnnvssError("no such file, and the footage has to have its landmarks there", file=beside,
                              remedy=_LANDMARKS)
        marks: Path | None = beside
        described = path.parent / "landmarks.json"
        scale = read_marks(described)[1] if described.is_file() else 1.0
        landmarks, rate = read_npz(beside, scale), video_info(path).rate
        images, points, valid = read_video(path), landmarks.points.astype(float), landmarks.valid
        source: str | Path = path
    else:
        corpus = Corpus.open(run.settings.corpus_folder)
        if into not in corpus.utterances:
            raise DnnvssError(f"into: no utterance and no video file is named {into!r}",
                              remedy=f"Give an id of {corpus.root} or the path of a video with its landmarks beside it")
        utterance = corpus.utterances[into]
        points, valid = corpus.landmarks(utterance)
        images, rate, source, marks = read_video(corpus.path(utterance, "video")), utterance.rate, into, None
    if len(points) != len(images):
        raise DnnvssError(f"has {len(images)} pictures and {len(points)} frames of landmarks", file=source,
                          remedy="Track the video again")
    where: dict[str, Any] = {"utterance": into} if marks is None else {"file": marks}
    return encode_footage(run.face, Filmed(images, points, valid, rate, str(source)), where)
