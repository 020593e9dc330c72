"""Curves as the CSV of Live Link Face, which Unreal, Blender's add-ons and MotionBuilder's scripts read.

**Source.** Apple, ARKit, ``ARFaceAnchor.BlendShapeLocation`` for the names; the files of Epic's app for their order: a
column ``Timecode``, the number of curves, 52 shapes, then turns of the head and the eyes.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.export.timecode import TimeCode
from dnnvss.timing import FrameClock

_EYE = ("EyeBlink", "EyeLookDown", "EyeLookIn", "EyeLookOut", "EyeLookUp", "EyeSquint", "EyeWide")
_PAIRS_1 = ("MouthSmile", "MouthFrown", "MouthDimple", "MouthStretch")
_PAIRS_2 = ("MouthPress", "MouthLowerDown", "MouthUpperUp", "BrowDown")


def _both(names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name + side for name in names for side in ("Left", "Right"))


SHAPES = (
    *(name + "Left" for name in _EYE),
    *(name + "Right" for name in _EYE),
    *("JawForward", "JawRight", "JawLeft", "JawOpen"),
    *("MouthClose", "MouthFunnel", "MouthPucker", "MouthRight", "MouthLeft"),
    *_both(_PAIRS_1),
    *("MouthRollLower", "MouthRollUpper", "MouthShrugLower", "MouthShrugUpper"),
    *_both(_PAIRS_2),
    *("BrowInnerUp", "BrowOuterUpLeft", "BrowOuterUpRight"),
    *("CheekPuff", "CheekSquintLeft", "CheekSquintRight"),
    *("NoseSneerLeft", "NoseSneerRight", "TongueOut"),
)
"""The 52 shapes of ARKit in the order of the file."""
TURNS = tuple(
    part + turn for part in ("Head", "LeftEye", "RightEye") for turn in ("Yaw", "Pitch", "Roll")
)
"""What follows them: turns of the head and the eyes."""
_BESIDE = ("TongueTipUp", "TongueBackUp")
"""What the packaged head has besides, and the file no column for."""


def is_live_link(names: Iterable[str]) -> bool:
    """Whether curves are ARKit's, so that the file loses none but the packaged head's own of the tongue.

    Args:
        names: of the curves, in any case.
    """
    known = {name.lower() for name in (*SHAPES, *TURNS, *_BESIDE)}
    return all(name.lower() in known for name in names)


def write_live_link(
    path: Path, curves: Mapping[str, np.ndarray], clock: FrameClock, start: TimeCode | None = None
) -> Path:
    """Write curves as Live Link Face does, and return the path; what has no curve is zero.

    Args:
        path: the file.
        curves: name to values (F,); names as ARKit's, in any case; others are left out.
        clock: of the frames.
        start: the time code of the first.

    Raises:
        DnnvssError: none of the curves is one of ARKit's.
    """
    known = {name.lower(): np.asarray(track, float) for name, track in curves.items()}
    columns = (*SHAPES, *TURNS)
    if not any(name.lower() in known for name in columns):
        raise DnnvssError(
            f"none of the curves {', '.join(list(curves)[:5])} is one of ARKit's",
            file=path,
            remedy="Write .json, which keeps any names",
        )
    frames = len(next(iter(curves.values())))
    table = np.stack([known.get(name.lower(), np.zeros(frames)) for name in columns], axis=1)
    codes = (start or TimeCode()).codes(frames, clock)
    lines = [",".join(["Timecode", "BlendShapeCount", *columns])]
    for code, row in zip(codes, table, strict=True):
        lines.append(f"{code}.000,{len(columns)}," + ",".join(f"{value:.10f}" for value in row))
    return files.write_text(path, "\n".join([*lines, ""]))
