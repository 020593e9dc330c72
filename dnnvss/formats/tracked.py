"""Markers of motion capture, whatever file they are from."""

from dataclasses import dataclass

import numpy as np

IN_MM = {
    "mm": 1.0,
    "cm": 10.0,
    "m": 1000.0,
    "meters": 1000.0,
    "inches": 25.4,
    "in": 25.4,
    "ft": 304.8,
}
"""Unit of a file to millimetres."""


@dataclass(frozen=True)
class Markers:
    """Markers in space over time.

    Args:
        names: of the markers.
        points: (F, M, 3) float64 in millimetres, in the axes of the file; NaN where a marker was not seen.
        rate: frames a second; None where the file does not say it.
    """

    names: tuple[str, ...]
    points: np.ndarray
    rate: float | None = None
