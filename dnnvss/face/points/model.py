"""A face of points: the shape of mouth and jaw as a few linear parameters, without texture."""

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
from dnnvss.face.lips import mouth_gauges
from dnnvss.face.point_set import Layout
from dnnvss.face.points.code import PointsCode
from dnnvss.face.points.pose import Reference, SpaceReference, put_back, taken_out
from dnnvss.face.points.settings import PointsSettings
from dnnvss.face.pose import PoseReference
from dnnvss.records import as_record
from dnnvss.settings import setting

_FORMAT = 1
_REMEDY = "Train again, or delete the file and run the same command"


@dataclass(frozen=True)
class PointLimits:
    """The largest values that a frame may have; one above them is an outlier.

    Args:
        stable: RMS distance of the stable points from the reference.
        shape: distance of the shape from its clip's median, in robust standard deviations.
        parameters: root mean square of the parameters in standard deviations of their modes.
    """

    stable: float
    shape: float
    parameters: float


@dataclass(frozen=True)
class PointsFace:
    """A fitted face. Shapes live in the reference frame, in pixels (2-D) or millimetres (3-D).

    With the mean shape ``m`` (P, 2 or 3) and orthonormal modes ``S`` (D, P, 2 or 3), decoding is ``x = m + c S`` and
    encoding ``c = (x - m) S'``.

    Args:
        settings: that it was fitted with.
        landmark_groups: of the corpus.
        reference: stable points of the reference frame.
        mean: (P, 2 or 3).
        modes: (D, P, 2 or 3).
        deviations: standard deviation (D,) of each parameter over the frames of the fit.
        spread: robust standard deviation (P, 2 or 3) of each coordinate about its clip's median.
        limits: what a frame may measure before it is an outlier.
        whole_mean: all landmarks (L, 2 or 3) at parameters of zero, to be drawn.
        whole_modes: how they move with the parameters (D, L, 2 or 3), as far as these tell it.
    """

    kind: ClassVar[str] = "points"

    settings: PointsSettings
    landmark_groups: dict[str, tuple[int, int]]
    reference: Reference
    mean: np.ndarray
    modes: np.ndarray
    deviations: np.ndarray
    spread: np.ndarray
    limits: PointLimits
    whole_mean: np.ndarray
    whole_modes: np.ndarray

    @cached_property
    def layout(self) -> Layout:
        """The modelled, stable and mouth rows of a landmark array."""
        return self.settings.points.layout(self.landmark_groups)

    @property
    def size(self) -> int:
        """The number of parameters D."""
        return len(self.deviations)

    @property
    def dimensions(self) -> int:
        """Coordinates of a point, 2 or 3."""
        return int(self.mean.shape[1])

    @property
    def unit(self) -> str:
        """Pixels of the reference frame, or millimetres."""
        return UNITS[self.dimensions]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """``shape01``, ...; where parameters are the points themselves, ``lips_outer_x01``, ..."""
        if self.settings.modes != "raw":
            return tuple(f"shape{i + 1:02d}" for i in range(self.size))
        named = [(group, i + 1) for group, rows in self.layout.groups.items() for i in range(len(rows))]
        return tuple(f"{group}_{axis}{i:02d}" for group, i in named for axis in "xyz"[: self.dimensions])

    @cached_property
    def groups(self) -> dict[str, tuple[int, ...]]:
        """Name of a group to the positions of its parameters (see :func:`dnnvss.face.base.name_groups`)."""
        return name_groups(self.names)

    @cached_property
    def gauges(self) -> dict[str, Gauge]:
        """Aperture, lower lip and width of the mouth (see :func:`dnnvss.face.lips.mouth_gauges`)."""
        return mouth_gauges(self.mean, self.modes, self.layout.outer, self.layout.inner, self.unit)

    @cached_property
    def contours(self) -> dict[str, list[int]]:
        """Modelled landmark group to its points, to be drawn as a line."""
        return {name: rows.tolist() for name, rows in self.layout.groups.items()}

    def points(self, parameters: np.ndarray) -> np.ndarray:
        """Points (..., P, 2 or 3) in the reference frame for parameters (..., D)."""
        return self.mean + np.tensordot(parameters, self.modes, axes=1)

    def whole(self, parameters: np.ndarray) -> np.ndarray:
        """All landmarks (..., L, 2 or 3) in the reference frame for parameters (..., D).

        Those that are not modelled move as they usually did with these parameters.
        """
        return self.whole_mean + np.tensordot(parameters, self.whole_modes, axes=1)

    def jacobian(self) -> np.ndarray:
        """How the points move with each parameter, (D, P, 2 or 3)."""
        return self.modes

    def project(self, shapes: np.ndarray) -> np.ndarray:
        """The parameters (F, D) of reference shapes (F, P, 2 or 3) less the mean."""
        return (shapes.reshape(len(shapes), -1) @ self.modes.reshape(self.size, -1).T).astype(np.float32)

    def stabilise(self, points: np.ndarray, code: PointsCode) -> np.ndarray:
        """Tracked landmarks (F, L, 2 or 3) as points (F, P, 2 or 3) without head pose and the clip's own mean."""
        own = points[:, self.layout.rows].astype(float)
        return taken_out(own, code.pose, self.reference) - code.shape_offset

    def place(self, code: PointsCode) -> np.ndarray:
        """The points (F, P, 2 or 3) of a clip where it was recorded."""
        return put_back(self.points(code.parameters) + code.shape_offset, code.pose, self.reference)

    def save(self, path: Path) -> Path:
        """Write the face as ``.npz``, its ``kind`` among the arrays, and return the path."""
        text = json.dumps({"format": _FORMAT, "settings": self.settings.to_dict(), "groups": self.landmark_groups,
                           "limits": vars(self.limits)})
        return files.write_arrays(
            path, kind=np.array(self.kind), settings=np.array(text), stable=self.reference.stable, mean=self.mean,
            modes=self.modes, deviations=self.deviations, spread=self.spread, whole_mean=self.whole_mean,
            whole_modes=self.whole_modes)

    @classmethod
    def load(cls, path: Path) -> "PointsFace":
        """The face that :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing, damaged or of another kind or format.
        """
        return files.read(path, _loaded, _REMEDY)


def _loaded(path: Path) -> PointsFace:
    kind = str(read_declared(path, {"kind": Held((), "U")}, _REMEDY)["kind"])
    if kind != PointsFace.kind:
        raise DnnvssError(f"holds a face of the kind {kind}", file=path, remedy=_REMEDY)
    arrays = read_declared(path, _ARRAYS, _REMEDY)
    text = json.loads(str(arrays["settings"]))
    written = text.get("format") if isinstance(text, dict) else None
    if written != _FORMAT:
        raise DnnvssError(f"is of format {written}, and this version reads {_FORMAT}", file=path, remedy=_REMEDY)
    kept = as_record(_Kept, text, path, _REMEDY)
    settings = PointsSettings.from_dict(kept.settings)
    reference = (PoseReference if arrays["stable"].shape[1] == 2 else SpaceReference)(
        arrays["stable"], settings.pose_smoothing)
    face = PointsFace(settings, dict(kept.groups), reference, arrays["mean"], arrays["modes"], arrays["deviations"],
                      arrays["spread"], kept.limits, arrays["whole_mean"], arrays["whole_modes"])
    if len(face.layout.rows) != len(face.mean) or len(face.layout.stable) != len(arrays["stable"]):
        raise DnnvssError("its points are not those of its landmark groups", file=path, remedy=_REMEDY)
    return face


@dataclass(frozen=True, kw_only=True)
class _Kept:
    """The settings in the file of a face."""

    format: int
    settings: Mapping[str, Any]
    groups: Mapping[str, tuple[int, int]] = setting(least=0)
    limits: PointLimits


_ARRAYS = {
    "kind": Held((), "U"), "settings": Held((), "U"), "stable": Held(("S", "d")), "mean": Held(("P", "d")),
    "modes": Held(("D", "P", "d")), "deviations": Held(("D",)), "spread": Held(("P", "d")),
    "whole_mean": Held(("L", "d")), "whole_modes": Held(("D", "L", "d"))}
