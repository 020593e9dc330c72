"""How a head turns in a take: Live Link Face's angles as rotations about a place in its neck."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from dnnvss.face.mesh.surface import Mesh

ANGLES = ("HeadYaw", "HeadPitch", "HeadRoll")
_NECK = 0.3
"""Height of the place about which a head turns, as a share of the mesh's."""
_LOOKED = 60
"""Frames that tell how far a turning head reaches, beside those of the largest angles."""


@dataclass(frozen=True)
class Turns:
    """A head that turns.

    Args:
        rotations: of the frames (F, 3, 3).
        pivot: the place (3,) that stays.
    """

    rotations: np.ndarray
    pivot: np.ndarray

    @classmethod
    def of(cls, mesh: Mesh, curves: Mapping[str, np.ndarray]) -> "Turns | None":
        """The turns that curves (F,) by the names of :data:`ANGLES` (in any case) say; None where nothing turns.

        Angles are radians, or degrees where one of them lies beyond half a turn. ``HeadYaw`` turns to the talker's
        right, ``HeadPitch`` down, ``HeadRoll`` leans to the talker's left; yaw is applied last. These are the signs and
        the order of the angles of the eyes in a take of the app, where ``EyeLook...`` says the same by name.
        """
        known = {name.lower(): np.asarray(track, float) for name, track in curves.items()}
        found = [known.get(name.lower()) for name in ANGLES]
        tracks = [track for track in found if track is not None]
        if not any(np.any(track) for track in tracks):
            return None
        yaw, pitch, roll = (np.zeros(len(tracks[0])) if track is None else track for track in found)
        angles = np.stack([-yaw, pitch, -roll], axis=1)
        whole = Rotation.from_euler("YXZ", angles, degrees=bool(np.abs(angles).max() > np.pi))
        low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
        return cls(whole.as_matrix(), low + (high - low) * [0.5, _NECK, 0.5])

    def turned(self, vertices: np.ndarray, frame: int) -> np.ndarray:
        """Vertices (V, 3) as the head stands in a frame."""
        return (vertices - self.pivot) @ self.rotations[frame].T + self.pivot

    @property
    def quaternions(self) -> np.ndarray:
        """The rotations (F, 4) as x, y, z, w, neighbours on the same side."""
        made = Rotation.from_matrix(self.rotations).as_quat()
        signs = np.cumprod(np.where((made[1:] * made[:-1]).sum(axis=1) < 0, -1.0, 1.0))
        made[1:] *= signs[:, None]
        return np.asarray(made)

    def reach(self, mesh: Mesh) -> np.ndarray:
        """The least and greatest coordinates (2, 3) of a mesh that turns so."""
        flat = self.rotations.reshape(len(self.rotations), 9)
        looked = {*np.linspace(0, len(flat) - 1, _LOOKED).astype(int), *flat.argmin(axis=0), *flat.argmax(axis=0)}
        places = np.stack([self.turned(mesh.vertices, int(k)) for k in looked])
        return np.stack([places.min(axis=(0, 1)), places.max(axis=(0, 1))])
