"""The active appearance model: shape and texture of a face as a few linear parameters."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, check_arrays, read_declared
from dnnvss.errors import DnnvssError
from dnnvss.face.aam.code import ClipCode
from dnnvss.face.aam.colour import ColourBank, luminance
from dnnvss.face.aam.config import AAMConfig
from dnnvss.face.aam.drawing import draw
from dnnvss.face.aam.fold import FoldGuard
from dnnvss.face.aam.light import Skin
from dnnvss.face.aam.mesh import Warp
from dnnvss.face.aam.outliers import FrameLimits
from dnnvss.face.aam.parts import part_names
from dnnvss.face.base import Gauge, name_groups
from dnnvss.face.lips import mouth_gauges
from dnnvss.face.point_set import Layout
from dnnvss.face.pose import PoseReference, to_image, to_reference
from dnnvss.records import as_record
from dnnvss.settings import setting

_REMEDY = "Train again, or delete the file and run the same command"
_FORMATS = (1, 2)
"""Written: 1 where no setting needs 2, which brought rigid poses, luminance and parts."""


@dataclass(frozen=True)
class ActiveAppearanceModel:
    """A fitted model. Shapes live in the reference frame, textures on one fixed shape.

    With shape ``x`` (2P), texture ``g`` (3N), their means, the weight ``w`` of shape, and modes ``S`` (D, 2P) and
    ``T`` (D, 3N): decoding is ``x = mean + c S``, ``g = mean + c T``, and encoding is
    ``c = w^2 (x - mean) S' + (g - mean) T'``, because ``[w S, T]`` is orthonormal. In the separate kind the first
    rows of ``T`` and the last rows of ``S`` are zero, and ``w`` is 1.

    **Source**: Thangthai, Theobald 2016, section 4 (34 points of lips, jaw and nostrils, 30 parameters); Theobald et
    al. 2003, section 2.

    Args:
        config: the settings that it was fitted with.
        landmark_groups: of the corpus.
        reference: stable points of the reference frame.
        mean_shape: (P, 2) in reference pixels.
        warp: the shape on which textures are kept (see ``AAMConfig.texture_shape``), with its mesh.
        mean_texture: (N, 3) float32, 0 to 255.
        shape_modes: (D, P, 2).
        texture_modes: (D, N, 3) float32.
        shape_weight: the weight ``w``, in grey levels per pixel.
        deviations: standard deviation (D,) of each parameter over the frames of the fit.
        spread: robust standard deviation (P, 2) of each coordinate in pixels.
        limits: what a frame may measure before it is an outlier.
        colours: where a model of luminance takes its colours from; None for one of all channels.
    """

    kind: ClassVar[str] = "aam"

    config: AAMConfig
    landmark_groups: dict[str, tuple[int, int]]
    reference: PoseReference
    mean_shape: np.ndarray
    warp: Warp
    mean_texture: np.ndarray
    shape_modes: np.ndarray
    texture_modes: np.ndarray
    shape_weight: float
    deviations: np.ndarray
    spread: np.ndarray
    limits: FrameLimits
    colours: ColourBank | None = None

    @cached_property
    def layout(self) -> Layout:
        """The modelled, stable and mouth rows of a landmark array."""
        return self.config.points.layout(self.landmark_groups)

    @cached_property
    def skin(self) -> Skin:
        """Where textures show skin, on which light is measured."""
        return Skin.of(self.warp, self.layout)

    @cached_property
    def guard(self) -> FoldGuard:
        """What keeps drawn shapes from folding."""
        return FoldGuard(self.mean_shape, self.warp.triangles, self.layout.inner)

    def drawn(self, parameters: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """Points (..., P, 2) as they are drawn with a clip's offset (P, 2): lips meet, and no triangle folds."""
        return self.guard.settled(self.points(parameters) + offset, self.mean_shape + offset)

    @property
    def size(self) -> int:
        """The number of parameters D."""
        return len(self.deviations)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of the parameters, in order."""
        if self.config.parts:
            return part_names(self.config.parts, self.layout, self.shape_modes, self.texture_modes, self.warp)
        if self.config.kind == "combined":
            return tuple(f"aam{i + 1:02d}" for i in range(self.size))
        shapes = int((np.abs(self.shape_modes).sum(axis=(1, 2)) > 0).sum())
        return tuple(f"shape{i + 1:02d}" if i < shapes else f"texture{i - shapes + 1:02d}" for i in range(self.size))

    def project(self, shapes: np.ndarray, textures: np.ndarray) -> np.ndarray:
        """Return the parameters (F, D) of reference shapes (F, P, 2) and textures (F, N, 3), both less their means."""
        shape_part = shapes.reshape(len(shapes), -1) @ self.shape_modes.reshape(self.size, -1).T
        texture_part = textures.reshape(len(textures), -1) @ self.texture_modes.reshape(self.size, -1).T
        return (self.shape_weight**2 * shape_part + texture_part).astype(np.float32)

    def encode(self, image: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the parameters (D,) of one picture (H, W_, 3) with all its landmarks (L, 2) in pixels.

        The head pose is taken as tracked, and no clip mean is removed; :func:`dnnvss.face.aam.encode_clip` does both.
        """
        points = np.asarray(points, dtype=np.float64)
        pose = replace(self.reference, smoothing=0.0).poses(points[None, self.layout.stable], np.ones(1, bool), 1.0)
        shape = to_reference(points[None, self.layout.rows], pose, self.reference.pivot)
        texture = self.read_texture(image, points[self.layout.rows])[None]
        return self.project(shape - self.mean_shape, texture - self.mean_texture)[0]

    def read_texture(self, image: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return what the model sees (N, 3) of a picture (H, W_, 3) under mesh points (P, 2): grey, if luminance."""
        texture = self.warp.sample(image, points)
        return luminance(texture) if self.config.colour == "luminance" else texture

    def points(self, parameters: np.ndarray) -> np.ndarray:
        """Points (..., P, 2) in the reference frame for parameters (..., D)."""
        return self.mean_shape + np.tensordot(parameters, self.shape_modes, axes=1)

    def jacobian(self) -> np.ndarray:
        """How the points move with each parameter, (D, P, 2)."""
        return self.shape_modes.astype(float)

    def region(self, points: Sequence[int]) -> np.ndarray:
        """The form (D, D) of a region: its points, weighed as in the model, and the pixels of its triangles.

        A triangle is of the region where two of its corners are. The form of all points is the identity.
        """
        inside = np.zeros(len(self.mean_shape), dtype=bool)
        inside[list(points)] = True
        seen = inside[self.warp.matrix.indices.reshape(-1, 3)].sum(axis=1) > 1
        shape = self.shape_weight * self.shape_modes[:, inside].reshape(self.size, -1)
        texture = self.texture_modes[:, seen].reshape(self.size, -1).astype(np.float64)
        return shape @ shape.T + texture @ texture.T

    def decode_texture(self, parameters: np.ndarray) -> np.ndarray:
        """Return textures (..., N, 3) float32, not clipped to 0..255, for parameters (..., D); luminance is grey."""
        parameters = np.asarray(parameters, dtype=np.float32)
        return self.mean_texture + np.tensordot(parameters, self.texture_modes, axes=1)

    def decode(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return points (..., P, 2) in the reference frame and textures (..., N, 3) for parameters (..., D)."""
        return self.points(parameters), self.decode_texture(parameters) + self.colour(parameters)

    def colour(self, parameters: np.ndarray) -> np.ndarray:
        """Return what is added to a texture for its colour, (..., N, 3) float32; zero if all channels are modelled."""
        return np.zeros((), dtype=np.float32) if self.colours is None else self.colours.nearest(parameters)

    def modelled(self, landmarks: np.ndarray) -> np.ndarray:
        """The points (..., P, 2) of the mesh among all landmarks (..., L, 2)."""
        return landmarks[..., self.layout.rows, :]

    def stabilise(self, landmarks: np.ndarray, code: ClipCode) -> np.ndarray:
        """The modelled points (F, P, 2) of tracked landmarks (F, L, 2), the clip's own mean replaced by the model's."""
        own = landmarks[:, self.layout.rows].astype(float)
        return to_reference(own, code.pose, self.reference.pivot) - code.shape_offset

    def picture(self, parameters: np.ndarray, zoom: float = 1.0) -> np.ndarray:
        """The picture, uint8 RGB (H, W_, 3), of parameters (D,): decoded texture on decoded shape, on white."""
        points, texture = self.decode(parameters)
        return draw(self.warp, self.layout.inner, self.guard.settled(points), texture, zoom)

    def place(self, points: np.ndarray, pose: np.ndarray) -> np.ndarray:
        """Return reference points (..., P, 2) in picture pixels for poses (..., 4)."""
        return to_image(points, pose, self.reference.pivot)

    @property
    def unit(self) -> str:
        """Reference pixels."""
        return "px"

    @cached_property
    def groups(self) -> dict[str, tuple[int, ...]]:
        """Name of a group to the positions of its parameters (see :func:`dnnvss.face.base.name_groups`)."""
        return name_groups(self.names)

    @cached_property
    def contours(self) -> dict[str, list[int]]:
        """Modelled landmark group to its points, to be drawn as a line."""
        return {name: rows.tolist() for name, rows in self.layout.groups.items()}

    @cached_property
    def gauges(self) -> dict[str, Gauge]:
        """Aperture, lower lip and width of the mouth (see :func:`dnnvss.face.lips.mouth_gauges`)."""
        return mouth_gauges(self.mean_shape, self.shape_modes, self.layout.outer, self.layout.inner, self.unit)

    def save(self, path: str | Path) -> Path:
        """Write the model as ``.npz`` (arrays and a JSON text) and return the path."""
        late = set(self.config.to_dict()) - set(AAMConfig().to_dict())
        colours = {} if self.colours is None else self.colours.arrays()
        text = json.dumps({"format": 2 if late else 1, "config": self.config.to_dict(), "groups": self.landmark_groups,
                           "limits": vars(self.limits), "smoothing": self.reference.smoothing, "scale": self.warp.scale,
                           "shape_weight": self.shape_weight})
        return files.write_arrays(
            path, settings=np.array(text), kind=np.array(self.kind), stable=self.reference.stable,
            mean_shape=self.mean_shape, texture_shape=self.warp.shape, triangles=self.warp.triangles,
            mean_texture=self.mean_texture, shape_modes=self.shape_modes, texture_modes=self.texture_modes,
            deviations=self.deviations, spread=self.spread, **colours)

    @classmethod
    def load(cls, path: str | Path) -> "ActiveAppearanceModel":
        """Return a model that :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing, damaged or of another format.
        """
        return files.read(path, _loaded, _REMEDY)


def _loaded(path: Path) -> ActiveAppearanceModel:
    arrays = read_declared(path, _ARRAYS, _REMEDY)
    kept = as_record(_Kept, json.loads(str(arrays["settings"])), path, _REMEDY)
    config = AAMConfig.from_dict(kept.config)
    luminance = config.colour == "luminance"
    check_arrays(arrays, _COLOURS if luminance else {}, path, _REMEDY,
                 {"D": len(arrays["deviations"]), "N": len(arrays["mean_texture"])})
    warp = Warp(arrays["texture_shape"], arrays["triangles"], kept.scale)
    points, pixels = len(arrays["mean_shape"]), len(arrays["mean_texture"])
    if not ((warp.triangles >= 0) & (warp.triangles < points)).all() or np.prod(warp.size) > _BOX * (pixels + _BOX):
        raise DnnvssError("its triangles are none of its points", file=path, remedy=_REMEDY)
    model = ActiveAppearanceModel(
        config, dict(kept.groups), PoseReference(arrays["stable"], kept.smoothing, config.alignment == "rigid"),
        arrays["mean_shape"], warp, arrays["mean_texture"], arrays["shape_modes"], arrays["texture_modes"],
        kept.shape_weight, arrays["deviations"], arrays["spread"], kept.limits,
        ColourBank.from_arrays(arrays) if luminance else None)
    if len(model.layout.rows) != points or len(model.layout.stable) != len(arrays["stable"]):
        raise DnnvssError("its points are not those of its landmark groups", file=path, remedy=_REMEDY)
    return model


@dataclass(frozen=True, kw_only=True)
class _Kept:
    """The settings in the file of a model."""

    format: int = setting(choices=_FORMATS)
    config: Mapping[str, Any]
    groups: Mapping[str, tuple[int, int]] = setting(least=0)
    limits: FrameLimits
    smoothing: float = setting(least=0)
    scale: float = setting(above=0)
    shape_weight: float = setting(least=0)


_ARRAYS = {
    "settings": Held((), "U"), "kind": Held((), "U", optional=True), "stable": Held(("S", 2)),
    "mean_shape": Held(("P", 2)), "texture_shape": Held(("P", 2)), "triangles": Held(("T", 3), "iu"),
    "mean_texture": Held(("N", 3)), "shape_modes": Held(("D", "P", 2)), "texture_modes": Held(("D", "N", 3)),
    "deviations": Held(("D",)), "spread": Held(("P", 2)), "colour_parameters": Held(("K", "D"), optional=True),
    "colour_chroma": Held(("K", "N", 3), "i", optional=True)}
_COLOURS = {"colour_parameters": Held(("K", "D")), "colour_chroma": Held(("K", "N", 3), "i")}
_BOX = 100  # times the texture's pixels that its box may hold
