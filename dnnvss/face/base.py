"""What every kind of face offers: named parameters, points, gauges, and its coding of recordings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Protocol, Self, runtime_checkable

import numpy as np

APERTURE, WIDTH, LOWER_LIP = "aperture", "width", "lower_lip"
"""The gauges that rules and lip metrics look for; a face that lacks one is told so by name."""


@dataclass(frozen=True)
class Gauge:
    """A named linear functional of the parameters: ``parameters @ vector + constant``.

    Args:
        name: as keys, curves and metrics call it.
        vector: weights (D,).
        constant: the value at parameters of zero.
        unit: of the value, ``px`` or the face's own.
        rest: the value when the face is at rest; that at parameters of zero where None.
    """

    name: str
    vector: np.ndarray
    constant: float
    unit: str = "px"
    rest: float | None = None

    def __call__(self, parameters: np.ndarray) -> np.ndarray:
        """Values (...,) of parameters (..., D)."""
        return np.asarray(parameters) @ self.vector + self.constant

    @property
    def at_rest(self) -> float:
        """The value when the face is at rest."""
        return self.constant if self.rest is None else self.rest


class Code(Protocol):
    """A recording as parameters of a face; kinds add what they need to put it back into its picture."""

    @property
    def parameters(self) -> np.ndarray:
        """(F, D) float32; frames that were not measured are interpolated between their neighbours."""
        ...

    @property
    def valid(self) -> np.ndarray:
        """(F,) bool, whether a frame was measured, or lies in a gap that is short enough to be bridged."""
        ...

    @property
    def outliers(self) -> Mapping[str, Sequence[int]]:
        """Reason to the frames that were measured and not believed."""
        ...

    def save(self, path: Path, **more: np.ndarray) -> Path:
        """Write the code, and ``more`` arrays beside it, as ``.npz``; return the path."""
        ...

    @classmethod
    def load(cls, path: Path) -> Self:
        """The code that :meth:`save` wrote."""
        ...


class Face(Protocol):
    """A face of any kind. Rules, constraints, metrics, keys, curves and streaming are written against this alone."""

    kind: ClassVar[str]

    @property
    def names(self) -> tuple[str, ...]:
        """The name of each parameter (D,)."""
        ...

    @property
    def deviations(self) -> np.ndarray:
        """The standard deviation (D,) of each parameter over the frames of the fit."""
        ...

    @property
    def groups(self) -> Mapping[str, tuple[int, ...]]:
        """Name of a group to the positions of its parameters."""
        ...

    @property
    def unit(self) -> str:
        """The unit of points and of gauges that are distances."""
        ...

    @property
    def gauges(self) -> Mapping[str, Gauge]:
        """The named functionals of the parameters; not all faces have all of them."""
        ...

    @property
    def contours(self) -> Mapping[str, Sequence[int]]:
        """Name of a line to the points (of P) that it runs through, to be drawn."""
        ...

    def points(self, parameters: np.ndarray) -> np.ndarray:
        """Points (..., P, 2 or 3) in the face's reference frame, for parameters (..., D); y points down."""
        ...

    def jacobian(self) -> np.ndarray:
        """How the points move with each parameter at parameters of zero, (D, P, 2 or 3)."""
        ...

    def save(self, path: Path) -> Path:
        """Write the face as ``.npz``, its ``kind`` among the arrays, and return the path."""
        ...

    @classmethod
    def load(cls, path: Path) -> Self:
        """The face that :meth:`save` wrote."""
        ...


@runtime_checkable
class Textured(Protocol):
    """A face that can draw itself with the talker's skin."""

    def picture(self, parameters: np.ndarray, zoom: float = 1.0) -> np.ndarray:
        """The picture, uint8 RGB (H, W_, 3), of parameters (D,) on white."""
        ...


@runtime_checkable
class Regional(Protocol):
    """A face that shows more than points in a region: texture too."""

    def region(self, points: Sequence[int]) -> np.ndarray:
        """The form (D, D) of the region of some points, see :func:`region_form`."""
        ...


@runtime_checkable
class Ranged(Protocol):
    """A face whose parameters have ranges, so that it is known when one stands still."""

    @property
    def least(self) -> np.ndarray:
        """The movement (D,) from the least to the greatest value below which a parameter stands still."""
        ...


def moving(face: Face | None, parameters: np.ndarray, frames: np.ndarray) -> np.ndarray:
    """Parameters (T, D), of which those that stand still in some frames (T,) bool do so at their mean, exactly.

    Nothing can be measured of them. A face without ranges has none.
    """
    if not isinstance(face, Ranged) or not frames.any():
        return parameters
    still = np.ptp(parameters[frames], axis=0) < face.least
    return np.where(still, parameters[frames].mean(axis=0), parameters)


def region_form(face: Face, points: Sequence[int]) -> np.ndarray:
    """How large a change of the parameters looks at some points: ``c' G c`` for a change c (D,), as G (D, D).

    Squares of the points' movement, and of the texture's change beside them where the face has one.
    """
    if isinstance(face, Regional):
        return face.region(points)
    moved = face.jacobian()[:, list(points)].reshape(len(face.names), -1)
    return moved @ moved.T


def name_groups(names: Sequence[str]) -> dict[str, tuple[int, ...]]:
    """Groups of parameters by their names: all that differ only in their number, and each by itself.

    ``shape`` holds the positions of ``shape01``, ``shape02``, ...
    """
    kinds = [name.rstrip("0123456789") for name in names]
    groups = {kind: tuple(i for i, own in enumerate(kinds) if own == kind) for kind in dict.fromkeys(kinds)}
    return groups | {name: (i,) for i, name in enumerate(names)}


def largest_groups(groups: Mapping[str, Sequence[int]]) -> dict[str, tuple[int, ...]]:
    """The largest groups of parameters that share none, such as all of shape and all of texture."""
    found: dict[str, tuple[int, ...]] = {}
    for name, group in sorted(groups.items(), key=lambda item: -len(item[1])):
        if not any(set(group) & set(other) for other in found.values()):
            found[name] = tuple(group)
    return {name: found[name] for name in groups if name in found}
