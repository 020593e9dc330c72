"""The triangle mesh over a shape, and the piecewise affine warp of a picture to it."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
import scipy.sparse

from dnnvss.errors import DnnvssError

Triangle = tuple[int, ...]
_ROW = 256
"""Width of the map handed to ``cv2.remap``, which takes no more than 32767 pixels in a row."""
_AT_ONCE = 2**16
"""Pixels of the boxes around triangles that are looked at together."""


def triangulate(points: np.ndarray) -> np.ndarray:
    """Return the Delaunay triangles (K, 3) of points (P, 2), all turning the same way, without slivers on the rim.

    A triangle goes from the rim if its area is under a fiftieth of its longest side squared and its third point lies
    inside; what is left has no hole, and its rim passes each point once.
    """
    from scipy.spatial import Delaunay  # slow to import, and needed where a face is fitted

    triangles = Delaunay(points).simplices
    area = signed_area(points, triangles)
    triangles = np.where((area < 0)[:, None], triangles[:, ::-1], triangles)
    sides = points[triangles] - points[np.roll(triangles, 1, axis=1)]
    longest = np.linalg.norm(sides, axis=-1).max(axis=1)
    thin = [tuple(int(i) for i in t) for t in triangles[np.abs(area) < 0.02 * longest**2]]
    left = {tuple(int(i) for i in t) for t in triangles}
    while thin and (sliver := _peelable(left, thin)) is not None:
        left.remove(sliver)
        thin.remove(sliver)
    return np.array([t for t in triangles.tolist() if tuple(t) in left], dtype=np.int32)


def _peelable(triangles: Iterable[Triangle], thin: Sequence[Triangle]) -> Triangle | None:
    """Return a thin triangle with one edge on the rim whose third point is inside, if there is one."""
    following = rim_edges(triangles)
    for triangle in thin:
        edges = [(triangle[i], triangle[(i + 1) % 3]) for i in range(3)]
        outer = [i for i, (a, b) in enumerate(edges) if following.get(a) == b]
        if len(outer) == 1 and triangle[(outer[0] + 2) % 3] not in following:
            return triangle
    return None


def rim_edges(triangles: Iterable[Sequence[int]]) -> dict[int, int]:
    """Return each rim point's follower: the edges that belong to one triangle only, in the triangles' turn."""
    edges = {(int(t[i]), int(t[(i + 1) % 3])) for t in triangles for i in range(3)}
    return {a: b for a, b in edges if (b, a) not in edges}


def rim(triangles: Iterable[Sequence[int]]) -> np.ndarray:
    """Return the points (R,) on the rim of a mesh, in their order.

    Raises:
        DnnvssError: the rim is not one closed line.
    """
    following = rim_edges(triangles)
    points = [min(following)]
    while (point := following[points[-1]]) != points[0] and len(points) <= len(following):
        points.append(point)
    if len(points) != len(following):
        raise DnnvssError("the rim of the model's mesh is not one closed line",
                          remedy="Choose a point set whose points do not lie in separate patches")
    return np.array(points)


def signed_area(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the signed areas (K,) in square pixels of triangles over points (P, 2)."""
    areas: np.ndarray = signed_areas(points[None], triangles)[0]
    return areas


def signed_areas(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The signed areas (B, K) of triangles over shapes (B, P, 2)."""
    x, y = points[..., 0], points[..., 1]
    a, b, c = triangles.T
    ax, ay = x[:, a], y[:, a]
    return 0.5 * ((x[:, b] - ax) * (y[:, c] - ay) - (y[:, b] - ay) * (x[:, c] - ax))


def barycentric(points: np.ndarray, corners: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """Return the barycentric coordinates (N, 3) of points (N, 2), each in its own (N,) of the triangles (K, 3, 2)."""
    first = corners[:, 0]
    (a, b), (c, d) = np.linalg.inv(np.stack([corners[:, 1] - first, corners[:, 2] - first], axis=2)).transpose(1, 2, 0)
    x, y = (points - first[owner]).T
    u, v = a[owner] * x + b[owner] * y, c[owner] * x + d[owner] * y
    return np.stack([1 - u - v, u, v], axis=1)


def _boxes(low: np.ndarray, high: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """The pixels of boxes from ``low`` (K, 2) to ``high`` (K, 2), of some boxes at a time: box, column and row (N,)."""
    across, down = np.maximum(high - low, 0).T
    count = across * down
    for some in np.split(np.arange(len(count)), np.flatnonzero(np.diff(np.cumsum(count) // _AT_ONCE)) + 1):
        box = np.repeat(some, count[some])
        first = np.repeat(np.cumsum(count[some]) - count[some], count[some])
        row, column = np.divmod(np.arange(len(box)) - first, across[box])
        yield box, low[box, 0] + column, low[box, 1] + row


@dataclass(frozen=True)
class Warp:
    """A mesh in its reference shape, and the texture pixels whose centres lie inside it.

    Args:
        shape: reference shape (P, 2) in reference pixels.
        triangles: corners (K, 3) of each triangle.
        scale: texture pixels per reference pixel.
    """

    shape: np.ndarray
    triangles: np.ndarray
    scale: float = 1.0

    @cached_property
    def origin(self) -> np.ndarray:
        """The reference point (2,) at the outer corner of the texture's top left pixel."""
        return np.floor(self.shape.min(axis=0))

    @cached_property
    def size(self) -> tuple[int, int]:
        """Height and width of the texture's picture in texture pixels."""
        width, height = np.ceil((self.shape.max(axis=0) - self.origin) * self.scale).astype(int)
        return int(height), int(width)

    @cached_property
    def _samples(self) -> tuple[np.ndarray, scipy.sparse.csr_matrix]:
        height, width = self.size
        owner = np.full((height, width), -1)
        weights = np.zeros((height, width, 3))
        corners = (self.shape[self.triangles] - self.origin) * self.scale
        low = np.maximum(np.floor(corners.min(axis=1)).astype(int), 0)
        high = np.minimum(np.ceil(corners.max(axis=1)).astype(int), (width, height))
        for k, x, y in _boxes(low, high):
            coordinates = barycentric(np.stack([x, y], axis=1) + 0.5, corners, k)
            inside = (coordinates > -1e-9).all(axis=1)
            owner[y[inside], x[inside]] = k[inside]
            weights[y[inside], x[inside]] = coordinates[inside]
        pixels = np.flatnonzero(owner.ravel() >= 0)
        columns = self.triangles[owner.ravel()[pixels]]
        matrix = scipy.sparse.csr_matrix(
            (weights.reshape(-1, 3)[pixels].ravel().astype(np.float32), columns.ravel(),
             np.arange(len(pixels) + 1) * 3), shape=(len(pixels), len(self.shape)))
        return pixels, matrix

    @property
    def pixels(self) -> np.ndarray:
        """Positions (N,) of the texture's pixels in its picture, row after row."""
        return self._samples[0]

    @property
    def matrix(self) -> scipy.sparse.csr_matrix:
        """Barycentric weights (N, P): pixel centres as sums of mesh points."""
        return self._samples[1]

    def sample(self, image: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the texture (N, C) of a picture (H, W_, C) under mesh points (P, 2) in picture pixels.

        A pixel of the texture keeps its barycentric coordinates; the picture is read there bilinearly. The type is
        the picture's (``uint8`` or ``float32``).
        """
        count = len(self.pixels)
        maps = np.zeros((-(-count // _ROW) * _ROW, 2), dtype=np.float32)
        maps[:count] = self.matrix @ points.astype(np.float32) - np.float32(0.5)  # remap counts from pixel centres
        grid = maps.reshape(-1, _ROW, 2)
        texture = cv2.remap(image, grid[..., 0], grid[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        return texture.reshape(len(maps), -1)[:count]

    def picture(self, texture: np.ndarray, fill: float = 0.0) -> np.ndarray:
        """Return the texture (N, C) as a picture (H, W_, C) in the reference shape, ``fill`` outside the mesh."""
        height, width = self.size
        canvas = np.full((height * width, texture.shape[-1]), fill, dtype=texture.dtype)
        canvas[self.pixels] = texture
        return canvas.reshape(height, width, -1)
