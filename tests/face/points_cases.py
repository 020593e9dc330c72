"""A face of points whose movement and head pose are known."""

from collections.abc import Callable

import numpy as np
from scipy.spatial.transform import Rotation

from dnnvss.face.clips import Clip
from dnnvss.face.point_set import PointSet
from dnnvss.face.points import PointsSettings

GROUPS = {"eyes": (0, 4), "lips_outer": (4, 10), "lips_inner": (10, 14), "jaw": (14, 17), "brow": (17, 19)}
SETTINGS = PointsSettings(
    points=PointSet("case", {"lips_outer": "all", "lips_inner": "all", "jaw": "all"}, {"eyes": "all"}, eyes=()),
    pose_smoothing=0.0, modes=2)
ROWS = np.arange(4, 17)


def shape(dimensions: int) -> np.ndarray:
    """Landmarks (19, 2 or 3) at rest: x to the right, y down, z away from the viewer."""
    flat = np.array([
        [20, 40], [40, 41], [60, 41], [80, 40],
        [34, 80], [42, 76], [58, 76], [66, 80], [58, 88], [42, 88],
        [38, 80], [50, 78], [62, 80], [50, 84],
        [30, 100], [50, 110], [70, 100],
        [30, 30], [70, 30]], dtype=float)
    depth = 0.01 * (flat[:, 0] - 50) ** 2
    return flat if dimensions == 2 else np.column_stack([flat, depth])


def planted(dimensions: int) -> np.ndarray:
    """Two orthonormal modes (2, 13, 2 or 3): lower lip and jaw go down; corners go in."""
    modes = np.zeros((2, 13, dimensions))
    modes[0, [4, 5, 9], 1] = 1.0
    modes[0, [10, 11, 12], 1] = 0.8
    modes[1, [0, 6], 0] = 1.0
    modes[1, [3, 8], 0] = -1.0
    return modes / np.sqrt((modes**2).sum(axis=(1, 2), keepdims=True))


def movement(clip: int, frames: int = 200) -> np.ndarray:
    """Parameters (frames, 2) with mean 0 over the clip and no correlation."""
    turn = 2 * np.pi * np.arange(frames) / frames
    return np.column_stack([9 * np.sin((clip + 2) * turn), 4 * np.cos((clip + 3) * turn)])


def recorded(dimensions: int, clip: int, pose: Callable[[np.ndarray, int], np.ndarray] | None = None,
             frames: int = 200) -> np.ndarray:
    """Landmarks (frames, 19, 2 or 3) of a clip that moves, under a pose of each frame."""
    points = np.tile(shape(dimensions), (frames, 1, 1))
    points[:, ROWS] += np.tensordot(movement(clip, frames), planted(dimensions), axes=1)
    return points if pose is None else np.stack([pose(p, i) for i, p in enumerate(points)])


def turned(dimensions: int, seed: int) -> Callable[[np.ndarray, int], np.ndarray]:
    """A similarity for each frame: small turns, a scale round 1, and a shift."""
    rng = np.random.default_rng(seed)
    angles = rng.normal(0, 5, (1000, 3))
    scales, shifts = rng.uniform(0.9, 1.1, 1000), rng.normal(0, 20, (1000, dimensions))

    def pose(points: np.ndarray, frame: int) -> np.ndarray:
        if dimensions == 2:
            a = np.deg2rad(angles[frame, 0])
            turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
        else:
            turn = Rotation.from_euler("xyz", angles[frame], degrees=True).as_matrix()
        return np.asarray(scales[frame] * points @ turn.T + shifts[frame])

    return pose


def clip_of(points: np.ndarray, name: str = "clip", valid: np.ndarray | None = None) -> Clip:
    """A clip of landmarks alone, 25 frames a second."""
    known = np.ones(len(points), bool) if valid is None else valid
    return Clip(name, 25.0, lambda: (points, known), lambda: np.zeros((0,)))


def clips(dimensions: int, posed: bool = False) -> list[Clip]:
    """Four clips of the case."""
    return [clip_of(recorded(dimensions, k, turned(dimensions, k) if posed else None), f"clip{k}") for k in range(4)]
