"""The settings of the active appearance model."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, ClassVar

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.parts import Part
from dnnvss.face.point_set import PointSet

_WORDS = {"kind": ("combined", "separate"), "texture_shape": ("open", "mean"), "alignment": ("similarity", "rigid"),
          "colour": ("rgb", "luminance")}
_LATER: dict[str, Any] = {"alignment": "similarity", "colour": "rgb", "parts": []}
"""Settings that the first format of stored models did not have, and what they mean where they are absent."""


@dataclass(frozen=True)
class AAMConfig:
    """How the model is fitted; the defaults are those of ``conf/aam/default.yaml``.

    Args:
        points: the point set.
        kind: ``"combined"`` (modes of shape and texture together) or ``"separate"`` (shape modes, then texture modes).
        modes: combined modes: a number, or the share of variance to keep if it is below 1.
        shape_modes, texture_modes: the same for the separate kind.
        shape_weight: weight of shape against texture in the combined kind, times the balanced weight
            sqrt(texture variance / shape variance). Less weight lets the first modes follow what is seen inside the
            mouth, which speech predicts better than the last tenths of a pixel.
        texture_shape: the shape on which textures are kept: ``"open"`` (mean of the most open mouths, so that there is
            room for teeth and tongue) or ``"mean"``.
        scale: texture pixels per video pixel, along each axis.
        pose_smoothing: time constant in seconds over which head pose is smoothed; 0 leaves it as tracked.
        clip_means: remove each clip's mean shape and texture before the modes are learnt.
        texture_frames: number of frames whose texture is read to learn the modes.
        texture_every: one frame in this many is read from a clip.
        outlier: robust standard deviations beyond which a frame is left out.
        seed: seed of the choice of frames and of the randomised decomposition.
        alignment: ``"similarity"``, or ``"rigid"``: the pose turns and moves and keeps the scale.
        colour: ``"rgb"``, or ``"luminance"``: the modes draw luminance alone, the colour comes from the nearest
            training frame.
        parts: sub-models that share out the points, each with modes of its own; one model of all where empty.
    """

    face: ClassVar[str] = "aam"

    points: PointSet = field(default_factory=PointSet)
    kind: str = "combined"
    modes: float = 30
    shape_modes: float = 12
    texture_modes: float = 30
    shape_weight: float = 0.7
    texture_shape: str = "open"
    scale: float = 1.0
    pose_smoothing: float = 0.12
    clip_means: bool = True
    texture_frames: int = 6000
    texture_every: int = 5
    outlier: float = 10.0
    seed: int = 1
    alignment: str = "similarity"
    colour: str = "rgb"
    parts: tuple[Part, ...] = ()

    def __post_init__(self) -> None:
        """Refuse values that mean nothing."""
        for name, known in _WORDS.items():
            if getattr(self, name) not in known:
                raise DnnvssError(f"aam.{name} is {getattr(self, name)!r}", remedy=f"Choose {' or '.join(known)}")
        if len({part.name for part in self.parts}) < len(self.parts):
            raise DnnvssError("aam.parts has two parts of one name", remedy="Name each part once")
        for name in ("modes", "shape_modes", "texture_modes", "shape_weight", "scale", "texture_frames",
                     "texture_every", "outlier"):
            if not getattr(self, name) > 0:
                raise DnnvssError(f"aam.{name} is {getattr(self, name)}", remedy="Give a number above 0")
        if self.pose_smoothing < 0:
            raise DnnvssError(f"aam.pose_smoothing is {self.pose_smoothing}", remedy="Give seconds, 0 for none")

    @classmethod
    def from_dict(cls, value: Mapping[str, Any]) -> "AAMConfig":
        """Return the settings that plain containers (YAML) describe; what is absent keeps its default.

        Raises:
            DnnvssError: an unknown key or a value out of range.
        """
        known = {f.name for f in fields(cls)}
        if unknown := sorted(set(value) - known):
            raise DnnvssError(f"unknown setting aam.{unknown[0]}", remedy=f"Use some of {sorted(known)}")
        plain = dict(value)
        if "points" in plain and not isinstance(plain["points"], PointSet):
            plain["points"] = PointSet.from_dict(plain["points"])
        if "parts" in plain:
            plain["parts"] = tuple(part if isinstance(part, Part) else Part.from_dict(part) for part in plain["parts"])
        return cls(**plain)

    def to_dict(self) -> dict[str, Any]:
        """Return plain containers, the inverse of :meth:`from_dict`.

        Settings that came later are left out at their defaults, so that models without them stay what they were.
        """
        plain = {f.name: getattr(self, f.name) for f in fields(self)} | {"points": self.points.to_dict()}
        plain["parts"] = [part.to_dict() for part in self.parts]
        return {name: value for name, value in plain.items() if name not in _LATER or value != _LATER[name]}
