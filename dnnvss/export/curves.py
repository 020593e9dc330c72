"""Curves for other programs: named values, a line for each picture."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.timing import FrameClock


def write_curves(path: Path, curves: Mapping[str, np.ndarray], clock: FrameClock) -> Path:
    """Write a ``.csv`` with a line a picture: its number, the seconds at which it is shown, and every curve's value.

    Args:
        path: the file.
        curves: name to values (F,), one a picture.
        clock: of the pictures.
    """
    lines = [",".join(["frame", "seconds", *curves])]
    for i, values in enumerate(zip(*curves.values(), strict=True)):
        lines.append(",".join([str(i), f"{clock.seconds(i):.6f}", *(f"{value:.6g}" for value in values)]))
    return files.write_text(path, "\n".join([*lines, ""]))
