"""The search model: shapes, the levels from coarse to fine, and what a frame may measure before it counts as lost."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from dnnvss import files
from dnnvss.archives import Held, read_declared
from dnnvss.errors import DnnvssError
from dnnvss.face.aam.mesh import signed_area
from dnnvss.face.aam.search.level import Level, fit_level
from dnnvss.face.aam.search.shapes import Shapes, fit_shapes
from dnnvss.face.aam.search.view import channels_of, crops_of
from dnnvss.face.pose import fit_pose

_FORMAT = 1
_REMEDY = "Delete it and run the command again"


@dataclass(frozen=True)
class SearchSettings:
    """How the search model is fitted and searched; the defaults were chosen on GRID's validation clips.

    Args:
        scales: texture pixels per pixel of the labelled pictures, coarse to fine, before ``most_pixels``.
        most_pixels: texture pixels of the finest level; larger faces are searched at a smaller scale.
        colour: ``"grey"`` or ``"rgb"``.
        shape_variance, appearance_variance: share of variance that the modes explain, below 1.
        shape_prior: weight of the shape's prior against the texture.
        iterations: most steps at a level.
        tolerance: a level ends when no point moves farther, in pixels of the labelled pictures.
        project_out: the project-out algorithm at the finest level too, in place of the simultaneous one. Coarser levels
            always have it: it comes from farther off, and precision does not matter there.
    """

    scales: tuple[float, ...] = (0.5, 1.0)
    most_pixels: int = 8000
    colour: str = "grey"
    shape_variance: float = 0.999
    appearance_variance: float = 0.95
    shape_prior: float = 40.0
    iterations: int = 12
    tolerance: float = 0.1
    project_out: bool = False

    def __post_init__(self) -> None:
        """Refuse values that mean nothing."""
        if self.colour not in ("grey", "rgb"):
            raise DnnvssError(f"search.colour is {self.colour!r}", remedy="Choose grey or rgb")
        if not self.scales or list(self.scales) != sorted(self.scales) or not self.scales[0] > 0:
            raise DnnvssError(f"search.scales is {self.scales}", remedy="Give scales above 0, the coarsest first")
        for name in ("shape_variance", "appearance_variance"):
            if not 0 < getattr(self, name) < 1:  # 1 would be a number of modes
                raise DnnvssError(f"search.{name} is {getattr(self, name)}", remedy="Give a share above 0 and below 1")


@dataclass(frozen=True)
class SearchLimits:
    """What an accepted frame may measure.

    Args:
        error: largest share of the texture's contrast that the model does not explain.
        shape: largest RMS shape parameter in standard deviations.
        sharpness: least sharpness of the texture.
    """

    error: float
    shape: float
    sharpness: float


@dataclass(frozen=True)
class SearchModel:
    """Everything that finds points in pictures. See :func:`fit_search`.

    Args:
        settings: how it was fitted.
        shapes: the shape model.
        levels: coarse to fine.
        patch: (h, w) float32, the mean picture round the mesh at the scale of the first level, grey.
        corner: place (2,) of the patch's top left corner beside the mean shape, in pixels of the labelled pictures.
        limits: what an accepted frame may measure.
    """

    settings: SearchSettings
    shapes: Shapes
    levels: tuple[Level, ...]
    patch: np.ndarray
    corner: np.ndarray
    limits: SearchLimits

    @cached_property
    def size(self) -> float:
        """The larger side of the mean shape in pixels of the labelled pictures."""
        return float(np.ptp(self.shapes.mean, axis=0).max())

    @cached_property
    def neighbours(self) -> tuple[np.ndarray, np.ndarray]:
        """Pairs of texture pixels of the finest level that lie side by side."""
        warp = self.levels[-1].warp
        height, width = warp.size
        at = np.full(height * width + 1, -1)
        at[warp.pixels] = np.arange(len(warp.pixels))
        right = np.where((warp.pixels + 1) % width > 0, at[warp.pixels + 1], -1)
        return np.flatnonzero(right >= 0), right[right >= 0]

    def sharpness(self, texture: np.ndarray) -> float:
        """Return how much neighbours differ in a texture (N C,) of the finest level, beside its variance."""
        pixels = texture.reshape(-1, self.levels[-1].channels)
        left, right = self.neighbours
        return float(((pixels[right] - pixels[left]) ** 2).mean() / max(float(pixels.var(axis=0).mean()), 1e-6))

    def save(self, path: str | Path, **more: Any) -> Path:
        """Write the model, and ``more`` arrays beside it, as ``.npz`` and return the path."""
        levels = {f"appearance{i}": level.appearance for i, level in enumerate(self.levels)}
        return files.write_arrays(
            path, format=_FORMAT, settings=np.array(json.dumps(asdict(self.settings))), mean=self.shapes.mean,
            modes=self.shapes.modes, deviations=self.shapes.deviations, triangles=self.shapes.triangles,
            scales=np.array([level.scale for level in self.levels]),
            patch=self.patch, corner=self.corner,
            limits=np.array([self.limits.error, self.limits.shape, self.limits.sharpness]), **levels, **more)

    @classmethod
    def load(cls, path: str | Path) -> "SearchModel":
        """Return a model that :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing, damaged or of another version.
        """
        return files.read(path, _loaded, _REMEDY)


def _loaded(path: Path) -> SearchModel:
    arrays = read_declared(path, _ARRAYS, _REMEDY, more=True)
    if int(arrays["format"]) != _FORMAT:
        raise DnnvssError("is no search model of this version", file=path, remedy=_REMEDY)
    plain = json.loads(str(arrays["settings"]))
    settings = SearchSettings(**{**plain, "scales": tuple(plain["scales"])})
    shapes = Shapes(arrays["mean"], arrays["modes"], arrays["deviations"], arrays["triangles"])
    count = len(arrays["scales"])
    levels = tuple(Level(shapes, float(s), arrays[f"appearance{i}"], settings.shape_prior,
                         settings.project_out or i < count - 1) for i, s in enumerate(arrays["scales"]))
    return SearchModel(settings, shapes, levels, arrays["patch"], arrays["corner"],
                       SearchLimits(*(float(v) for v in arrays["limits"])))


_ARRAYS = {
    "format": Held((), "iu"), "settings": Held((), "U"), "mean": Held(("P", 2)), "modes": Held(("M", "P", 2)),
    "deviations": Held(("M",)), "triangles": Held(("T", 3), "iu"), "scales": Held(("L",)), "limits": Held((3,))}


def build(images: Sequence[np.ndarray], points: np.ndarray, settings: SearchSettings, limits: SearchLimits,
          shapes: Shapes | None = None) -> SearchModel:
    """Return the model of labelled pictures (H, W_, 3) uint8 with points (N, P, 2), with given limits.

    Args:
        images, points: the labelled frames; sizes may differ.
        settings: how to fit.
        limits: what an accepted frame may measure.
        shapes: the shape model; fitted to the points where None.
    """
    shapes = shapes or fit_shapes(points, settings.shape_variance)
    area = float(np.abs(signed_area(shapes.mean, shapes.triangles)).sum())
    shrink = min(1.0, np.sqrt(settings.most_pixels / max(area, 1.0)) / settings.scales[-1])
    levels = []
    for scale in (s * shrink for s in settings.scales):
        views = [crops_of(i, p, 1.0, [scale], settings.colour)[0] for i, p in zip(images, points, strict=True)]
        placed = [v.inside(p.T.astype(np.float32)).T for v, p in zip(views, points, strict=True)]
        levels.append(fit_level(shapes, [v.image for v in views], placed, scale, settings.appearance_variance,
                                settings.shape_prior, settings.project_out or scale < settings.scales[-1] * shrink))
        levels[-1].warm()
    patch, corner = _patch(images, points, shapes, levels[0].scale)
    return SearchModel(settings, shapes, tuple(levels), patch, corner, limits)


def _patch(images: Sequence[np.ndarray], points: np.ndarray, shapes: Shapes, scale: float
           ) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean picture (h, w) round the upright mesh, each normalised, and its corner beside the mean shape."""
    low, high = shapes.mean.min(axis=0), shapes.mean.max(axis=0)
    corner, high = low - 0.1 * (high - low), high + 0.1 * (high - low)
    width, height = np.ceil((high - corner) * scale).astype(int)
    total = np.zeros((height, width), np.float32)
    for image, (a, b, x, y) in zip(images, fit_pose(points, shapes.mean), strict=True):
        turn = np.array([[a, -b], [b, a]])
        place = turn @ corner + (x, y)
        matrix = np.column_stack([turn / scale, place + turn @ np.full(2, 0.5 / scale) - 0.5])
        own = cv2.warpAffine(channels_of(image, "grey"), matrix, (int(width), int(height)),
                             flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP, borderMode=cv2.BORDER_REPLICATE)
        total += (own - own.mean()) / max(float(own.std()), 1e-3)
    return total / len(images), corner
