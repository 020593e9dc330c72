"""C3D, the binary file of motion capture, read by ezc3d in a process of its own."""

import struct
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from dnnvss.archives import Held, read_declared
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.formats.tracked import IN_MM, Markers
from dnnvss.shortages import MEMORY
from dnnvss.staging import scratch

_WORKER = Path(__file__).with_name("c3d_worker.py")
_REMEDY = "Export the take again, or as TRC"
_MAGIC, _BLOCK = 0x50, 512
_SECONDS, _PATIENCE = 120, 1200
"""Seconds of a processor that reading may take, and those of the clock on a machine that is busy."""
_KILLED, _LATE = -9, -24
"""How a process ends that the system kills, and one that took too long (SIGKILL, SIGXCPU)."""
_MEMORY = ("MemoryError", "bad_alloc")
_LACKING = ("too many open files", "failed to map segment", "cannot allocate memory", "no space left")
"""What the process says of memory, where the file may be to blame, and of other shortages."""
_ROOM, _TIMES = 2_000_000_000, 40
"""Memory of the process: what Python and the library take, and this many times the file."""
_MOST_BYTES = 2_000_000_000
_HELD = {
    "names": Held(("M",), "U"),
    "points": Held(("F", "M", 3), finite=False),
    "rate": Held(()),
    "unit": Held((), "U"),
}


def read_c3d(path: str | Path) -> Markers:
    """The markers in a C3D, in millimetres; those of negative residual are missing.

    The head is looked at first: a file that is shorter than the frames that it declares is refused before anything is
    held. The library reads in a process with bounded memory and time, which a damaged file may end.

    Raises:
        DnnvssError: ezc3d is not installed, or the file is missing, damaged or in another unit.
    """
    path = Path(path)
    if find_spec("ezc3d") is None:
        raise DnnvssError(
            "C3D files need the package ezc3d",
            file=path,
            remedy="pip install dnnvss[motion], or export the take as TRC",
        )
    _check_head(path)
    with scratch() as folder:
        out = folder / "markers.npz"
        most = _ROOM + _TIMES * path.stat().st_size
        command = [sys.executable, "-P", str(_WORKER), str(path), str(out), str(most), str(_SECONDS)]
        try:
            done = subprocess.run(command, capture_output=True, timeout=_PATIENCE, check=False)
        except subprocess.TimeoutExpired as error:
            raise ShortageError(
                f"the system is short of what the work needs: {path} was not read in {_PATIENCE} s",
                remedy=MEMORY,
            ) from error
        if done.returncode or not out.is_file():
            raise _unread(path, done.returncode, done.stderr.decode("utf-8", "replace"), most)
        held = read_declared(out, _HELD, _REMEDY)
    return _markers(path, held)


def _unread(path: Path, status: int, said: str, most: int) -> DnnvssError:
    """What ended the process that reads: the system, of which nothing is kept, or the file."""
    last = said.strip().split("\n")[-1][:200] or f"the reader ended with {status}"
    memory = any(word in said for word in _MEMORY) and _granted() < most
    if status == _KILLED or memory or any(word in said.lower() for word in _LACKING):
        return ShortageError(
            f"the system is short of what the work needs: {last} (at {path})", remedy=MEMORY
        )
    why = f"not in {_SECONDS} s of a processor" if status == _LATE else last
    return DnnvssError(f"cannot be read ({why})", file=path, remedy=_REMEDY)


def _granted() -> float:
    """Bytes of memory that the system lets a process have."""
    import resource  # which not every system has

    kinds = (resource.RLIMIT_AS, resource.RLIMIT_DATA)
    limits = [resource.getrlimit(kind)[0] for kind in kinds]
    return min((limit for limit in limits if limit != resource.RLIM_INFINITY), default=float("inf"))


def _markers(path: Path, held: dict[str, np.ndarray]) -> Markers:
    unit, rate = str(held["unit"]).strip().lower(), float(held["rate"])
    if unit not in IN_MM:
        raise DnnvssError(
            f"is in the unit {unit!r}", file=path, remedy=f"Use one of {', '.join(IN_MM)}"
        )
    if not 0 < rate <= 10_000 or not len(held["points"]) or not len(held["names"]):
        raise DnnvssError(
            f"holds {len(held['points'])} frames of {len(held['names'])} markers at {rate:g} a second",
            file=path,
            remedy=_REMEDY,
        )
    names = tuple(str(n) for n in held["names"])
    if len(set(names)) < len(names):
        raise DnnvssError(
            "two of its markers have one name", file=path, remedy="Name each marker once"
        )
    return Markers(names, np.asarray(held["points"], float) * IN_MM[unit], rate)


def _check_head(path: Path) -> None:
    """Refuse what is no C3D, or is shorter than the points that its head declares.

    **Source**: The C3D File Format User Guide (Motion Lab Systems, 2008), header section.
    """
    if not path.is_file():
        raise DnnvssError("no such file", file=path, remedy=_REMEDY)
    size = path.stat().st_size
    with path.open("rb") as file:
        head = file.read(_BLOCK)
    if len(head) < _BLOCK or head[1] != _MAGIC or size > _MOST_BYTES:
        raise DnnvssError(
            "is no C3D" if size <= _MOST_BYTES else "is larger than 2 GB", file=path, remedy=_REMEDY
        )
    points, analog, first, last = struct.unpack("<4H", head[2:10])
    scale, start = struct.unpack("<fH", head[12:18])
    frames = max(last - first + 1, 0) if last else 0
    least = (max(start, 1) - 1) * _BLOCK + frames * (4 * points + analog) * (4 if scale < 0 else 2)
    if not points or (last < 65_535 and size < least):
        raise DnnvssError(
            f"declares {frames} frames of {points} points and has {size:,} bytes",
            file=path,
            remedy=_REMEDY,
        )
