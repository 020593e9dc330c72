"""Schemes of points that a person labels, each group with the layout that starts the labelling.

Layouts are in eye distances: the middle between the pupils is (0, 0), the pupils lie at (-0.5, 0) and (0.5, 0) as
the picture has them, and y goes down. They are drawn from arcs and lines; a person moves them into place.
"""

from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.formats.landmarks import LAYOUT_68

MOUTH = (0.0, 1.15)
"""Where the layouts have the middle of the mouth."""


@dataclass(frozen=True)
class Group:
    """A line of points.

    Args:
        name: landmark group, as corpora and ``conf/aam`` name it.
        layout: starting places (n, 2) in eye distances, in the group's order.
        closed: the line returns to its first point.
    """

    name: str
    layout: np.ndarray
    closed: bool = False


@dataclass(frozen=True)
class Scheme:
    """A named set of points to label.

    Args:
        name: what ``--scheme`` is given.
        title: a line about it.
        parts: its groups; their points follow each other in the files.
    """

    name: str
    title: str
    parts: tuple[Group, ...]

    @property
    def groups(self) -> dict[str, tuple[int, int]]:
        """Landmark group to the half-open range of its rows, as ``CorpusInfo.landmark_groups`` has them."""
        edges = np.cumsum([0, *[len(g.layout) for g in self.parts]]).tolist()
        return {g.name: (a, b) for g, a, b in zip(self.parts, edges[:-1], edges[1:], strict=True)}

    @property
    def layout(self) -> np.ndarray:
        """The starting layout (P, 2) in eye distances."""
        return np.concatenate([g.layout for g in self.parts])

    def __len__(self) -> int:
        """The number of points P."""
        return len(self.layout)


def _arc(centre: tuple[float, float], width: float, height: float, first: float, last: float, count: int) -> np.ndarray:
    """Return points (n, 2) on an ellipse; 0 degrees is right, 90 down, 180 left, 270 up."""
    angle = np.deg2rad(np.linspace(first, last, count))
    return np.column_stack([centre[0] + width / 2 * np.cos(angle), centre[1] + height / 2 * np.sin(angle)])


def _ring(centre: tuple[float, float], width: float, height: float, count: int) -> np.ndarray:
    """Return points (n, 2) round a closed ellipse, from its left corner over the top."""
    return _arc(centre, width, height, 180, 540, count + 1)[:-1]


def _lips(outer: int, inner: int) -> tuple[Group, Group]:
    return (Group("lips_outer", _ring(MOUTH, 0.84, 0.36, outer), closed=True),
            Group("lips_inner", _ring(MOUTH, 0.7, 0.12, inner), closed=True))


def _eyes(count: int) -> tuple[Group, Group]:
    rings = (_ring((x, 0.0), 0.46, 0.16, count) for x in (-0.5, 0.5))
    right, left = (Group(n, r, closed=True) for n, r in zip(("right_eye", "left_eye"), rings, strict=True))
    return right, left


def _brows(count: int) -> tuple[Group, Group]:
    right, left = (_arc((x, -0.22), 0.72, 0.26, 195, 345, count) for x in (-0.54, 0.54))
    return Group("right_brow", right), Group("left_brow", left)


def _jaw(name: str, count: int, first: float = 180.0) -> Group:
    """Return the line along the jaw, from the left of the picture over the chin."""
    return Group(name, _arc((0.0, 0.25), 2.2, 3.2, first, 180 - first, count))


_BRIDGE = Group("nose_bridge", np.column_stack([np.zeros(4), np.linspace(0.02, 0.56, 4)]))
_BASE = Group("nose_base", _arc((0.0, 0.7), 0.6, 0.18, 180, 0, 5))
_CORNERS = tuple(Group(n, np.array([[x - 0.22, 0.02], [x + 0.22, 0.02]]))
                 for n, x in (("right_eye", -0.5), ("left_eye", 0.5)))
_TOP = Group("nose_bridge", np.array([[0.0, 0.02], [0.0, 0.3]]))

_ALL = (
    Scheme("lips_jaw_nostrils", "34 points of lips, jaw and nostrils (Thangthai, Theobald 2016), and 6 that speech "
           "does not move: corners of the eyes and bridge of the nose, on which head pose is measured",
           (*_lips(12, 8), _jaw("jaw", 9, 152.0), _BASE, *_CORNERS, _TOP)),
    Scheme("ibug68", "the 68 points of iBUG 300-W, in its order",
           (_jaw("face_oval", 17), *_brows(5), _BRIDGE, _BASE, *_eyes(6), *_lips(12, 8))),
    Scheme("face100", "100 points of the whole face (Theobald et al. 2003 label about as many)",
           (_jaw("face_oval", 23), *_brows(7), _BRIDGE, Group("nose_base", _arc((0.0, 0.7), 0.6, 0.18, 180, 0, 7)),
            *_eyes(8), *_lips(20, 16))),
)
SCHEMES = {scheme.name: scheme for scheme in _ALL}
"""Every scheme by its name."""

if SCHEMES["ibug68"].groups != LAYOUT_68 or len(SCHEMES["face100"]) != 100:
    raise AssertionError("a scheme of points does not have the points that its name promises")


def find_scheme(name: str) -> Scheme:
    """Return the scheme of a name.

    Raises:
        DnnvssError: there is none.
    """
    if name not in SCHEMES:
        raise DnnvssError(f"there is no scheme of points {name!r}", remedy=f"Use one of {', '.join(SCHEMES)}")
    return SCHEMES[name]
