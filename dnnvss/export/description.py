"""What the numbers of an exported network mean; it travels inside the file."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dnnvss.curves import Windows
from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable
from dnnvss.settings import read_settings, setting, shown
from dnnvss.timing import FrameClock

KEY = "dnnvss"
"""The name of the description in the metadata of a file."""
VERSION = 2
_REMEDY = "Export the run again"
SUFFIXES = (".onnx", ".pt2")
"""How a network is written."""
INPUTS, OUTPUTS = ("active", "numeric"), ("mean", "variance")


@dataclass(frozen=True)
class Description:
    """An exported network for those who run it.

    Args:
        system: the name of the model, as in ``conf/model``.
        table: the columns: ``active`` holds those that are 1 among the binary ones, filled up with
            ``table.binary_width``; ``numeric`` the numbers as they are.
        clock: of the frames.
        windows: the streams of the outputs.
        coefficients: the name of each column of a stream.
        scaler: mean and deviation of the numeric columns, which the graph takes off by itself.
        streams: mean, deviation and variance (W, D) of the targets, nested lists.
        predicted: whether the network tells a variance for every frame; otherwise all frames have that of ``streams``.
        reach: frames before and after its own that an output looks at; (0, 0) where frames may be given in any parts,
            otherwise a whole utterance is to be given.
    """

    system: str
    table: FeatureTable
    clock: FrameClock
    windows: Windows
    coefficients: tuple[str, ...]
    scaler: Mapping[str, Any]
    streams: Mapping[str, Any]
    predicted: bool
    reach: tuple[int, int] = (0, 0)

    def to_json(self) -> str:
        """Return the description as JSON."""
        return json.dumps({
            "version": VERSION, "system": self.system, "table": self.table.describe(), "rate": str(self.clock),
            "windows": {"names": self.windows.names, "taps": self.windows.taps}, "coefficients": self.coefficients,
            "scaler": dict(self.scaler), "streams": dict(self.streams),
            "predicted": self.predicted, "reach": self.reach, "padding": self.table.binary_width})

    @classmethod
    def from_json(cls, text: str) -> "Description":
        """Return what :meth:`to_json` wrote.

        Raises:
            DnnvssError: no description, one of a later version, or a feature table that means something else here.
        """
        try:
            d = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise DnnvssError("holds no description of its network", remedy=_REMEDY) from error
        if not isinstance(d, Mapping) or d.get("version") != VERSION:
            version = shown(d.get("version")) if isinstance(d, Mapping) else "no"
            raise DnnvssError(f"has version {version}, this program reads {VERSION}", remedy=_REMEDY)
        try:
            kept = read_settings(_Kept, d, "")
            windows = Windows(kept.windows.names, kept.windows.taps)
            return cls(kept.system, FeatureTable.from_description(kept.table), kept.rate, windows,
                       kept.coefficients, kept.scaler, kept.streams, kept.predicted, kept.reach)
        except DnnvssError as error:
            raise DnnvssError(f"describes its network wrongly: {error.problem}", remedy=_REMEDY) from error


@dataclass(frozen=True, kw_only=True)
class _Windows:
    """The streams of the outputs, as they are kept."""

    names: tuple[str, ...]
    taps: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, kw_only=True)
class _Kept:
    """What :meth:`Description.to_json` writes."""

    version: int
    system: str
    table: Mapping[str, Any]
    rate: FrameClock
    windows: _Windows
    coefficients: tuple[str, ...]
    scaler: Mapping[str, Any]
    streams: Mapping[str, Any]
    predicted: bool
    padding: int
    reach: tuple[int, int] = setting(least=0, most=10**9)
