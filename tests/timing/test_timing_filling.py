"""Frames that are not valid are filled from their neighbours."""

import numpy as np
import pytest

from dnnvss.timing import fill_invalid

SOME = np.array([False, True, False, True, False])


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_frames_between_lie_on_lines_and_ends_are_held(kind: type) -> None:
    values = np.array([[[np.nan, 0]], [[2, 0]], [[np.nan, 0]], [[6, 1]], [[np.nan, 0]]], dtype=kind)
    filled = fill_invalid(values, SOME)
    assert filled[:, 0].tolist() == [[2, 0], [2, 0], [4, 0.5], [6, 1], [6, 1]]
    assert filled.dtype == kind and np.isnan(values[0, 0, 0])


def test_one_valid_frame_is_everywhere() -> None:
    assert fill_invalid(np.array([9.0, 4.0, 9.0]), np.array([False, True, False])).tolist() == [4, 4, 4]


@pytest.mark.parametrize("valid", [True, False])
def test_all_or_no_valid_frames_stay_as_they_are(valid: bool) -> None:
    values = np.arange(10.0).reshape(5, 2)
    filled = fill_invalid(values, np.full(5, valid))
    assert filled.tolist() == values.tolist() and filled is not values
