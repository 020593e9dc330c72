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
    with files.replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write(files.printable(",".join(["frame", "seconds", *curves])) + "\n")
        for i, values in enumerate(zip(*curves.values(), strict=True)):
            row = [str(i), f"{clock.seconds(i):.6f}", *(f"{value:.6g}" for value in values)]
            file.write(",".join(row) + "\n")
    return path
