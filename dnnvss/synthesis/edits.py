"""Curves that an artist edited, taken back: what differs from what is said becomes keys."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from dnnvss.curves import resample
from dnnvss.errors import DnnvssError
from dnnvss.export.take import Take
from dnnvss.face.mesh.tongue import speaking_head
from dnnvss.face.rig import RigFace
from dnnvss.runs.run import Run
from dnnvss.style.edits import changes_of, edited_keys
from dnnvss.style.keys import Key
from dnnvss.synthesis.head import moves, on_head
from dnnvss.synthesis.rig import arkit_take, plain_curves
from dnnvss.synthesis.speak import Spoken, key_gauges

_ENOUGH = 10
"""Curves named as ARKit's shapes from which a take is one of these."""


def keys_of_edits(spoken: Spoken, edited: Take, easing: float) -> list[Key]:
    """Keys that hold what was changed in a take of what was spoken.

    Curves may be those of ``export_curves``, plain ones, or weights of ARKit's shapes: how far a
    weight moves the lips of the head is then what the face's gauges are moved by.

    Args:
        spoken: without the edits.
        edited: curves that were exported of it, at the rate of the export.
        easing: seconds over which a change comes and goes.

    Raises:
        DnnvssError: curves of something else, or of another length.
    """
    run, clock = spoken.run, edited.clock
    shown = resample(spoken.trajectory, spoken.clock, clock)
    known = key_gauges(run)
    of_head = sum(
        name.lower() in {n.lower() for n in speaking_head().names} for name in edited.curves
    )
    if (
        of_head >= _ENOUGH
        and not isinstance(run.face, RigFace)
        and moves(speaking_head(), dict(edited.curves))
    ):
        told: Mapping[str, np.ndarray] = arkit_take(
            run, shown, replace(edited, curves={})
        ).take.curves
        shares = _moved_gauges(run)
        names = list(run.face.gauges)
    else:
        told = {**{name: gauge(shown) for name, gauge in known.items()}, **plain_curves(run, shown)}
        shares, names = {}, list(known)
    gauges = {name: known[name](shown) for name in names}
    changes = changes_of(edited.curves, told, gauges, shares)
    keys = edited_keys(changes, clock, spoken.plan.phones, easing)
    ahead = spoken.request.anticipation
    return keys if not ahead else [_later(key, ahead) for key in keys]


def _later(key: Key, ahead: float) -> Key:
    """A key on movement in step with the sound, of one read off movement that is ahead of it."""
    if key.index is not None:
        raise DnnvssError(
            "edited curves of a face that is ahead of its sound cannot be taken back",
            remedy="Export and import them with anticipation=0, and move the face ahead at the end",
        )
    return replace(key, time=key.time + ahead)


def _moved_gauges(run: Run) -> dict[str, dict[str, float]]:
    """By how much a weight of 1 of each of the head's shapes moves each gauge of the face."""
    on = on_head(run, speaking_head())
    size = len(run.face.names)
    parameters = np.linalg.pinv(run.face.jacobian()[:, on.rows].reshape(size, -1).T)
    told = {}
    for name, shape in zip(on.head.names, on.moved_by_shapes, strict=True):
        moved = parameters @ on.in_face(shape).ravel()
        told[name] = {
            gauge: float(run.face.gauges[gauge].vector @ moved) for gauge in run.face.gauges
        }
    return told
