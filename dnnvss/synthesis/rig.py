"""What was spoken as a take for an animator's program: curves of ARKit, of visemes or in plain units."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from dnnvss.curves import resample
from dnnvss.errors import DnnvssError
from dnnvss.export.take import Take, check_take_file
from dnnvss.export.timecode import TimeCode
from dnnvss.export.visemes import oculus_curves
from dnnvss.face.mesh.fitting import Fitted
from dnnvss.face.mesh.tongue import speaking_head, tongue_curves
from dnnvss.face.rig import RigFace
from dnnvss.render.plots import plot_panels
from dnnvss.runs.run import Run
from dnnvss.style.plain import ONE_SIDED, plain_gauges
from dnnvss.synthesis.head import can_show_head, head_weights, moves, on_head, rig_curves
from dnnvss.synthesis.request import SpeakRequest
from dnnvss.synthesis.speak import Spoken
from dnnvss.synthesis.stage import scene_clock
from dnnvss.timing import FrameClock

_PLOTTED = 5
"""Shapes in the plot, those that move most."""


@dataclass(frozen=True)
class RigRequest:
    """How a take is written.

    Args:
        curves: of :data:`~dnnvss.export.take.CURVES`.
        clock: of the frames; that of the pictures where None.
        start: the time code of the first frame.
    """

    curves: str = "arkit"
    clock: FrameClock | None = None
    start: TimeCode = field(default_factory=TimeCode)


@dataclass(frozen=True)
class SpokenTake:
    """A take, and how well its shapes reach the face's points; None where the curves are no fit."""

    take: Take
    fitted: Fitted | None = None

    def remarks(self) -> list[str]:
        """What the user is told, a line each."""
        return self.fitted.lines() if self.fitted else []


def check_take(path: Path, run: Run, request: RigRequest, speech: SpeakRequest) -> None:
    """Refuse a take that what is going to be spoken cannot be written as.

    Args:
        path: of the take.
        run: that speaks.
        request: how the take is written.
        speech: what is asked of the run.

    Raises:
        DnnvssError: curves that this face or what is given cannot have, a time code that the rate has not, or a file of
            another kind.
    """
    _check_curves(request, not speech.wordless)
    fitted = request.curves == "arkit"
    if fitted and not isinstance(run.face, RigFace):
        on_head(run, speaking_head())
    check_take_file(path, head=fitted and can_show_head(run))
    request.start.base(request.clock or scene_clock(run, speech.scene))


def _check_curves(request: RigRequest, phones: bool) -> None:
    if request.curves == "oculus" and not phones:
        raise DnnvssError(
            "a voice alone tells no phones, and visemes are phones as they are seen",
            remedy="Give the text or an alignment, or take rig_curves=arkit",
        )


def spoken_take(spoken: Spoken, request: RigRequest) -> SpokenTake:
    """A take of what was spoken.

    Raises:
        DnnvssError: curves that this face or what was given cannot have.
    """
    _check_curves(request, spoken.plan.phones is not None)
    clock = request.clock or spoken.stage.clock
    shown = resample(spoken.trajectory, spoken.clock, clock)
    take = Take({}, clock, request.start)
    match request.curves:
        case "oculus":
            assert spoken.face_phones is not None
            return SpokenTake(
                replace(take, curves=oculus_curves(spoken.face_phones, clock, len(shown)))
            )
        case "plain":
            return SpokenTake(replace(take, curves=plain_curves(spoken.run, shown)))
    tongue = tongue_curves(spoken.face_phones, clock, len(shown)) if spoken.face_phones else {}
    return arkit_take(spoken.run, shown, take, tongue)


def plain_curves(run: Run, parameters: np.ndarray) -> dict[str, np.ndarray]:
    """The face's gauges in its unit, and plain curves from 0 at rest to 1, (F,) each, for parameters (F, D)."""
    face = run.face
    made = {name: gauge(parameters) for name, gauge in face.gauges.items()}
    for name, gauge in plain_gauges(face, run.generator.talker).items():
        track = gauge(parameters)
        made[name] = np.maximum(track, 0) if name in ONE_SIDED else track
    return made


def arkit_take(
    run: Run,
    parameters: np.ndarray,
    take: Take,
    tongue: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> SpokenTake:
    """The curves of a rig themselves, or weights of the packaged head's shapes that reach the face's points.

    Args:
        run: whose face moves.
        parameters: (F, D).
        take: its clock and time code.
        tongue: curves (F,) of the tongue, which no point tells.
    """
    head = speaking_head()
    if isinstance(run.face, RigFace):
        curves = rig_curves(run.face, parameters)
        return SpokenTake(replace(take, curves=curves, head=head if moves(head, curves) else None))
    weights, fitted = head_weights(run, parameters, head, tongue)
    assert fitted is not None
    curves = dict(zip(head.names, weights.T, strict=True))
    about = {
        "error": round(float(np.sqrt((fitted.errors**2).mean())), 5),
        "error_of": "mouth width, RMS",
        "ambiguous": list(fitted.ambiguous),
    }
    return SpokenTake(replace(take, curves=curves, head=head, about=about), fitted)


def plot_fit(path: Path, made: SpokenTake, spoken: Spoken) -> Path | None:
    """Draw the error of each frame, and the shapes that move most; None where there is no fit or no phones."""
    if made.fitted is None or spoken.plan.phones is None:
        return None
    most = sorted(made.take.curves.items(), key=lambda item: -np.ptp(item[1]))[:_PLOTTED]
    panels = {"not reached, % of mouth": {"error": 100 * made.fitted.errors}}
    panels |= {name: {"weight": track} for name, track in most}
    return plot_panels(path, panels, made.take.clock.rate, spoken.plan.phones, "Shapes of the head")
