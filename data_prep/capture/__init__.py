"""Repair of motion capture: head motion, names, gaps and noise of markers in space."""

from data_prep.capture.head import HeadPose, find_head, jig_of
from data_prep.capture.learnt import Usual, learn_usual
from data_prep.capture.names import Renamed, renamed
from data_prep.capture.repair import Repaired, settled, whole

__all__ = [
    "HeadPose",
    "Renamed",
    "Repaired",
    "Usual",
    "find_head",
    "jig_of",
    "learn_usual",
    "renamed",
    "settled",
    "whole",
]
