"""What synthesis draws: the face in its neutral frame or in footage, and the views that are put side by side."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from omegaconf import DictConfig

from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.formats import read_marks, read_npz
from dnnvss.media import read_video, video_info
from dnnvss.render import Footage, revoicer, walk
from dnnvss.render.filmed import Filmed, encode_footage
from dnnvss.render.pictures import Pictures
from dnnvss.runs.run import Run
from dnnvss.timing import FrameClock

VIEWS = ("face", "patch", "mesh", "reference")


@dataclass(frozen=True)
class Stage:
    """Where a run's parameters are drawn.

    Args:
        run: the run.
        pictures: what draws the face.
        clock: frames a second of the video.
        views: what is shown, of :data:`VIEWS`, from left to right.
        notes: what the report of a synthesis says about it.
    """

    run: Run
    pictures: Pictures
    clock: FrameClock
    views: tuple[str, ...] = ("face",)
    notes: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if unknown := [view for view in self.views if view not in self.pictures.views]:
            raise DnnvssError(f"render: this kind of face has no view {unknown[0]!r}",
                              remedy=f"Use some of {', '.join(self.pictures.views)}, joined by +")

    def frames(self, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """Yield a picture, uint8 RGB (H, W_, 3), for each row of parameters (T, D) at the video's rate."""
        from dnnvss.render.side_by_side import side_by_side

        shown = [self.pictures.view(view, parameters) for view in self.views]
        return shown[0] if len(shown) == 1 else side_by_side(*shown, captions=list(self.views))


def neutral_stage(run: Run, clock: FrameClock, scale: float = 1.0, views: tuple[str, ...] = ("face",)) -> Stage:
    """Return the run's neutral frame as the place to draw in."""
    return Stage(run, run.pictures(scale), clock, views)


@dataclass(frozen=True)
class Request:
    """What a user wants to see: views of :data:`VIEWS`, and the footage to draw into, or None."""

    views: tuple[str, ...]
    footage: Footage | None


def read_request(config: DictConfig, run: Run) -> Request:
    """Return what the keys ``render`` and ``into`` of ``conf/synth.yaml`` ask for.

    Raises:
        DnnvssError: an unknown view, or footage that is missing, has no landmarks or too few of them.
    """
    views = tuple(str(config.render).split("+"))
    if unknown := [view for view in views if view not in VIEWS]:
        raise DnnvssError(f"render: there is no view {unknown[0]!r}",
                          remedy=f"Use some of {', '.join(VIEWS)}, joined by +")
    if config.into is None:
        if "reference" in views:
            raise DnnvssError("render=reference needs footage", remedy="Say which with into=")
        return Request(views, None)
    footage = read_footage(run, str(config.into))
    footage.usable()
    return Request(views, footage)


def open_stage(config: DictConfig, run: Run, request: Request, rate: str, seconds: float) -> Stage:
    """Return where ``config`` (keys ``into``, ``into_fill``, ``rate``, ``scale``) wants the face drawn.

    Args:
        config: the settings of ``conf/synth.yaml``.
        run: the run.
        request: what :func:`read_request` returned.
        rate: frames a second of the talker's corpus.
        seconds: how long the speech lasts.

    Raises:
        DnnvssError: ``into_fill`` is unknown.
    """
    views, whole = request.views, request.footage
    if whole is None:
        return neutral_stage(run, FrameClock(rate if config.rate is None else config.rate), config.scale, views)
    footage, first = whole.usable()
    clock = FrameClock(footage.rate if config.rate is None else config.rate)
    own = FrameClock(footage.rate)
    order = walk(footage.code.pose, max(1, int(np.ceil(seconds * float(own.rate)))), config.into_fill)
    at = (clock.centres(max(1, clock.edge(seconds))) * float(own.rate)).astype(int)
    shown = order[np.minimum(at, len(order) - 1)]
    notes = {"into": str(config.into), "footage_frames": [first, first + len(footage)], "of": len(whole)}
    if len(footage) < len(whole):
        print(f"footage: frames {first} to {first + len(footage) - 1} of {len(whole)}; others have no usable landmarks")
    if len(order) > len(footage):
        print(f"footage: {len(footage) / float(own.rate):.1f} s for {seconds:.1f} s of speech: "
              f"{'played back and forth' if config.into_fill == 'pingpong' else 'its last frame is held'}")
    return Stage(run, revoicer(run.face, footage, shown, config.scale), clock, views, notes)


def read_footage(run: Run, into: str) -> Footage:
    """Return an utterance of the run's corpus, or a video file with its landmarks (``.npz``) beside it, as footage.

    Where ``landmarks.json`` lies beside the video, the landmarks are divided by its ``scale``.

    Raises:
        DnnvssError: there is no such utterance or video, or its landmarks are missing, of another kind or of another
            picture, or no frame of them is usable.
    """
    path = Path(into)
    if path.is_file():
        marks: Path | None = path.with_suffix(".npz")
        described = path.parent / "landmarks.json"
        scale = read_marks(described)[1] if described.is_file() else 1.0
        landmarks, rate = read_npz(path.with_suffix(".npz"), scale), video_info(path).rate
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
