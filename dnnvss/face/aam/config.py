"""The settings of the active appearance model."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, ClassVar

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.parts import Part
from dnnvss.face.point_set import PointSet
from dnnvss.settings import check_settings, read_settings, setting

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

    points: PointSet = setting(PointSet())
    kind: str = setting("combined", choices=("combined", "separate"))
    modes: int | float = setting(30, above=0)
    shape_modes: int | float = setting(12, above=0)
    texture_modes: int | float = setting(30, above=0)
    shape_weight: float = setting(0.7, above=0)
    texture_shape: str = setting("open", choices=("open", "mean"))
    scale: float = setting(1.0, above=0)
    pose_smoothing: float = setting(0.12, least=0)
    clip_means: bool = True
    texture_frames: int = setting(6000, least=1)
    texture_every: int = setting(5, least=1)
    outlier: float = setting(10.0, above=0)
    seed: int = setting(1, least=0)
    alignment: str = setting("similarity", choices=("similarity", "rigid"))
    colour: str = setting("rgb", choices=("rgb", "luminance"))
    parts: tuple[Part, ...] = ()

    def __post_init__(self) -> None:
        """Refuse values that mean nothing."""
        check_settings(self, "aam")
        if len({part.name for part in self.parts}) < len(self.parts):
            raise DnnvssError("aam.parts has two parts of one name", remedy="Name each part once")

    @classmethod
    def from_dict(cls, value: Mapping[str, Any]) -> "AAMConfig":
        """The settings that plain containers (YAML) describe; what is absent keeps its default.

        Raises:
            DnnvssError: an unknown key or a value out of range.
        """
        return read_settings(cls, value, "aam")

    def to_dict(self) -> dict[str, Any]:
        """Return plain containers, the inverse of :meth:`from_dict`.

        Settings that came later are left out at their defaults, so that models without them stay what they were.
        """
        plain = {f.name: getattr(self, f.name) for f in fields(self)} | {"points": self.points.to_dict()}
        plain["parts"] = [part.to_dict() for part in self.parts]
        return {name: value for name, value in plain.items() if name not in _LATER or value != _LATER[name]}
