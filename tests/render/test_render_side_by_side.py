"""Faces next to each other, each under its name."""

import numpy as np

from dnnvss.render.side_by_side import side_by_side


def test_faces_stand_in_rows_and_a_long_name_ends_within_its_own_picture():
    faces = [iter([np.full((40, 120, 3), shade, np.uint8)] * 2) for shade in (10, 20, 30)]
    captions = ["short", "a name that is much too long for a picture this narrow", "x"]
    picture, again = side_by_side(*faces, captions=captions, columns=2)
    assert picture.shape == (2 * (40 + 28), 240, 3) and np.array_equal(picture, again)
    assert picture[40, 0, 0] == 10 and picture[40, 130, 0] == 20 and picture[110, 0, 0] == 30
    assert (picture[68:, 120:] == 255).all()  # three faces in two columns: the last place is empty
    inked = np.flatnonzero((picture[:28, 120:] < 255).any(axis=(0, 2)))
    assert inked[0] >= 8 - 1 and 90 < inked[-1] <= 120 - 8
