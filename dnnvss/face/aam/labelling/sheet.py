"""A folder of labelled frames: ``labels.json``, a picture and a ``.pts`` file for each frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

import cv2
import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.face.aam.labelling.schemes import SCHEMES, Scheme
from dnnvss.formats.landmarks import read_pts, write_pts
from dnnvss.records import read_record
from dnnvss.settings import setting

NAME = "labels.json"
FAR = 1e6
"""Pixels beyond which a point is a mistake of whoever wrote it."""
PICTURES = (".png", ".jpg", ".jpeg")
_REMEDY = "Choose frames first: dnnvss label choose VIDEOS --out FOLDER"
_LABEL = "Label it on the page (dnnvss label page FOLDER), or take it out of labels.json"


@dataclass(frozen=True)
class Label:
    """A frame to label: its video (relative to the sheet's ``videos``), frame number, picture and points file."""

    video: str
    frame: int
    image: str
    points: str


    def check(self, sheet: Path) -> None:
        """Refuse a label that names no picture, no points or no frame.

        Args:
            sheet: that names them.

        Raises:
            DnnvssError: one of its files leads out of the folder or is of another kind, or its frame is negative.
        """
        for name in (self.image, self.points, self.video):
            files.check_name(name, sheet)
        if not self.points.endswith(".pts") or PurePosixPath(self.image).suffix.lower() not in PICTURES:
            raise DnnvssError(f"a label is a picture and a .pts file, not {self.image!r} and {self.points!r}",
                              file=sheet, remedy=_REMEDY)
        if self.frame < 0:
            raise DnnvssError(f"names frame {self.frame} of {self.video}", file=sheet, remedy=_REMEDY)


@dataclass(frozen=True)
class Sheet:
    """The frames that are labelled, and how far.

    Args:
        folder: where picture and points files are.
        groups: landmark group to the half-open range of its rows.
        labels: the frames.
        done: pictures whose label is finished; the others are guesses.
        scheme: name of the scheme, or of whatever the points follow.
        videos: the folder that the videos are named from.
        moved: pictures whose points a person has moved or finished; the others' may still be guessed anew.
    """

    folder: Path
    groups: dict[str, tuple[int, int]]
    labels: tuple[Label, ...]
    done: frozenset[str] = frozenset()
    scheme: str = ""
    videos: str = ""
    moved: frozenset[str] = frozenset()

    @property
    def count(self) -> int:
        """The number of points P of each label."""
        return max(stop for _, stop in self.groups.values())

    @property
    def closed(self) -> dict[str, bool]:
        """Landmark group to whether its line returns to its first point."""
        known = {g.name: g.closed for s in SCHEMES.values() for g in s.parts if s.name == self.scheme}
        return {g: known.get(g, g.startswith("lips")) for g in self.groups}

    @classmethod
    def open(cls, folder: str | Path) -> "Sheet":
        """Return the sheet in a folder.

        Raises:
            DnnvssError: ``labels.json`` is missing, damaged or names no group, no frame or one frame twice.
        """
        folder = Path(folder)
        path = folder / NAME
        kept = read_record(_Kept, path, _REMEDY)
        names = [label.image for label in kept.labels]
        wrong = [name for name, (first, end) in kept.groups.items() if first >= end]
        if not kept.groups or not names or len(set(names)) < len(names) or wrong:
            raise DnnvssError(f"names {len(kept.groups)} groups{f' ({wrong[0]} is empty)' if wrong else ''} and "
                              f"{len(names)} pictures, {len(set(names))} different ones", file=path, remedy=_REMEDY)
        for label in kept.labels:
            label.check(path)
        return cls(folder, dict(kept.groups), kept.labels, frozenset(kept.done), kept.scheme, kept.videos,
                   frozenset(kept.moved))

    def save(self) -> "Sheet":
        """Write ``labels.json`` and return the sheet."""
        rows = [vars(label) for label in self.labels]
        files.write_json(self.folder / NAME, {
            "scheme": self.scheme, "videos": self.videos, "groups": {g: list(r) for g, r in self.groups.items()},
            "labels": rows, "done": sorted(self.done), "moved": sorted(self.moved)})
        return self

    def label(self, image: str) -> Label:
        """Return the label of a picture.

        Raises:
            DnnvssError: the sheet has no such picture.
        """
        for label in self.labels:
            if label.image == image:
                return label
        raise DnnvssError(f"has no picture {image!r}", file=self.folder / NAME)

    def read(self, label: Label) -> np.ndarray:
        """Return the points (P, 2) float64 of a label in pixels.

        Raises:
            DnnvssError: the file is missing, or holds another number of points, or one that is not finite.
        """
        path = files.inside(self.folder, label.points)
        return self.checked(files.read(path, read_pts, _LABEL).astype(float), path)

    def checked(self, points: np.ndarray, path: Path) -> np.ndarray:
        """Return points (P, 2), if there are P and all are finite and less than :data:`FAR` from the picture's corner.

        Raises:
            DnnvssError: names the file and the first group and point that is wrong.
        """
        points = np.asarray(points, dtype=float)
        if points.shape != (self.count, 2):
            raise DnnvssError(f"holds {len(points)} points, and the labels have {self.count}", file=path, remedy=_LABEL)
        if not (fine := np.abs(points) < FAR).all():
            bad = int(np.flatnonzero(~fine.all(axis=1))[0])
            raise DnnvssError(f"{self.name_of(bad)} is {points[bad].tolist()}", file=path, remedy=_LABEL)
        return points

    def name_of(self, point: int) -> str:
        """Return a point's name, e.g. ``lips_inner 3``."""
        for group, (start, stop) in self.groups.items():
            if start <= point < stop:
                return f"{group} {point - start}"
        return f"point {point}"

    def write(self, image: str, points: np.ndarray, done: bool) -> "Sheet":
        """Write points (P, 2) that a person placed, mark the label finished or not, and return the sheet as it then is.

        Raises:
            DnnvssError: an unknown picture, or wrong points.
        """
        label = self.label(image)
        path = files.inside(self.folder, label.points)
        write_pts(path, self.checked(points, path))
        if (image in self.done) == done and image in self.moved:
            return self
        finished = self.done | {image} if done else self.done - {image}
        return replace(self, done=finished, moved=self.moved | {image}).save()

    def picture(self, label: Label) -> np.ndarray:
        """Return a label's picture, uint8 RGB (H, W_, 3).

        Raises:
            DnnvssError: it is missing or no picture.
        """
        path = files.inside(self.folder, label.image)
        image = files.read(path, lambda p: cv2.imread(str(p)), "Choose the frames again")
        if image is None:
            raise DnnvssError("is no picture", file=path, remedy="Choose the frames again")
        return cv2.cvtColor(image, cv2.COLOR_BGR2RGB)

    def finished(self) -> np.ndarray:
        """Return the points (n, P, 2) of all labels, in order.

        Raises:
            DnnvssError: a label is unfinished, missing or wrong; names it.
        """
        for label in self.labels:
            if label.image not in self.done:
                raise DnnvssError("its points are still a guess", file=self.folder / label.points, remedy=_LABEL)
        return np.stack([self.read(label) for label in self.labels])


@dataclass(frozen=True, kw_only=True)
class _Kept:
    """What ``labels.json`` holds."""

    groups: Mapping[str, tuple[int, int]] = setting(least=0, most=10_000)
    labels: tuple[Label, ...] = ()
    done: tuple[str, ...] = ()
    scheme: str = ""
    videos: str = ""
    moved: tuple[str, ...] = ()


def new_sheet(folder: Path, scheme: Scheme, videos: str, labels: Sequence[Label]) -> Sheet:
    """Return a sheet of unfinished labels; nothing is written."""
    return Sheet(folder, scheme.groups, tuple(labels), frozenset(), scheme.name, videos)
