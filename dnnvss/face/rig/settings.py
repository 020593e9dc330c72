"""The settings of a rig."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

from dnnvss.errors import DnnvssError
from dnnvss.settings import check_settings, read_settings, setting

_ARKIT = {"aperture": {"JawOpen": 1.0, "MouthClose": -1.0}}


@dataclass(frozen=True)
class RigSettings:
    """How a rig is fitted; the defaults are those of ``conf/face/rig.yaml``.

    Args:
        ranges: curve to its least and greatest value; of the others, 0 to 1 where no training
            value lies outside, else the least and greatest training value.
        still: share of its range that a curve must move in training; one that moves less is no
            parameter and stands where it stood.
        gauges: name of a gauge to the curves that it is the weighted sum of, beside one for each
            curve. One with a curve that the rig has not is left out. ``aperture`` lets closures be
            held and measured.
    """

    face: ClassVar[str] = "rig"

    ranges: Mapping[str, tuple[float, float]] = setting({})
    still: float = setting(1e-3, least=0, below=1, doc="share of its range")
    gauges: Mapping[str, Mapping[str, float]] = setting(_ARKIT)

    def __post_init__(self) -> None:
        """Refuse values that mean nothing."""
        check_settings(self, "face")
        for name, (low, high) in self.ranges.items():
            if low >= high:
                raise DnnvssError(
                    f"face.ranges.{name} is {low:g} to {high:g}",
                    remedy="Give the least value and a greater one",
                )

    @classmethod
    def from_dict(cls, value: Mapping[str, Any]) -> "RigSettings":
        """The settings that plain containers (YAML) describe; what is absent keeps its default.

        Raises:
            DnnvssError: an unknown name or a value out of range.
        """
        return read_settings(cls, value, "face")

    def to_dict(self) -> dict[str, Any]:
        """Plain containers, the inverse of :meth:`from_dict`."""
        plain = asdict(self)
        return {**plain, "ranges": {name: list(ends) for name, ends in self.ranges.items()}}
