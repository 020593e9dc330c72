"""Point sets: which landmarks of a corpus are modelled, which are stable, and where the mouth's contours run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.settings import check_settings, read_settings, setting

AUTO = "auto"
"""Name of the set that stands for whichever of the known ones fits a corpus."""

PointChoice = Literal["all"] | tuple[int, ...]
"""Indices inside a landmark group, or ``"all"``."""
Groups = Mapping[str, Sequence[int]]
"""Name of a landmark group to the half-open range of its rows (``CorpusInfo.landmark_groups``)."""

_REMEDY = ("Take the one that fits: aam=folder (68 points), aam=labelled (40), aam=face100 (100), aam=default (146); "
           "or name the groups of the corpus (landmark_groups of its corpus.json) in a copy of conf/aam/folder.yaml")


def _lips_jaw_nostrils() -> dict[str, PointChoice]:
    return {"lips_outer": (0, 2, 4, 5, 6, 8, 10, 12, 14, 15, 16, 18), "lips_inner": (0, 3, 5, 7, 10, 13, 15, 17),
            "face_oval": (11, 13, 14, 16, 18, 20, 22, 23, 25), "nose_base": (0, 2, 3, 4, 6)}


def _upper_face() -> dict[str, PointChoice]:
    return {"right_eye": "all", "left_eye": "all", "nose_bridge": (0, 1, 2, 3), "nostril_wings": "all",
            "face_oval": (0, 1, 2, 33, 34, 35)}


@dataclass(frozen=True)
class PointSet:
    """The landmarks that a model uses, named by group so that any corpus can be served.

    Args:
        name: name of the set, shown in reports.
        points: landmark group to the indices (inside the group) that are modelled; their order is the model's order.
        stable: group to the indices of points that speech does not move; head pose is measured on them.
        lips_outer, lips_inner: the modelled groups that run round the lips, each a closed contour in order.
        eyes: groups that run round an eye, where the corpus has any; a neutral frame has them open.
        sizes: group to the number of points that it must have, so that indices are not taken for those of another
            mesh. No part of the model's key.
    """

    name: str = "lips_jaw_nostrils"
    points: Mapping[str, PointChoice] = setting(_lips_jaw_nostrils(), least=0)
    stable: Mapping[str, PointChoice] = setting(_upper_face(), least=0)
    lips_outer: str = "lips_outer"
    lips_inner: str = "lips_inner"
    eyes: tuple[str, ...] = ("right_eye", "left_eye")
    sizes: Mapping[str, int] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        check_settings(self, "aam.points")

    @classmethod
    def from_setting(cls, value: Any, where: str) -> "PointSet":
        """The set that a group of settings holds; a landmark group of null is left out. ``auto``: see :meth:`fitted`.

        Raises:
            DnnvssError: an unknown key, or a choice that is neither ``all`` nor a list of whole numbers.
        """
        if value == AUTO:
            return cls(AUTO, {}, {})
        plain = dict(value) if isinstance(value, Mapping) else value
        for key in ("points", "stable", "sizes") if isinstance(plain, dict) else ():
            if isinstance(plain.get(key), Mapping):
                plain[key] = {group: choice for group, choice in plain[key].items() if choice is not None}
        return read_settings(cls, plain, where)

    def fitted(self, groups: Groups) -> "PointSet":
        """This set, or of the known ones the first that fits a corpus, where it is :data:`AUTO`.

        Raises:
            DnnvssError: none of them fits.
        """
        if self.name != AUTO:
            return self
        if set(groups) >= _MARKED:
            return _markers(groups)
        sizes = {group: end - first for group, (first, end) in groups.items()}
        for known in KNOWN:
            if all(sizes.get(group) == size for group, size in known.sizes.items()):
                return known
        raise DnnvssError("none of the known point sets fits the landmark groups " +
                          ", ".join(f"{group} ({size})" for group, size in sizes.items()), remedy=_REMEDY)

    def to_dict(self) -> dict[str, Any]:
        """Return plain containers, the inverse of :meth:`from_setting`; ``sizes`` has done its work and is left out."""
        lists = {key: {g: c if isinstance(c, str) else list(c) for g, c in getattr(self, key).items()}
                 for key in ("points", "stable")}
        return {"name": self.name, **lists, "lips_outer": self.lips_outer, "lips_inner": self.lips_inner,
                "eyes": list(self.eyes)}

    def layout(self, groups: Groups) -> "Layout":
        """Return the rows of a corpus's landmark array that the set means.

        Raises:
            DnnvssError: a group that the corpus lacks or that has another size, an index outside it, a point named
                twice, or too few points.
        """
        for group, size in self.sizes.items():
            if group in groups and (found := groups[group][1] - groups[group][0]) != size:
                raise DnnvssError(f"point set {self.name!r} is meant for {size} points of {group!r}, and the corpus "
                                  f"has {found}", remedy=_REMEDY)
        rows = {group: _rows(groups, group, choice) for group, choice in self.points.items()}
        stable = np.concatenate([_rows(groups, g, c) for g, c in self.stable.items()] or [np.empty(0, int)])
        eyes = tuple(_rows(groups, g, "all") for g in self.eyes)
        for lips in (self.lips_outer, self.lips_inner):
            if len(rows.get(lips, ())) < 4:
                raise DnnvssError(f"point set {self.name!r} models {len(rows.get(lips, ()))} points of {lips!r}, and a "
                                  "mouth contour needs 4", remedy=_REMEDY)
        if len(stable) < 2:
            raise DnnvssError(f"point set {self.name!r} has {len(stable)} stable points, and head pose needs 2",
                              remedy=_REMEDY)
        modelled = np.concatenate(list(rows.values()))
        if len(set(modelled)) < len(modelled):
            raise DnnvssError(f"point set {self.name!r} names a landmark twice", remedy=_REMEDY)
        starts = np.cumsum([0, *[len(r) for r in rows.values()]])
        own = {group: np.arange(a, a + len(r)) for (group, r), a in zip(rows.items(), starts[:-1], strict=True)}
        return Layout(modelled, stable, own, own[self.lips_outer], own[self.lips_inner], eyes)


def _labelled() -> PointSet:
    return PointSet(
        points={"lips_outer": "all", "lips_inner": "all", "jaw": "all", "nose_base": "all"},
        stable={"right_eye": "all", "left_eye": "all", "nose_bridge": "all"}, eyes=(),
        sizes={"lips_outer": 12, "lips_inner": 8, "jaw": 9, "nose_base": 5, "right_eye": 2, "left_eye": 2,
               "nose_bridge": 2})


_MARKED = {"lips", "jig"}
"""Groups by which markers of motion capture are known: their lips have one line, and their jig stands still."""


def _markers(groups: Groups) -> PointSet:
    """All markers of a session, the head's pose measured on the jig."""
    return PointSet("markers", {g: "all" for g in groups if g != "jig"}, {"jig": "all"}, "lips", "lips", ())


KNOWN = (
    PointSet(sizes={"face_oval": 36, "lips_outer": 20, "lips_inner": 20, "nose_base": 7, "nose_bridge": 7,
                    "nostril_wings": 4, "right_eye": 16, "left_eye": 16}),
    PointSet("lips_jaw_nostrils_68",
             {"lips_outer": "all", "lips_inner": "all", "face_oval": tuple(range(3, 14)), "nose_base": "all"},
             {"right_eye": (0, 3), "left_eye": (0, 3), "nose_bridge": "all"},
             sizes={"face_oval": 17, "right_eye": 6, "left_eye": 6}),
    _labelled(),
)
"""The sets of a face mesh (146 points), of iBUG 300-W, which OpenFace and dlib follow (68), and of hand labels (40)."""


@dataclass(frozen=True)
class Layout:
    """A point set resolved for a corpus.

    Args:
        rows: rows (P,) of the corpus's landmark array that are modelled.
        stable: rows of the stable points.
        groups: modelled group to its positions among the P points.
        outer, inner: positions among the P points of the two lip contours.
        eyes: rows of the landmark array round each eye.
    """

    rows: np.ndarray
    stable: np.ndarray
    groups: dict[str, np.ndarray]
    outer: np.ndarray
    inner: np.ndarray
    eyes: tuple[np.ndarray, ...]

    @cached_property
    def needed(self) -> int:
        """The number of rows that a landmark array must have at least."""
        return int(max(self.rows.max(), self.stable.max())) + 1


def _rows(groups: Groups, group: str, choice: PointChoice) -> np.ndarray:
    if group not in groups:
        raise DnnvssError(f"no landmark group {group!r} among {sorted(groups)}", remedy=_REMEDY)
    start, stop = groups[group]
    indices = np.arange(stop - start) if isinstance(choice, str) else np.asarray(choice, dtype=int)
    if len(indices) and not (indices.min() >= 0 and indices.max() < stop - start):
        raise DnnvssError(f"landmark group {group!r} has {stop - start} points, and index {int(indices.max())} was "
                          "asked for", remedy=_REMEDY)
    return start + indices
