"""JSON that every reader takes: numbers that are not finite are null."""

import json
from pathlib import Path

import numpy as np

from dnnvss import files


def test_numbers_that_are_not_finite_are_null(tmp_path: Path) -> None:
    value = {"a": float("nan"), "b": [1.5, -np.inf, (np.float64("nan"), 2)], "c": {"d": True, "e": "NaN"}}
    text = files.write_json(tmp_path / "x.json", value).read_text()

    def refuse(name: str) -> None:
        raise AssertionError(name)

    read = json.loads(text, parse_constant=refuse)
    assert read == {"a": None, "b": [1.5, None, [None, 2]], "c": {"d": True, "e": "NaN"}}
