"""Parts of a face (mouth, jaw, eyes) as models of their own, side by side in one model.

Each part has its points and the texture pixels of its triangles, and no two share any. The modes of a part are zero
outside it, so that parameters of all parts stand next to each other and one model encodes and decodes them.

**Source**: Cosker et al. 2004, section 3 (a hierarchy of facial areas, each with a model); their textures overlap and
are joined through the parent's model, ours meet at the triangles' edges.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.mesh import Warp
from dnnvss.face.point_set import Layout
from dnnvss.settings import check_settings, setting, shown


@dataclass(frozen=True)
class Part:
    """A sub-model.

    Args:
        name: in front of its parameters' numbers, e.g. ``mouth`` for ``mouth01``.
        groups: the modelled landmark groups that are its own.
        modes: how many, or the share of variance below 1; 0 takes the model's, as the separate kind always does.
    """

    name: str
    groups: tuple[str, ...]
    modes: int | float = setting(0, least=0)

    def __post_init__(self) -> None:
        check_settings(self, "aam.parts")
        if not self.name or not self.groups:
            raise DnnvssError(f"aam.parts: {shown(self.to_dict())} has no name or no groups",
                              remedy="Give each part a name and the landmark groups that are its own")

    def to_dict(self) -> dict[str, Any]:
        """Return plain containers, as a file of ``conf/aam`` holds them."""
        return {"name": self.name, "groups": list(self.groups), "modes": self.modes}


@dataclass(frozen=True)
class Support:
    """What a part owns of a row: columns of the shape (2P) and of the texture (3N), and how many modes it has."""

    shape: np.ndarray
    texture: np.ndarray
    modes: float


def supports(parts: Sequence[Part], layout: Layout, warp: Warp) -> tuple[Support, ...]:
    """Return what each part owns; a triangle between parts goes to the one that most of its corners belong to.

    Raises:
        DnnvssError: a group that is not modelled, is in two parts or in none.
    """
    if not parts:
        return ()
    owner = _owners(parts, layout)
    corners = owner[warp.triangles]
    agreed = np.where((corners[:, 1] == corners[:, 2]), corners[:, 1], corners[:, 0])
    triangles = {tuple(sorted(t)): int(o) for t, o in zip(warp.triangles.tolist(), agreed, strict=True)}
    meshes = np.sort(warp.matrix.indices.reshape(-1, 3), axis=1)
    pixels = np.array([triangles[tuple(mesh)] for mesh in meshes.tolist()])
    return tuple(Support(_columns(owner == k, 2), _columns(pixels == k, 3), part.modes) for k, part in enumerate(parts))


def part_names(parts: Sequence[Part], layout: Layout, shape_modes: np.ndarray, texture_modes: np.ndarray,
               warp: Warp) -> tuple[str, ...]:
    """Return the names of the parameters (D,), each part's counted from 1."""
    found: list[str] = []
    for part, own in zip(parts, supports(parts, layout, warp), strict=True):
        shapes = shape_modes.reshape(len(shape_modes), -1)[:, own.shape]
        textures = texture_modes.reshape(len(texture_modes), -1)[:, own.texture]
        count = int((shapes.any(axis=1) | textures.any(axis=1)).sum())
        found += [f"{part.name}{i + 1:02d}" for i in range(count)]
    return tuple(found)


def _owners(parts: Sequence[Part], layout: Layout) -> np.ndarray:
    """Return the part (P,) of each point."""
    owner = np.full(len(layout.rows), -1)
    for k, part in enumerate(parts):
        for group in part.groups:
            if group not in layout.groups:
                raise DnnvssError(f"aam.parts: {part.name} has the group {group!r}, which is not modelled",
                                  remedy=f"Use some of {', '.join(layout.groups)}")
            if (owner[layout.groups[group]] >= 0).any():
                raise DnnvssError(f"aam.parts: {group!r} is in two parts", remedy="Give each group to one part")
            owner[layout.groups[group]] = k
    if (owner < 0).any():
        missing = next(g for g, points in layout.groups.items() if (owner[points] < 0).any())
        raise DnnvssError(f"aam.parts: {missing!r} is in no part", remedy="Give each modelled group to one part")
    return owner


def _columns(mask: np.ndarray, width: int) -> np.ndarray:
    """Return the flat positions of the masked rows of an array with ``width`` columns."""
    return (np.flatnonzero(mask)[:, None] * width + np.arange(width)).ravel()
