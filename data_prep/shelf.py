"""The files of a folder by the recording that they belong to, whatever system and editor named them."""

import os
import re
import unicodedata
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path

from dnnvss.errors import DnnvssError
from dnnvss.formats import SUBTITLES, is_words_csv
from dnnvss.media.folders import SOUNDS, VIDEOS, is_visible

_RECORDED = {*VIDEOS, ".c3d", ".trc"}
_SUFFIX = "|".join(map(re.escape, (*VIDEOS, *SOUNDS, ".txt", ".lab", *SUBTITLES)))
_SPARE = re.compile(rf"(?:{_SUFFIX}"
                    r"|\.(?:en|eng|english)(?:[-_][A-Za-z]{2,8})*|\.(?:auto|sdh|cc))$", re.IGNORECASE)
"""What programs add to a name before the suffix: a suffix (clip.wav.srt, clip.txt.txt), or that it is English."""
_OF_MANY = (".mlf", ".ctm")
"""Alignments that may be those of a whole corpus."""
_FRAME = re.compile(r"(.+)_\d+")


class Shelf:
    """A folder of recordings, read once.

    Names that differ in how accents are stored (composed, or as macOS keeps them) are of one recording; case does not
    matter, nor do a suffix too many or a mark of English beside a video (``clip.mp4.txt``, ``clip.en.srt``). Bytes
    of a name that are not UTF-8 are read as Windows's cp1252.

    Args:
        root: the folder.

    Raises:
        DnnvssError: there is no such folder.
    """

    def __init__(self, root: Path) -> None:
        if not root.is_dir():
            raise DnnvssError("is a file" if root.is_file() else "no such folder", file=root,
                              remedy="Set corpus.raw to the folder of your recordings")
        self.root = root
        self._files: dict[str, dict[str, Path]] = {}
        self._folders: dict[str, Path] = {}
        self._frames: dict[str, list[Path]] = {}
        self._twice: dict[str, list[Path]] = {}
        for path in sorted(root.iterdir()):
            if is_visible(path) or _leads_nowhere(path):
                suffix = path.suffix.lower()
                if self._files.setdefault(id_of(path.stem), {}).setdefault(suffix, path) is not path:
                    self._twice.setdefault(id_of(path.stem), []).append(path)
                if suffix == ".pts" and (match := _FRAME.fullmatch(id_of(path.stem))):
                    self._frames.setdefault(match[1], []).append(path)
            elif path.is_dir() and any(p.suffix.lower() == ".pts" for p in path.iterdir()):
                self._folders[id_of(path.name)] = path

        self._join()

    def _join(self) -> None:
        """Give a recording the files whose names are its own with a suffix too many, or in another case."""
        filmed = {name for name, kinds in self._files.items() if not _RECORDED.isdisjoint(kinds)}
        low = {name.casefold(): name for name in sorted(filmed, reverse=True)}
        for name in [n for n in self._files if n not in filmed]:
            if (owner := low.get(_plain(name).casefold())) is not None and owner != name:
                for suffix, path in self._files[name].items():
                    self._files[owner].setdefault(suffix, path)
                del self._files[name]

    def twice(self, name: str) -> list[Path]:
        """The files of a recording that are not taken, for another one has the same name but for case and accents."""
        return self._twice.get(name, [])

    def others(self, name: str) -> list[Path]:
        """The files whose names begin with that of a recording."""
        return self._continued.get(name, [])

    @cached_property
    def _continued(self) -> dict[str, list[Path]]:
        """The files by the names that theirs are, or go on behind a dot."""
        found: dict[str, list[Path]] = {}
        for other, kinds in self._files.items():
            for name in (other, *(other[:at] for at, sign in enumerate(other) if sign == ".")):
                found.setdefault(name, []).extend(kinds.values())
        return found

    def of_kind(self, *suffixes: str) -> Iterator[tuple[str, Path]]:
        """Each recording with a file of one of these suffixes, which come first to last, and that file."""
        for suffix in suffixes:
            yield from ((name, kinds[suffix]) for name, kinds in self._files.items() if suffix in kinds)

    def get(self, name: str, *suffixes: str) -> Path | None:
        """The first of the files of a recording that is there."""
        kinds = self._files.get(name, {})
        return next((kinds[suffix] for suffix in suffixes if suffix in kinds), None)

    def path(self, name: str, suffix: str) -> Path:
        """The file of a recording, or where it should be."""
        return self.get(name, suffix) or self.root / f"{name}{suffix}"

    @cached_property
    def in_common(self) -> list[Path]:
        """The files with phone times of many recordings: those that have no recording of their name."""
        return [path for kinds in self._files.values() if kinds.keys() <= set(_OF_MANY) for path in kinds.values()]

    @property
    def pts_folders(self) -> set[str]:
        """Recordings with a folder of ``.pts`` files."""
        return set(self._folders)

    def landmarks(self, name: str) -> tuple[Path, ...]:
        """The files with the landmarks of a recording, none where there are none."""
        for single in (self.get(name, ".npz"), self.get(name, ".csv"), self.get(name, ".pts"), self._folders.get(name)):
            if single is not None and not (single.suffix.lower() == ".csv" and is_words_csv(single)):
                return (single,)
        return tuple(self._frames.get(name, ()))


def _leads_nowhere(path: Path) -> bool:
    """Whether a path is a link to a video that is not there, as those of git-annex are before the data come."""
    return path.suffix.lower() in VIDEOS and path.is_symlink() and not path.exists() and not path.name.startswith(".")


def _plain(name: str) -> str:
    """A name without what programs add to it."""
    while (bare := _SPARE.sub("", name)) != name and bare:
        name = bare
    return name.strip()


def id_of(stem: str) -> str:
    """The id of a recording by the name of a file without its suffix."""
    try:
        stem.encode("utf-8")
    except UnicodeEncodeError:
        stem = os.fsencode(stem).decode("cp1252", "replace").replace("\ufffd", "_")
    return unicodedata.normalize("NFC", stem)
