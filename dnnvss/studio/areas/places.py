"""What of ours lies in the folders that the studio was given: found by its marks, named so that no name is a path."""

import hashlib
import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

DEEP = 2
"""Folders below a given one that are looked into."""
MOST = 2000
"""Folders that are looked into at a time."""
_PLAIN = re.compile(r"[\w][\w .,()+=@-]{0,99}")
"""Folder names that stand in an address as they are."""


@dataclass(frozen=True)
class Thing:
    """A folder of ours.

    Args:
        name: in addresses, unlike that of all others of its kind.
        folder: where it is.
    """

    name: str
    folder: Path


def found(roots: Iterable[Path], marks: Iterable[str], deep: int = DEEP) -> list[Thing]:
    """The folders that hold a file of one of the names, by their names.

    Links are not followed, hidden folders are passed over, and nothing within a folder that was found is looked at.

    Args:
        roots: where to look.
        marks: names of files.
        deep: folders below a root that are looked into.
    """
    folders = list(dict.fromkeys(f for root in roots for f in _marked(root.resolve(), frozenset(marks), deep)))
    return sorted(_named(folders), key=lambda thing: thing.name)


def _marked(root: Path, marks: frozenset[str], deep: int) -> Iterator[Path]:
    rows, seen = [(root, 0)], 0
    while rows and seen < MOST:
        folder, depth = rows.pop(0)
        seen += 1
        with suppress(OSError), os.scandir(folder) as entries:
            own = [each for each in entries if not each.is_symlink()]
            if any(each.name in marks and each.is_file() for each in own):
                yield folder
            elif depth < deep:
                rows += sorted((Path(e.path), depth + 1) for e in own if e.is_dir() and not e.name.startswith("."))


def _named(folders: list[Path]) -> list[Thing]:
    """Each folder under its own name, with a mark of its place where others have that name or it is an odd one."""
    often = Counter(folder.name for folder in folders)
    return [Thing(folder.name if often[folder.name] == 1 and _PLAIN.fullmatch(folder.name) else
                  f"{''.join(re.findall(_PLAIN, folder.name))[:60]}~{_mark(folder)}", folder) for folder in folders]


def _mark(folder: Path) -> str:
    return hashlib.sha256(os.fsencode(folder)).hexdigest()[:8]
