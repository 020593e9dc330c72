"""Light that changes within a clip: measured on the skin of every frame, and taken out.

A frame's texture under another light is taken to be the clip's own with another gain, offset and slope of each
channel: ``t = g (m + b + p x + q y)`` over the texture's places ``(x, y)``, with ``m`` the clip's mean.
"""

from dataclasses import dataclass

import numpy as np

from dnnvss.face.aam.mesh import Warp
from dnnvss.face.point_set import Layout

_PIXELS = 400
"""Pixels of the skin that the light is measured on."""
_ROUNDS = 4
"""Of the robust fit; more change nothing that is seen."""
_KNEE = 4.0
"""Grey levels from which a pixel's misfit counts by its size and no longer by its square."""
_GAIN = 2.5
"""What multiplies or divides the contrast by more is no light: a white frame, or a hand before the face."""
_FULL = 4
"""Grey levels from black or white within which a pixel holds nothing."""
_SAME = np.array([1.0, 0.0, 0.0, 0.0])
STEADY = 6.0
"""Grey levels (RMS over the skin) by which a frame may differ from its clip before that is light: the shades of moving
jaws and cheeks come to 5 on GRID (24 of 25 validation clips; the other comes to 36)."""


@dataclass(frozen=True)
class Skin:
    """Where a model's textures show skin, outside the lips.

    Args:
        rows: the pixels (n,) among the texture's N that are looked at.
        places: every pixel's place (N, 2) on the texture's shape, from -1 to 1.
    """

    rows: np.ndarray
    places: np.ndarray

    @classmethod
    def of(cls, warp: Warp, layout: Layout) -> "Skin":
        """The skin of a mesh."""
        lips = np.union1d(layout.inner, layout.outer)
        rows = np.flatnonzero(np.asarray(warp.matrix[:, lips].sum(axis=1)).ravel() < 0.5)
        places = np.column_stack([warp.pixels % warp.size[1], warp.pixels // warp.size[1]]).astype(np.float32)
        low, high = places.min(axis=0), places.max(axis=0)
        return cls(rows[:: max(1, len(rows) // _PIXELS)], 2 * (places - low) / np.maximum(high - low, 1) - 1)

    def lights(self, textures: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """The light (F, 3, 4) of textures (F, N, 3): gain, offset and slopes of each channel against ``centre`` (N, 3).

        Weighted least squares in rounds, a pixel far from the fit with less weight (Huber 1964), so that what covers
        a part of the skin does not count as light. A frame whose contrast no light explains, or whose skin is mostly
        black or white, is left as it is.
        """
        seen = textures[:, self.rows].astype(np.float64)
        lights = np.stack([_fitted(self._basis(centre[self.rows, c], self.rows), seen[..., c]) for c in range(3)],
                          axis=1)
        full = ((seen >= 255 - _FULL) | (seen <= _FULL)).mean(axis=1) > 0.5
        strange = full | (lights[..., 0] < 1 / _GAIN) | (lights[..., 0] > _GAIN)
        lights[strange.any(axis=1)] = _SAME
        return lights

    def change(self, lights: np.ndarray, centre: np.ndarray) -> np.ndarray:
        """How far lights (F, 3, 4) carry the skin of ``centre`` (N, 3), RMS in grey levels (F,)."""
        gaps = [self._basis(centre[self.rows, c], self.rows) @ (lights[:, c] - _SAME).T for c in range(3)]
        return np.sqrt((np.stack(gaps) ** 2).mean(axis=(0, 1)))

    def taken_out(self, textures: np.ndarray, lights: np.ndarray) -> np.ndarray:
        """Textures (F, N, 3) uint8 as they are under the light of ``centre``, one frame at a time."""
        everywhere = self._basis(np.zeros(len(self.places)), slice(None))[:, 1:]
        out = np.empty_like(textures)
        for own, light, into in zip(textures, lights, out, strict=True):
            even = (own - everywhere @ light[:, 1:].T) / light[:, 0]
            into[:] = np.clip(even, 0, 255).round()
        return out

    def _basis(self, centre: np.ndarray, rows: np.ndarray | slice) -> np.ndarray:
        return np.column_stack([centre, np.ones(len(centre)), self.places[rows]]).astype(np.float64)


def steadied(skin: Skin, textures: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Textures (F, N, 3) uint8 of a clip whose light does not change; those that were given where it hardly does.

    Where the light of any valid frame (F,) is more than :data:`STEADY` from the clip's mean, every frame is brought
    to the light of the mean, so that no step is left where the light jumps.
    """
    if not valid.any():
        return textures
    centre = textures[valid].mean(axis=0, dtype=np.float64)
    lights = skin.lights(textures, centre)
    if not (skin.change(lights, centre)[valid] > STEADY).any():
        return textures
    return skin.taken_out(textures, lights)


def _fitted(basis: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Coefficients (F, 4) of values (F, n) on a basis (n, 4), robustly."""
    ridge = 1e-9 * np.trace(basis.T @ basis) * np.eye(basis.shape[1])
    weight, width = np.ones_like(seen), basis.shape[1]
    squares = (basis[:, :, None] * basis[:, None]).reshape(len(basis), -1)  # sums over pixels are products of matrices
    for _ in range(_ROUNDS):
        normal = (weight @ squares).reshape(-1, width, width) + ridge
        found = np.linalg.solve(normal, ((weight * seen) @ basis)[..., None])[..., 0]
        gap = np.abs(seen - found @ basis.T)
        weight = _KNEE / np.maximum(gap, _KNEE)
    return found
