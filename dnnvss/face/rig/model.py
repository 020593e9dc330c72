"""A face that is a set of named curves: its parameters are the curves that move."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, read_declared
from dnnvss.corpus import UNITS
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Gauge, name_groups
from dnnvss.face.rig.settings import RigSettings
from dnnvss.records import as_record

_FORMAT = 1
_REMEDY = "Train again, or delete the file and run the same command"
_ARRAYS = {
    "kind": Held((), "U"),
    "settings": Held((), "U"),
    "curves": Held(("C",), "U"),
    "moving": Held(("C",), "b"),
    "rest": Held(("C",)),
    "ranges": Held(("C", 2)),
    "deviations": Held(("D",)),
}


@dataclass(frozen=True)
class RigFace:
    """A rig of C curves, of which the D that move are the parameters, in the curves' own units.

    It has no points: an animator's program, or a mesh with the rig's shapes, shows it. Each curve
    is a gauge by its name, so that keys, plots and exports ask for it as for any other.

    Args:
        settings: that it was fitted with.
        all_curves: the names (C,) of all curves, in the order of the corpus.
        moving: (C,) bool, which of them are parameters.
        rest: (C,) values at rest, zero in any usual rig; those that do not move stand there.
        all_ranges: (C, 2) the least and greatest value of each.
        deviations: standard deviation (D,) of each parameter over the frames of the fit.
    """

    kind: ClassVar[str] = "rig"

    settings: RigSettings
    all_curves: tuple[str, ...]
    moving: np.ndarray
    rest: np.ndarray
    all_ranges: np.ndarray
    deviations: np.ndarray

    @property
    def unit(self) -> str:
        """The unit of the curves, which is their own."""
        return UNITS[1]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the curves that move (D,)."""
        return tuple(
            name for name, moves in zip(self.all_curves, self.moving, strict=True) if moves
        )

    @property
    def ranges(self) -> np.ndarray:
        """The least and greatest value of each parameter, (D, 2)."""
        return np.asarray(self.all_ranges[self.moving])

    @property
    def least(self) -> np.ndarray:
        """The movement (D,) below which a parameter stands still: ``still`` of its range."""
        return np.asarray(self.settings.still * np.ptp(self.ranges, axis=1))

    @cached_property
    def groups(self) -> dict[str, tuple[int, ...]]:
        """Name of a group to its parameters (see :func:`dnnvss.face.base.name_groups`)."""
        return name_groups(self.names)

    @cached_property
    def gauges(self) -> dict[str, Gauge]:
        """Each curve by its name, and the sums of curves that the settings name."""
        size, rest = len(self.names), self.rest[self.moving]
        own = {
            name: Gauge(name, np.eye(size)[i], 0.0, self.unit, float(rest[i]))
            for i, name in enumerate(self.names)
        }
        sums = {
            name: self._sum(name, weights)
            for name, weights in self.settings.gauges.items()
            if set(weights) <= set(self.all_curves) and set(weights) & set(self.names)
        }
        return sums | own

    def _sum(self, name: str, weights: Mapping[str, float]) -> Gauge:
        vector = np.array([weights.get(curve, 0.0) for curve in self.all_curves])
        constant = float(vector[~self.moving] @ self.rest[~self.moving])
        return Gauge(name, vector[self.moving], constant, self.unit, float(vector @ self.rest))

    @property
    def contours(self) -> dict[str, list[int]]:
        """Nothing: a rig has no points."""
        return {}

    def points(self, parameters: np.ndarray) -> np.ndarray:
        """No points (..., 0, 2), for parameters (..., D)."""
        return np.zeros((*np.shape(parameters)[:-1], 0, 2))

    def jacobian(self) -> np.ndarray:
        """How no points move with each parameter, (D, 0, 2)."""
        return np.zeros((len(self.names), 0, 2))

    def curves(self, parameters: np.ndarray) -> np.ndarray:
        """All curves (..., C) within their ranges, for parameters (..., D)."""
        values = np.broadcast_to(self.rest, (*np.shape(parameters)[:-1], len(self.rest))).copy()
        values[..., self.moving] = parameters
        return np.clip(values, *self.all_ranges.T)

    def save(self, path: Path) -> Path:
        """Write the face as ``.npz``, its ``kind`` among the arrays, and return the path."""
        text = json.dumps({"format": _FORMAT, "settings": self.settings.to_dict()})
        return files.write_arrays(
            path,
            kind=np.array(self.kind),
            settings=np.array(text),
            curves=np.array(self.all_curves),
            moving=self.moving,
            rest=self.rest,
            ranges=self.all_ranges,
            deviations=self.deviations,
        )

    @classmethod
    def load(cls, path: Path) -> "RigFace":
        """The face that :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing, damaged or of another kind or format.
        """
        return files.read(path, _loaded, _REMEDY)


@dataclass(frozen=True, kw_only=True)
class _Kept:
    """The settings in the file of a rig."""

    format: int
    settings: Mapping[str, Any]


def _loaded(path: Path) -> RigFace:
    kind = str(read_declared(path, {"kind": Held((), "U")}, _REMEDY)["kind"])
    if kind != RigFace.kind:
        raise DnnvssError(f"holds a face of the kind {kind}", file=path, remedy=_REMEDY)
    arrays = read_declared(path, _ARRAYS, _REMEDY)
    kept = as_record(_Kept, json.loads(str(arrays["settings"])), path, _REMEDY)
    if kept.format != _FORMAT:
        raise DnnvssError(
            f"is of format {kept.format}, and this version reads {_FORMAT}",
            file=path,
            remedy=_REMEDY,
        )
    names = tuple(str(name) for name in arrays["curves"])
    if len(set(names)) < len(names) or arrays["moving"].sum() != len(arrays["deviations"]):
        raise DnnvssError("its curves are not those of its parameters", file=path, remedy=_REMEDY)
    return RigFace(
        RigSettings.from_dict(kept.settings),
        names,
        arrays["moving"],
        arrays["rest"],
        arrays["ranges"],
        arrays["deviations"],
    )
