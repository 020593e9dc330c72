"""One scale of the search: what the face looks like on the mean shape, and how a wrong place changes it.

With a texture ``g`` read under the points, the appearance basis ``A`` (columns: an offset and a gain for each channel,
then modes; orthonormal), what the appearance cannot explain is ``r = Q g``, ``Q = 1 - A A'``. The instance ``A c`` with
``c = A' g`` has steepest-descent images ``J(c) = sum_i c_i J_i``, where ``J_i`` are those of the basis images, and the
Gauss-Newton step, with the shape parameters ``p`` and their precision ``P``, is

    d = (H + P)^-1 (J' r + P p),    H = J' Q J = sum_ij c_i c_j K_ij,    K_ij = J_i' Q J_j

``K`` is computed once, so that a step of the simultaneous algorithm costs little more than one of the project-out
algorithm, which keeps ``c`` at the mean texture. Gain and offset of the light are columns of ``A`` and cost nothing.
``P`` is the prior of the shape modes (maximum a posteriori), beside the variance of what is left now: a texture that
fits without rest needs no prior. Pose has none.

**Source**: Matthews and Baker 2004, *Active Appearance Models Revisited* (inverse composition, project-out); Gross,
Matthews and Baker 2005, *Generic vs. person specific active appearance models* (simultaneous); Papandreou and Maragos
2008, *Adaptive and constrained algorithms for inverse compositional active appearance model fitting* (priors).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from dnnvss.face.aam.mesh import Warp
from dnnvss.face.aam.search.shapes import Shapes, slopes
from dnnvss.face.pca import components

_ROW = 256
_STEP = 4.0
"""The farthest that a point moves in one step, in texture pixels."""


@dataclass(frozen=True)
class Level:
    """The appearance model of one scale, and everything of the search that can be computed beforehand.

    Args:
        shapes: the shape model, in pixels of the labelled pictures.
        scale: texture pixels per pixel of the labelled pictures.
        appearance: the basis A (m, N C) float32, a row each: C offsets, C gains of the mean texture, modes.
        prior: weight of the shape prior.
        project_out: steps with the steepest-descent images of the mean texture alone.
    """

    shapes: Shapes
    scale: float
    appearance: np.ndarray
    prior: float
    project_out: bool = False

    @cached_property
    def warp(self) -> Warp:
        """The mesh on the mean shape and its texture pixels."""
        return Warp(self.shapes.mean, self.shapes.triangles, self.scale)

    @cached_property
    def channels(self) -> int:
        """The number of channels C of the pictures."""
        return self.appearance.shape[1] // len(self.warp.pixels)

    @cached_property
    def _maps(self) -> np.ndarray:
        return _dense(self.warp)

    def sample(self, image: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the texture (N C,) of a float32 picture (H, W_[, C]) of this scale, points (2, P) in pixels of it."""
        return _read(self._maps, image, points)[:self.appearance.shape[1]]

    @cached_property
    def _moving(self) -> slice:
        """The basis images whose steepest-descent images are used: the mean texture's, or all."""
        return slice(self.channels, 2 * self.channels) if self.project_out else slice(None)

    @cached_property
    def _gradients(self) -> tuple[np.ndarray, np.ndarray]:
        """The slope of the basis images along x and y (2 of (m, N C)) per pixel of the labelled pictures."""
        images = self.appearance[self._moving]
        images = images.reshape(len(images), -1, self.channels)
        along = np.stack([_slope(self.warp, t) for t in images]).astype(np.float32) * np.float32(self.scale)
        flat = np.ascontiguousarray(along.transpose(1, 0, 2, 3)).reshape(2, len(images), -1)
        return flat[0], flat[1]

    @cached_property
    def _carried(self) -> tuple[np.ndarray, np.ndarray]:
        """How far each move of the basis carries every texture pixel along x and y (2 of (4 + K, N)), float32."""
        moves = [self.warp.matrix @ self.shapes.basis[:, :, axis].T.astype(np.float32) for axis in (0, 1)]
        return np.ascontiguousarray(moves[0].T), np.ascontiguousarray(moves[1].T)

    @cached_property
    def _curvature(self) -> np.ndarray:
        """K (m m, n n) float32 of the equation above."""
        gx, gy = self._gradients
        wx, wy = (np.repeat(w, self.channels, axis=1) for w in self._carried)
        m, n = len(gx), len(wx)
        images = (gx[:, None] * wx + gy[:, None] * wy).reshape(m * n, -1)
        seen = images @ self.appearance.T
        full = images @ images.T - seen @ seen.T
        return np.ascontiguousarray(full.reshape(m, n, m, n).transpose(0, 2, 1, 3).reshape(m * m, n * n))

    @cached_property
    def _precision(self) -> np.ndarray:
        """The precision (n,) of the basis for what is left of a texture, squared and summed."""
        own = self.prior / self.shapes.deviations**2 / self.appearance.shape[1]
        return np.concatenate([np.zeros(4), own]).astype(np.float32)

    @cached_property
    def _basis(self) -> np.ndarray:
        basis = self.shapes.basis
        return np.ascontiguousarray(basis.transpose(0, 2, 1).reshape(len(basis), -1), np.float32)

    @cached_property
    def _slopes(self) -> np.ndarray:
        return slopes(self.shapes.mean, self.shapes.triangles).astype(np.float32)

    def warm(self) -> None:
        """Compute what the first step would have to."""
        _ = self._curvature, self._precision, self._basis, self._slopes, self._maps

    def explain(self, texture: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """Return coefficients (m,), what they leave (N C,), and its share of the texture's contrast (0 to 1)."""
        coefficients = self.appearance @ texture
        left = texture - coefficients @ self.appearance
        seen = coefficients[self.channels:]
        missed = float(left @ left)
        return coefficients, left, missed / max(float(seen @ seen) + missed, 1e-6)

    def step(self, coefficients: np.ndarray, left: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Return the step (4 + K,) in the frame of the mean that would explain what is left."""
        gx, gy = self._gradients
        wx, wy = self._carried
        coefficients = coefficients[self._moving]
        ex, ey = (coefficients @ gx) * left, (coefficients @ gy) * left
        if self.channels > 1:
            ex, ey = (e.reshape(-1, self.channels).sum(axis=1) for e in (ex, ey))
        n = len(wx)
        hessian = (np.outer(coefficients, coefficients).ravel() @ self._curvature).reshape(n, n)
        precision = self._precision * (left @ left)
        hessian.flat[::n + 1] += precision + 1e-6 * hessian.trace() / n + 1e-9
        toward = wx @ ex + wy @ ey
        toward[4:] += precision[4:] * parameters
        return np.linalg.solve(hessian, toward)

    def compose(self, points: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the model's points (2, P) in the picture and their parameters (K,) after a step.

        The step is undone in the frame of the mean, and the local map from mean to picture carries it over.
        """
        move = (step @ self._basis).reshape(2, -1)
        local = self._slopes @ points.T
        change = local[0].T * move[0] + local[1].T * move[1]
        change *= np.float32(min(1.0, _STEP / self.scale / max(float(np.abs(change).max()), 1e-9)))
        return self.shapes.project(points - change)


def fit_level(
    shapes: Shapes, images: Sequence[np.ndarray], points: Sequence[np.ndarray], scale: float, variance: float,
    prior: float, project_out: bool = False,
) -> Level:
    """Return the level of float32 pictures (H, W_[, C]) of this scale with points (P, 2) in their pixels.

    Textures are normalised to mean 0 in each channel and variance 1; the modes explain ``variance`` of what is left
    beside offsets and gains.
    """
    warp = Warp(shapes.mean, shapes.triangles, scale)
    channels, count = (1 if images[0].ndim == 2 else images[0].shape[2]), len(warp.pixels)
    maps = _dense(warp)
    textures = np.stack([_read(maps, i, np.asarray(p.T, np.float32))[:count * channels]
                         for i, p in zip(images, points, strict=True)]).reshape(-1, count, channels)
    textures = textures - textures.mean(axis=1, keepdims=True)
    textures = (textures / textures.std(axis=(1, 2), keepdims=True)).reshape(len(textures), -1)
    mean = textures.mean(axis=0).reshape(count, channels)
    light = np.zeros((2, channels, count, channels))
    for channel in range(channels):
        light[0, channel, :, channel] = 1.0
        light[1, channel, :, channel] = mean[:, channel]
    light, _ = np.linalg.qr(light.reshape(2 * channels, -1).T)
    rows = textures - (textures @ light) @ light.T
    rows = (rows - rows.mean(axis=0)).astype(np.float32)
    found = components(rows, variance)
    basis, _ = np.linalg.qr(np.concatenate([light.T, found.modes]).T.astype(np.float64))
    return Level(shapes, scale, np.ascontiguousarray(basis.T, np.float32), prior, project_out)


def _dense(warp: Warp) -> np.ndarray:
    """Return barycentric weights (P, rows of 256) float32; for some hundred points faster than a sparse product."""
    count = len(warp.pixels)
    matrix = np.zeros((warp.matrix.shape[1], -(-count // _ROW) * _ROW), np.float32)
    matrix[:, :count] = warp.matrix.T.toarray()
    return matrix


def _read(maps: np.ndarray, image: np.ndarray, points: np.ndarray) -> np.ndarray:
    at = (points - np.float32(0.5)) @ maps  # remap counts from pixel centres
    x, y = at.reshape(2, -1, _ROW)
    return cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).reshape(-1)


def _slope(warp: Warp, texture: np.ndarray) -> np.ndarray:
    """Return slopes (2, N, C) along x and y of a texture (N, C), one-sided where a neighbour is outside the mesh."""
    height, width = warp.size
    inside = np.zeros((height + 2, width + 2), bool)
    canvas = np.zeros((height + 2, width + 2, texture.shape[1]), np.float32)
    inside[1:-1, 1:-1].flat[warp.pixels] = True
    canvas[1:-1, 1:-1] = warp.picture(texture.astype(np.float32))
    along = []
    for axis in (1, 0):
        total, parts = np.zeros_like(canvas), np.zeros((height + 2, width + 2, 1), np.float32)
        for side in (-1, 1):
            both = (np.roll(inside, -side, axis=axis) & inside)[..., None]
            total += np.where(both, side * (np.roll(canvas, -side, axis=axis) - canvas), 0)
            parts += both
        inner = (total / np.maximum(parts, 1))[1:-1, 1:-1]
        along.append(inner.reshape(-1, texture.shape[1])[warp.pixels])
    return np.stack(along)
