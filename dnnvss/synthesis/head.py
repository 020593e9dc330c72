"""The packaged head, moved by a run's parameters: as weights of its shapes, and as pictures."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.rig import RigFace
from dnnvss.runs.run import Run

if TYPE_CHECKING:  # a head is loaded when one is to be seen
    from dnnvss.face.mesh import Head
    from dnnvss.face.mesh.fitting import Fitted, OnHead

HEAD_VIEW = "head"
"""The view that shows the packaged head, of any face that has lips or is a rig of ARKit's curves."""


def moves(head: "Head", curves: Mapping[str, np.ndarray]) -> bool:
    """Whether any of the curves is a shape of a head."""
    return bool({name.lower() for name in curves} & {name.lower() for name in head.names})


def on_head(run: Run, head: "Head") -> "OnHead":
    """Where the points of a run's face lie on a head, from the talker at rest.

    Raises:
        DnnvssError: the face has no contour of the lips.
    """
    from dnnvss.face.mesh.fitting import OnHead

    rest = np.nan_to_num(run.generator.talker.rest)
    return OnHead.of(head, run.face.contours, run.face.points(rest))


def rig_curves(face: RigFace, parameters: np.ndarray) -> dict[str, np.ndarray]:
    """All curves of a rig by name (F,), for parameters (F, D)."""
    return dict(zip(face.all_curves, face.curves(parameters).T, strict=True))


def head_weights(
    run: Run,
    parameters: np.ndarray,
    head: "Head",
    tongue: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> "tuple[np.ndarray, Fitted | None]":
    """Weights (F, S) of a head's shapes for parameters (F, D), and how well they reach the points where it is a fit.

    Args:
        run: whose face moves.
        parameters: of the face.
        head: that is moved.
        tongue: curves (F,) of shapes that no point of the face tells.

    Raises:
        DnnvssError: a rig whose curves are not the head's, or a face without lips.
    """
    if isinstance(run.face, RigFace):
        return head.weights(rig_curves(run.face, parameters)), None
    fitted = on_head(run, head).fit(run.face.points(parameters))
    for name, track in tongue.items():
        fitted.weights[:, head.position(name)] = track
    return fitted.weights, fitted


def can_show_head(run: Run) -> bool:
    """Whether the packaged head can be moved by a run's parameters."""
    if isinstance(run.face, RigFace):
        from dnnvss.face.mesh import packaged_head

        return moves(packaged_head(), dict.fromkeys(run.face.all_curves, np.zeros(0)))
    return bool({"lips_outer", "lips"} & set(run.face.contours))


def head_pictures(
    run: Run,
    parameters: np.ndarray,
    height: int,
    tongue: Mapping[str, np.ndarray] = MappingProxyType({}),
) -> Iterator[np.ndarray]:
    """Yield the head's pictures, uint8 RGB (height, W_, 3), for each row of parameters (F, D).

    Args:
        run: whose face moves.
        parameters: of the face.
        height: of the pictures.
        tongue: curves (F,) of the tongue.

    Raises:
        DnnvssError: this kind of face cannot move it.
    """
    from dnnvss.face.mesh.tongue import speaking_head
    from dnnvss.face.mesh.turns import Turns
    from dnnvss.render.solid import Solid, whole_head

    head = speaking_head()
    if not can_show_head(run):
        raise DnnvssError(
            f"a face of the kind {run.face.kind} without lips or ARKit's curves moves no head",
            remedy="Take another view: render=face",
        )
    weights, _ = head_weights(run, parameters, head, tongue)
    turns = Turns.of(head.mesh, rig_curves(run.face, parameters)) if isinstance(run.face, RigFace) else None
    camera = whole_head(head.mesh, max(2, height // 2 * 2), turns=turns)
    return Solid(head.mesh, camera, smooth=2).frames(head.moved(weights, turns))
