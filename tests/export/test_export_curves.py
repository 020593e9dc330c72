"""Curves as a table of numbers."""

from pathlib import Path

import numpy as np
import pytest

from dnnvss.export.curves import write_curves
from dnnvss.timing import FrameClock


def test_a_line_a_picture_with_the_second_at_which_it_is_shown(tmp_path: Path) -> None:
    curves = {"aperture": np.array([0.5, 12.25, -3.0]), "aam01": np.array([1000.0, 0.001, 2.0])}
    text = write_curves(tmp_path / "c.csv", curves, FrameClock("29.97")).read_text()
    assert text == "frame,seconds,aperture,aam01\n0,0.000000,0.5,1000\n1,0.033367,12.25,0.001\n2,0.066733,-3,2\n"
    with pytest.raises(ValueError, match="shorter"):
        write_curves(tmp_path / "d.csv", {"a": np.zeros(3), "b": np.zeros(2)}, FrameClock(25))
    assert not (tmp_path / "d.csv").exists()
