"""What synthesis draws: the face in its neutral frame or in footage, and the views that are put side by side."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from omegaconf import DictConfig

from dnnvss.corpus import Corpus, checkup
from dnnvss.errors import DnnvssError
from dnnvss.face.aam import ActiveAppearanceModel, encode_clip
from dnnvss.face.clips import UnusableClipError
from dnnvss.formats import read_marks, read_npz
from dnnvss.media import read_video, video_info
from dnnvss.render import Footage, Renderer, Revoicer, walk
from dnnvss.render.views import mesh_frames, patch_frames
from dnnvss.runs.run import Run
from dnnvss.timing import FrameClock

VIEWS = ("face", "patch", "mesh", "reference")
_OUTSIDE = 0.25
"""Share of the model's points outside the picture from which on a frame's landmarks are not this picture's."""


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
    pictures: Renderer | Revoicer
    clock: FrameClock
    views: tuple[str, ...] = ("face",)
    notes: dict[str, Any] = field(default_factory=dict)

    def frames(self, parameters: np.ndarray) -> Iterator[np.ndarray]:
        """Yield a picture, uint8 RGB (H, W_, 3), for each row of parameters (T, D) at the video's rate."""
        from dnnvss.render.side_by_side import side_by_side

        shown = [self._view(view, parameters) for view in self.views]
        return shown[0] if len(shown) == 1 else side_by_side(*shown, captions=list(self.views))

    def _view(self, view: str, parameters: np.ndarray) -> Iterator[np.ndarray]:
        pictures, face = self.pictures, self.run.face
        if view == "reference" and isinstance(pictures, Revoicer):
            return pictures.recorded(len(parameters))
        if view == "mesh":
            return mesh_frames(face, pictures, parameters)
        return patch_frames(face, pictures, parameters) if view == "patch" else pictures.frames(parameters)


def neutral_stage(run: Run, clock: FrameClock, scale: float = 1.0, views: tuple[str, ...] = ("face",)) -> Stage:
    """Return the run's neutral frame as the place to draw in."""
    return Stage(run, Renderer(run.face, run.picture, scale), clock, views)


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
    return Stage(run, Revoicer(run.face, footage, shown, config.scale), clock, views, notes)


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
    _check(run.face, images, points, valid, where)
    try:
        code = encode_clip(run.face, images, points, valid, float(rate), str(source))
    except UnusableClipError as error:
        raise DnnvssError(error.problem, **where, remedy="Choose other footage, or track the video again") from error
    return Footage(images, code, rate, str(source))


def _check(face: ActiveAppearanceModel, images: np.ndarray, points: np.ndarray, valid: np.ndarray,
           where: dict[str, Any]) -> None:
    """Refuse landmarks (F, L, 2) too few for the face, or outside the pictures (F, H, W_, 3) in most frames."""
    if points.shape[1] < face.layout.needed:
        raise DnnvssError(f"has {points.shape[1]} landmarks a frame, and the run's face needs {face.layout.needed}",
                          **where, remedy="Track the video with the labels of the run's corpus")
    points = points[valid][:, face.layout.rows]
    points = points[np.isfinite(points).all(axis=(1, 2))]
    width, height = images.shape[2], images.shape[1]
    outside = checkup.outside(points, (width, height), replace(checkup.LIMITS, outside=_OUTSIDE))
    if len(points) and outside.mean() > 0.5:
        (left, top), (right, bottom) = np.median(points.min(axis=1), axis=0), np.median(points.max(axis=1), axis=0)
        scale = "write what they are to be divided by as scale in landmarks.json beside it"
        raise DnnvssError(f"its landmarks reach from ({left:.0f}, {top:.0f}) to ({right:.0f}, {bottom:.0f}), and the "
                          f"pictures have {width} x {height} pixels", **where,
                          remedy=f"Track this very video, or {scale}" if "file" in where else
                          "Prepare the corpus again with the scale of its landmarks")
