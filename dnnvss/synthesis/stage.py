"""Where a synthesis is drawn: the run's own picture or footage, and the views that are put side by side."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.life import Moves
from dnnvss.render import Footage, revoicer, walk
from dnnvss.render.living import LivingPicture
from dnnvss.render.pictures import Pictures
from dnnvss.render.renderer import Renderer
from dnnvss.runs.run import Run
from dnnvss.synthesis.head import HEAD_VIEW, can_show_head, head_pictures
from dnnvss.synthesis.request import Scene
from dnnvss.timing import FrameClock, Tier


@dataclass(frozen=True)
class Stage:
    """Where a run's parameters are drawn.

    Args:
        run: the run.
        pictures: what draws the face.
        clock: frames a second of the video.
        views: what is shown, from left to right.
        notes: what the report of a synthesis says about it.
        remarks: what the user is told about it.
        pixel: width of a pixel of the pictures over its height.
        phones: what the face says, where it is known; the tongue of the head follows them.
        living: what draws eyes and head that move, where the face is drawn into the run's own picture.
    """

    run: Run
    pictures: Pictures
    clock: FrameClock
    views: tuple[str, ...] = ("face",)
    notes: dict[str, Any] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()
    pixel: Fraction = Fraction(1)
    phones: Tier | None = None
    living: LivingPicture | None = None

    def __post_init__(self) -> None:
        known = (*self.pictures.views, *((HEAD_VIEW,) if can_show_head(self.run) else ()))
        if unknown := [view for view in self.views if view not in known]:
            raise DnnvssError(f"render: this kind of face has no view {unknown[0]!r}",
                              remedy=f"Use some of {', '.join(known)}, joined by +")

    def frames(self, parameters: np.ndarray, moves: Moves | None = None) -> Iterator[np.ndarray]:
        """Yield a picture, uint8 RGB (H, W_, 3), for each row of parameters (T, D) at the video's rate.

        Args:
            parameters: of the face.
            moves: of eyes and head, a row each, which the view ``face`` shows; none where None.
        """
        from dnnvss.render.side_by_side import side_by_side

        shown = [self._view(view, parameters, moves) for view in self.views]
        return shown[0] if len(shown) == 1 else side_by_side(*shown, captions=list(self.views))

    def _view(self, name: str, parameters: np.ndarray, moves: Moves | None) -> Iterator[np.ndarray]:
        if name == HEAD_VIEW:
            from dnnvss.face.mesh.tongue import tongue_curves

            tongue = tongue_curves(self.phones, self.clock, len(parameters)) if self.phones else {}
            return head_pictures(self.run, parameters, self.pictures.size[1], tongue)
        pictures = self.pictures.view(name, parameters)
        if name != "face" or not self.living or not moves:
            return pictures
        return self.living.over(pictures, moves, self.pictures.moving if isinstance(self.pictures, Renderer) else None)


def open_stage(run: Run, scene: Scene, seconds: float, life: bool = False) -> Stage:
    """Where a scene wants the face drawn.

    Args:
        run: the run.
        scene: what is asked for.
        seconds: how long the speech lasts.
        life: whether eyes and head move, where the run knows how.

    Raises:
        DnnvssError: the scale is not positive, or the footage was encoded with another face.
    """
    if scene.footage is None:
        living = run.living(scene.scale) if life else None
        return Stage(run, run.pictures(scene.scale), scene_clock(run, scene), scene.views, living=living)
    return _in_footage(run, scene, scene.footage, seconds)


def scene_clock(run: Run, scene: Scene) -> FrameClock:
    """Frames a second of the video: those asked for, else those of the footage or of the talker's corpus."""
    return scene.rate or FrameClock(run.voice.rate if scene.footage is None else scene.footage.rate)


def _in_footage(run: Run, scene: Scene, whole: Footage, seconds: float) -> Stage:
    footage, first = whole.usable()
    own = FrameClock(footage.rate)
    clock = scene_clock(run, scene)
    order = walk(footage.code.pose, max(1, int(np.ceil(seconds * float(own.rate)))), scene.fill)
    at = (clock.centres(max(1, clock.edge(seconds))) * float(own.rate)).astype(int)
    shown = order[np.minimum(at, len(order) - 1)]
    notes = {"into": whole.source, "footage_frames": [first, first + len(footage)], "of": len(whole)}
    remarks = []
    if len(footage) < len(whole):
        remarks.append(f"footage: frames {first} to {first + len(footage) - 1} of {len(whole)}; "
                       "others have no usable landmarks")
    if len(order) > len(footage):
        remarks.append(f"footage: {len(footage) / float(own.rate):.1f} s for {seconds:.1f} s of speech: "
                       f"{'played back and forth' if scene.fill == 'pingpong' else 'its last frame is held'}")
    pictures = revoicer(run.face, footage, shown, scene.scale)
    return Stage(run, pictures, clock, scene.views, notes, tuple(remarks), footage.pixel)
