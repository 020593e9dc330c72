"""A face's points as movement on a head: warped from its neutral, and as weights of the head's shapes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.lips import lip_pairs
from dnnvss.face.mesh.head import Head
from dnnvss.face.mesh.places import Places, match_contours
from dnnvss.face.mesh.volume import Warp, fit_warp, slopes
from dnnvss.face.mesh.weights import FitSettings, Told, fit_weights, what_is_told

_FLIP = np.array([1, -1, 1])
"""From points of a face, whose y runs down, to a head, whose y runs up."""
_HEED = {"lips_outer": 1.0, "lips_inner": 1.0, "face_oval": 0.5}
"""How much points of a group count; those of others count :data:`_ELSE`."""
_ELSE, _GAP = 0.3, 4.0
"""What other points count, and the distances between points of the lips that face each other."""
_LIPS = ("lips_inner", "lips_outer")
"""Rings whose opposite points tell the gap: the first of them that the face has."""
_OTHER_EYE = ("eye", "brow")
"""Beginnings of shapes that the points of mouth and jaw do not tell, where no eye or brow is among them."""


@dataclass(frozen=True)
class Fitted:
    """A take as weights of a head's shapes.

    Args:
        weights: (F, S) from 0 to 1.
        errors: what is left of the points' movement, RMS in each frame (F,), as a share of the mouth's width.
        ambiguous: shapes that move the points and whose weights these do not tell apart.
        unseen: shapes that do not move them; they stay at rest.
    """

    weights: np.ndarray
    errors: np.ndarray
    ambiguous: tuple[str, ...]
    unseen: tuple[str, ...]

    def lines(self) -> list[str]:
        """What the user is told, a line each."""
        rms = float(np.sqrt((self.errors**2).mean())) if len(self.errors) else 0.0
        worst = int(self.errors.argmax()) if len(self.errors) else 0
        told = [
            f"shapes: {rms:.1%} of the mouth's width RMS is not reached, at most "
            f"{self.errors.max(initial=0):.1%} (frame {worst})"
        ]
        if self.ambiguous:
            told.append(
                f"these points do not tell apart: {', '.join(_sides_joined(self.ambiguous))}"
            )
        return told


def _sides_joined(names: Sequence[str]) -> list[str]:
    """Names of which those of two sides stand once."""
    both = {name.removesuffix("Left") for name in names if name.endswith("Left")}
    both &= {name.removesuffix("Right") for name in names if name.endswith("Right")}
    short = [name.removesuffix("Left").removesuffix("Right") for name in names]
    pairs = zip(names, short, strict=True)
    return list(dict.fromkeys(f"{s}Left/Right" if s in both else name for name, s in pairs))


@dataclass(frozen=True)
class OnHead:
    """Where a face's points lie on a head, and the warp from its neutral to the head's.

    Args:
        head: the head.
        places: of the points that have one (n,).
        rows: which of the face's points these are.
        neutral: all points (P, 2 or 3) of the face at rest, y down.
        settings: how weights are found.
        kernel: of the warp.
    """

    head: Head
    places: Places
    rows: np.ndarray
    neutral: np.ndarray
    settings: FitSettings = field(default_factory=FitSettings)
    kernel: str = "linear"

    @classmethod
    def of(
        cls,
        head: Head,
        contours: Mapping[str, Sequence[int]],
        neutral: np.ndarray,
        settings: FitSettings | None = None,
    ) -> "OnHead":
        """The points of a face on a head, by the names of their groups.

        Args:
            head: the head.
            contours: group to its points, as a face has them.
            neutral: the points (P, 2 or 3) at rest, y down.
            settings: how weights are found.

        Raises:
            DnnvssError: no group runs round the lips, or the mouth has no width.
        """
        places, rows = match_contours(head, contours, neutral * _FLIP[: neutral.shape[1]])
        return cls(head, places, rows, neutral, settings or FitSettings())

    @cached_property
    def width(self) -> float:
        """The head's mouth from corner to corner, in its unit."""
        return float(np.ptp(self.head.mesh.vertices[self.head.curves["lips_outer"], 0]))

    @property
    def axes(self) -> int:
        """Coordinates of the face's points."""
        return int(self.neutral.shape[1])

    @cached_property
    def _at_rest(self) -> np.ndarray:
        return self.places.at(self.head.mesh.vertices)

    @cached_property
    def _lips(self) -> np.ndarray:
        return np.array([name.startswith("lips_outer") for name in self.places.names])

    @cached_property
    def _scale(self) -> float:
        own = float(np.ptp(self.neutral[self.rows][self._lips, 0]))
        if not own > 0:
            raise DnnvssError(
                "the mouth has no width at rest", remedy="Give the points of a face at rest"
            )
        return float(np.ptp(self._at_rest[self._lips, 0])) / own

    @cached_property
    def _flip(self) -> np.ndarray:
        """Signs (2 or 3,) that bring the face's axes to the head's; depth is told by which way the face bulges."""
        if self.axes == 2:
            return _FLIP[:2]
        own, goal = self.neutral[self.rows][:, 2], self._at_rest[:, 2]
        return _FLIP * [1, 1, -1 if (own - own.mean()) @ (goal - goal.mean()) < 0 else 1]

    def _lifted(self, points: np.ndarray) -> np.ndarray:
        """Points (..., n, 3) at the head's size and place; depth that the face lacks is the head's."""
        flip = self._flip
        centre = self.neutral[self.rows][self._lips].mean(axis=0)
        goal = self._at_rest[self._lips].mean(axis=0)
        own = (points[..., self.rows, :] - centre) * flip * self._scale + goal[: self.axes]
        if self.axes == 3:
            return np.asarray(own)
        depth = np.broadcast_to(self._at_rest[:, 2:], (*own.shape[:-1], 1))
        return np.concatenate([own, depth], axis=-1)

    def in_face(self, moved: np.ndarray) -> np.ndarray:
        """Small movement of the places (n, 3) on the head as movement (n, 2 or 3) of the face's points at rest."""
        turns = slopes(self.to_head, self._lifted(self.neutral))
        own = np.linalg.solve(turns + 1e-9 * np.eye(3), moved[..., None])[..., 0]
        return np.asarray(own[:, : self.axes] * self._flip / self._scale)

    @cached_property
    def to_head(self) -> Warp:
        """From the face's neutral, at the head's size, to the head's."""
        return fit_warp(self._lifted(self.neutral), self._at_rest, self.kernel)

    def movement(self, points: np.ndarray) -> np.ndarray:
        """How far the places move (F, n, 3) for points (F, P, 2 or 3), relative to the neutral."""
        return self.to_head(self._lifted(points)) - self.to_head(self._lifted(self.neutral))

    @cached_property
    def moved_by_shapes(self) -> np.ndarray:
        """How the head's shapes move the places (S, n, 3)."""
        return self.places.at(self.head.shapes).astype(float)

    @cached_property
    def told(self) -> Told:
        """Which of the head's shapes the points tell."""
        return what_is_told(self._heeded(self._basis), self.head.names, self.settings)

    @cached_property
    def _basis(self) -> np.ndarray:
        """How the shapes move the points (S, n, 2 or 3), none of those that other points would have to tell."""
        basis = self.moved_by_shapes[..., : self.axes].copy()
        for part in _OTHER_EYE:
            if not any(part in name for name in self.places.names):
                basis[[name.startswith(part) for name in self.head.names]] = 0
        return basis

    @cached_property
    def _heed(self) -> np.ndarray:
        """What is compared of the points (m, n): each by what it counts, and the gaps between the lips."""
        own = np.diag([_HEED.get(name[:-2], _ELSE) for name in self.places.names])
        rings = [[name.startswith(ring) for name in self.places.names] for ring in _LIPS]
        lips = next((np.flatnonzero(ring) for ring in rings if sum(ring) >= 4), None)
        if lips is None:
            return own
        pairs, _ = lip_pairs(self._at_rest[:, :2] * _FLIP[:2], lips)
        gaps = np.zeros((len(pairs), len(own)))
        gaps[np.arange(len(pairs)), pairs[:, 0]] = _GAP
        gaps[np.arange(len(pairs)), pairs[:, 1]] = -_GAP
        return np.concatenate([own, gaps])

    def _heeded(self, moved: np.ndarray) -> np.ndarray:
        """Movement (..., n, 2 or 3) as it is compared, flat."""
        return np.asarray(self._heed @ moved).reshape(len(moved), -1)

    def fit(self, points: np.ndarray) -> Fitted:
        """Weights of the head's shapes for points (F, P, 2 or 3) of the face, y down."""
        wanted = self.movement(points)[..., : self.axes]
        weights, seen = np.zeros((len(points), len(self.head.names))), self.told.seen
        names = np.array(self.head.names)
        weights[:, seen] = fit_weights(
            self._heeded(self._basis[seen]),
            self._heeded(wanted),
            names[seen].tolist(),
            self.settings,
        )
        left = np.tensordot(weights, self._basis, axes=1) - wanted
        errors = np.sqrt((left**2).sum(axis=2).mean(axis=1)) / self.width
        return Fitted(
            weights,
            errors,
            tuple(names[seen & ~self.told.clear].tolist()),
            tuple(names[~seen].tolist()),
        )
