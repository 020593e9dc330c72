"""Parts of a face within each other: what each shows in the face's own parameters, and how they are joined.

Everything is linear in the D parameters of the face. A part sees a change c of them with the size ``c' G c``, where G
is the face's form of its region: the squares of the points' and the texture's changes there.

**Source**: Cosker et al. 2004, section 5.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.base import Face, region_form
from dnnvss.settings import check_settings, setting

ROOT = "face"


@dataclass(frozen=True)
class Part:
    """A part of a face by its landmark groups.

    Args:
        name: of the part.
        groups: lines of the face that are its own.
        parent: the part that it is in; ``face`` is the whole.
    """

    name: str
    groups: tuple[str, ...]
    parent: str = setting(ROOT, doc="the part that it is in")

    def __post_init__(self) -> None:
        check_settings(self, "model.nodes")
        if not self.name or not self.groups or self.name in (ROOT, self.parent):
            raise DnnvssError(f"model.nodes: {self.name!r} has no name of its own or no groups",
                              remedy="Give each part a name and the landmark groups that are its own")


@dataclass(frozen=True)
class Region:
    """A part as the parameters see it: its parent's name (empty of the root), and its form (D, D)."""

    parent: str
    form: np.ndarray


def regions(face: Face, parts: Sequence[Part]) -> dict[str, Region]:
    """The root and the parts of a face, each behind its parent.

    Raises:
        DnnvssError: a group that the face does not have, a parent that does not come before, or parts that overlap.
    """
    points = {ROOT: frozenset(range(face.jacobian().shape[1]))}
    found = {ROOT: Region("", region_form(face, sorted(points[ROOT])))}
    for part in parts:
        if unknown := [g for g in part.groups if g not in face.contours]:
            raise DnnvssError(f"model.nodes: the face has no group {unknown[0]!r}",
                              remedy=f"Use some of {', '.join(face.contours)}")
        own = frozenset(p for group in part.groups for p in face.contours[group])
        beside = [name for name, other in found.items() if other.parent == part.parent and points[name] & own]
        if part.parent not in found or not own <= points[part.parent] or beside:
            raise DnnvssError(f"model.nodes: {part.name} is not inside {part.parent}, or overlaps another part",
                              remedy="Name parents first, and give each part groups of its own")
        points[part.name] = own
        found[part.name] = Region(part.parent, region_form(face, sorted(own)))
    return found


@dataclass(frozen=True)
class Appearance:
    """The appearance parameters (m) of a part: ``b = read c``, and the least change of the face that shows them,
    ``c = show b``, for parameters c (D) less their mean."""

    read: np.ndarray
    show: np.ndarray


def appearance(form: np.ndarray, covariance: np.ndarray, share: float) -> Appearance:
    """The principal components of a region over frames whose parameters have a covariance (D, D).

    Args:
        form: of the region.
        covariance: of the parameters.
        share: of the region's variance that they explain.
    """
    values, vectors = np.linalg.eigh(form)
    known = values > 1e-9 * values[-1]
    root, inverse = ((vectors[:, known] * values[known] ** power) @ vectors[:, known].T for power in (0.5, -0.5))
    variance, modes = np.linalg.eigh(root @ covariance @ root)
    variance, modes = np.maximum(variance[::-1], 0), modes[:, ::-1]
    kept = min(int(known.sum()), int(np.searchsorted(np.cumsum(variance), share * variance.sum() * (1 - 1e-9))) + 1)
    return Appearance(modes[:, :kept].T @ root, inverse @ modes[:, :kept])


def joined(found: Mapping[str, Region], shown: Mapping[str, Appearance], said: Mapping[str, np.ndarray],
           precedence: float) -> np.ndarray:
    """The parameters (T, D), less their mean, of a face whose parts were predicted apart, from the leaves upward.

    A parent takes over its children and is brought back into what its own model can show: the parameters of least
    ``precedence * (its children)^2 + (the rest of itself)^2``. With 1 that is the projection of the composed texture
    through the parent's model; more gives lower parts precedence.

    Args:
        found, shown: regions and appearance models by name, parents first.
        said: appearance parameters (T, m) of each part.
        precedence: weight of children against the rest of their parent.
    """
    changes = {name: said[name] @ shown[name].show.T for name in found}
    for name in reversed(list(found)):
        children = [child for child, region in found.items() if region.parent == name]
        if children:
            inner = sum((found[child].form for child in children), np.zeros_like(found[name].form))
            rest, show = found[name].form - inner, shown[name].show
            wanted = changes[name] @ rest + precedence * sum(changes[c] @ found[c].form for c in children)
            solved = np.linalg.solve(show.T @ (rest + precedence * inner) @ show, show.T @ wanted.T)
            changes[name] = (show @ solved).T
    return changes[ROOT]
