"""Seconds and frames, segments and tiers. Knows nothing of phones or files."""

from dnnvss.timing.clock import FrameClock
from dnnvss.timing.filling import BRIDGE, bridged, fill_invalid
from dnnvss.timing.tiers import Alignment, Segment, Tier

__all__ = ["BRIDGE", "Alignment", "FrameClock", "Segment", "Tier", "bridged", "fill_invalid"]
