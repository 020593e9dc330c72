"""Names that files give other files, and that must not lead elsewhere."""

import re
from collections.abc import Sequence
from pathlib import Path, PurePosixPath, PureWindowsPath

from dnnvss.errors import DnnvssError

_STRANGE = "Do not use these files unless you know who wrote them; put the file itself into the folder"
_LONGEST = 240  # bytes of a part of a name; systems allow 255, and temporary files have longer names
_DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)
"""Names that mean devices on Windows."""


def inside(folder: Path, name: str) -> Path:
    """The path of a file that another file names, which must lie in ``folder``.

    Raises:
        DnnvssError: the name leads out of the folder: it is absolute, has ``..``, or goes through a link; or no system
            has files of such a name.
    """
    check_name(name, folder)
    path = folder / name
    if not path.resolve().is_relative_to(folder.resolve()):
        raise DnnvssError(f"{name!r} is a link that leads out of the folder", file=folder, remedy=_STRANGE)
    return path


def check_name(name: str, folder: Path) -> None:
    """Refuse the name of a file that leads out of ``folder`` or that some system cannot have; links are not looked at.

    Raises:
        DnnvssError: it is empty or absolute, has ``..`` or a backslash, or means a device.
    """
    parts = PurePosixPath(name).parts
    odd = not parts or PurePosixPath(name).is_absolute() or PureWindowsPath(name).drive or ".." in parts
    odd = odd or any(len(part.encode(errors="replace")) > _LONGEST or _DEVICES.fullmatch(part) for part in parts)
    if odd or "\\" in name or any(ord(c) < 32 for c in name):
        raise DnnvssError(f"the name {name!r} leads out of the folder", file=folder, remedy=_STRANGE)


def check_apart(written: Sequence[Path], read: Sequence[Path]) -> None:
    """Refuse what would be written over a file that is read, links followed, or twice.

    Raises:
        DnnvssError: there is such a file.
    """
    places = [path.resolve() for path in written]
    for path in read:
        if path.resolve() in places:
            raise DnnvssError("is read, and would be written over", file=path, remedy="Give the output another name")
    for place in places:
        if places.count(place) > 1:
            raise DnnvssError("two outputs have this name", file=place, remedy="Name one of them otherwise")
