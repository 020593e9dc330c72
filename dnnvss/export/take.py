"""A take for an animator's program: named curves over time, and a head that they move."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.export.live_link import is_live_link, write_live_link
from dnnvss.export.timecode import TimeCode
from dnnvss.timing import FrameClock

if TYPE_CHECKING:
    from dnnvss.face.mesh import Head

SUFFIXES = (".csv", ".json", ".glb")
CURVES = ("arkit", "oculus", "plain")
"""What a take of speech can hold: weights of shapes, visemes, or values from 0 at rest to 1."""
_SOLID = 9
"""Digits that a number of a curve keeps."""


@dataclass(frozen=True)
class Take:
    """Named curves over time.

    Args:
        curves: name to values (F,).
        clock: of the frames.
        start: the time code of the first.
        head: what the curves move, a shape each; None where no mesh belongs to them.
        about: what the report and the files say of it.
    """

    curves: Mapping[str, np.ndarray]
    clock: FrameClock
    start: TimeCode = field(default_factory=TimeCode)
    head: "Head | None" = None
    about: Mapping[str, Any] = field(default_factory=dict)

    @property
    def frames(self) -> int:
        """F."""
        return len(next(iter(self.curves.values())))

    @property
    def seconds(self) -> np.ndarray:
        """When each frame (F,) is shown."""
        return np.array([self.clock.seconds(k) for k in range(self.frames)])


def check_take_file(path: Path, head: bool = True, others: Sequence[str] = ()) -> None:
    """Refuse the name of a file of another kind, and a mesh where there is none.

    Args:
        path: of the file.
        head: whether the curves move a head.
        others: suffixes of what else the command writes, for the remedy.

    Raises:
        DnnvssError: its suffix is none of :data:`SUFFIXES`, or ``.glb`` without a head.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise DnnvssError(
            f"a rig cannot be written as {path.suffix or 'a file without suffix'}",
            file=path,
            remedy=f"Name it {', '.join([*others, '.csv (Live Link Face)', '.json'])} or .glb (glTF)",
        )
    if path.suffix.lower() == ".glb" and not head:
        raise DnnvssError(
            "no head is moved by these curves, so that there is no mesh to write",
            file=path,
            remedy="Write .json or .csv; a mesh is there for rig_curves=arkit of points or of ARKit's curves",
        )


def write_take(path: Path, take: Take) -> Path:
    """Write a take as the suffix says, and return the path.

    ``.csv`` is Live Link Face's where all curves are ARKit's, else a column a curve behind frame, seconds and time
    code; ``.json`` holds names, frames and the time code; ``.glb`` the head with its shapes and one animation, which
    turns it where the curves do.

    Raises:
        DnnvssError: another suffix, or a ``.glb`` of curves that no head belongs to.
    """
    check_take_file(path, take.head is not None)
    match path.suffix.lower():
        case ".csv":
            return _write_csv(path, take)
        case ".json":
            return _write_json(path, take)
    assert take.head is not None
    from dnnvss.face.mesh.gltf_write import write_glb
    from dnnvss.face.mesh.turns import Turns

    weights = take.head.weights(take.curves)
    about = {"rate": _rate(take.clock), "timecode": str(take.start), **take.about}
    turns = Turns.of(take.head.mesh, take.curves)
    return write_glb(path, take.head, weights, take.seconds, about, turns)


def _write_csv(path: Path, take: Take) -> Path:
    if is_live_link(take.curves):
        return write_live_link(path, take.curves, take.clock, take.start)
    codes = take.start.codes(take.frames, take.clock)
    lines = [",".join(["frame", "seconds", "timecode", *take.curves])]
    rows = zip(*take.curves.values(), strict=True)
    for k, (code, second, row) in enumerate(zip(codes, take.seconds, rows, strict=True)):
        lines.append(",".join([str(k), f"{second:.6f}", code, *(f"{v:.6g}" for v in row)]))
    return files.write_text(path, "\n".join([*lines, ""]))


def _write_json(path: Path, take: Take) -> Path:
    table = np.stack([np.asarray(track, float) for track in take.curves.values()], axis=1)
    return files.write_text(
        path,
        files.json_text(
            {
                "format": "dnnvss-take",
                "version": 1,
                "rate": _rate(take.clock),
                "timecode": str(take.start),
                "timecodes": take.start.codes(take.frames, take.clock),
                "seconds": take.seconds.round(6).tolist(),
                "names": list(take.curves),
                "frames": table.round(_SOLID).tolist(),
                "about": dict(take.about),
            }
        )
        + "\n",
    )


def _rate(clock: FrameClock) -> str:
    return str(Fraction(clock.rate))
