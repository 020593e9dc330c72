"""The settings of a face of points."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from dnnvss.face.point_set import PointSet
from dnnvss.settings import check_settings, read_settings, setting


@dataclass(frozen=True)
class PointsSettings:
    """How a face of points is fitted; the defaults are those of ``conf/face/points.yaml``.

    Args:
        points: which landmarks are modelled, and which are stable.
        modes: ``raw`` (the points themselves), or how many principal components, or the share of variance to keep if it
            is below 1. On GRID lips follow phones equally well either way (docs/results/face.md); nothing is left out
            of the points themselves, and each has a name.
        pose_smoothing: time constant in seconds over which head pose is smoothed; 0 leaves it as tracked.
        clip_means: remove each clip's mean shape before the modes are learnt.
        outlier: robust standard deviations beyond which a frame is left out.
        seed: of the randomised decomposition of very many points.
    """

    face: ClassVar[str] = "points"

    points: PointSet = field(default_factory=PointSet)
    modes: float | Literal["raw"] = setting("raw", above=0, doc="raw, number, or share of variance below 1")
    pose_smoothing: float = setting(0.12, least=0, doc="seconds")
    clip_means: bool = setting(True, doc="remove each clip's mean shape")
    outlier: float = setting(10.0, above=0, doc="robust standard deviations")
    seed: int = setting(1, least=0)

    def __post_init__(self) -> None:
        """Refuse values that mean nothing."""
        check_settings(self, "face")

    @classmethod
    def from_dict(cls, value: Mapping[str, Any]) -> "PointsSettings":
        """The settings that plain containers (YAML) describe; what is absent keeps its default.

        Raises:
            DnnvssError: an unknown name or a value out of range.
        """
        return read_settings(cls, value, "face")

    def to_dict(self) -> dict[str, Any]:
        """Plain containers, the inverse of :meth:`from_dict`."""
        return {**vars(self), "points": self.points.to_dict()}
