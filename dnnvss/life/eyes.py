"""The eyes as a part of their own: where they lie in the head's frame, and modes of how they look."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

MODES = 32
"""Modes that are kept; half as many draw shut lids as well, and others are where the talker looks."""
_ACROSS, _ABOVE, _BELOW = 1.15, 1.45, 0.7
"""Half axes of an eye's region, in widths of the eye: across, over it with the brow, and under it."""
_FADE = 0.3
"""Share of the half axes over which a region fades out."""
_WIDEST = 200
"""Pixels that the picture of both regions is wide at most."""
_LIGHT = 0.3
"""Standard deviation, in widths of an eye, of the blur that leaves the light and colour of the skin."""


@dataclass(frozen=True)
class EyeRegion:
    """Where the eyes lie in the reference frame of the head, as a grid of points.

    Args:
        origin: least x and y (2,) of the grid.
        step: distance of its points.
        eye: width of an eye.
        weight: (H, W_) how much of each point belongs to the eyes: 1 inside, falling smoothly to 0.
    """

    origin: np.ndarray
    step: float
    eye: float
    weight: np.ndarray

    @classmethod
    def around(cls, rings: Sequence[np.ndarray]) -> "EyeRegion":
        """The region round eyes that are open.

        Args:
            rings: points (n, 2) round each eye in the reference frame, y down.
        """
        places = [(0.5 * (r.min(axis=0) + r.max(axis=0)), float(np.ptp(r[:, 0]))) for r in rings]
        low = np.min([at - np.array([_ACROSS, _ABOVE]) * wide for at, wide in places], axis=0)
        high = np.max([at + np.array([_ACROSS, _BELOW]) * wide for at, wide in places], axis=0)
        step = max(1.0, float(high[0] - low[0]) / _WIDEST)
        columns, rows = np.ceil((high - low) / step).astype(int) + 1
        x, y = np.meshgrid(low[0] + step * np.arange(columns), low[1] + step * np.arange(rows))
        weight = np.zeros((rows, columns))
        for (across, down), wide in places:
            tall = np.where(y < down, _ABOVE, _BELOW) * wide
            away = np.hypot((x - across) / (_ACROSS * wide), (y - down) / tall)
            ramp = np.clip((1 - away) / _FADE, 0, 1)
            weight = np.maximum(weight, ramp**2 * (3 - 2 * ramp))
        return cls(low, step, float(np.mean([wide for _, wide in places])), weight.astype(np.float32))

    @property
    def points(self) -> np.ndarray:
        """The grid's points (H W_, 2)."""
        rows, columns = self.weight.shape
        x, y = np.meshgrid(np.arange(columns), np.arange(rows))
        return self.origin + self.step * np.stack([x, y], axis=-1).reshape(-1, 2)

    def read(self, image: np.ndarray, at: np.ndarray) -> np.ndarray:
        """The region's picture (H, W_, 3) float32, from a picture in which its points lie at (H W_, 2) pixels."""
        x, y = np.moveaxis(at.astype(np.float32).reshape(*self.weight.shape, 2), -1, 0)
        return cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).astype(np.float32)

    def light(self, picture: np.ndarray) -> np.ndarray:
        """The light and colour of the skin in a picture (H, W_, 3) of the region."""
        return cv2.GaussianBlur(picture, (0, 0), _LIGHT * self.eye / self.step, borderType=cv2.BORDER_REPLICATE)


@dataclass(frozen=True)
class EyeModel:
    """A part model of the eyes: modes of how their region looks beside the light of its clip.

    The light is the blurred picture of the clip's open eyes. All fades out with the region's weight, so that what is
    added to a picture has no seam.

    Args:
        region: where.
        modes: orthonormal (K, H W_ 3) float32.

    **Source**: a node of the face's hierarchy with a model of its own, Cosker et al. 2004, section 2; here of texture
    alone.
    """

    region: EyeRegion
    modes: np.ndarray

    @classmethod
    def fit(cls, region: EyeRegion, looks: np.ndarray) -> "EyeModel":
        """The leading modes of looks (N, H, W_, 3) about zero; through the products of the N frames."""
        flat = (looks * region.weight[..., None]).reshape(len(looks), -1).astype(np.float32)
        value, vector = np.linalg.eigh((flat @ flat.T).astype(np.float64))
        order = np.argsort(value)[::-1][:MODES]
        order = order[value[order] > 1e-6 * value.max()]
        modes = (vector[:, order] / np.sqrt(value[order])).T.astype(np.float32) @ flat
        return cls(region, modes)

    def code(self, looks: np.ndarray) -> np.ndarray:
        """Coefficients (F, K) of looks (F, H, W_, 3)."""
        return (looks * self.region.weight[..., None]).reshape(len(looks), -1) @ self.modes.T
