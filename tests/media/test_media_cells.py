"""Pictures made small from their planes look as they do made small from RGB."""

import av
import cv2
import numpy as np
import pytest

from dnnvss.media.cells import Cells, shares
from dnnvss.media.decoding import Look

QUARTER = Look((0, 65536, 0, -65536, 0, 0, 0, 0, 0))


def stored(image: np.ndarray, form: str = "yuv420p") -> av.VideoFrame:
    return av.VideoFrame.from_ndarray(image, format="rgb24").reformat(format=form)


def smooth(height: int = 48, width: int = 64) -> np.ndarray:
    """Colours that change slowly, so that half as fine planes of colour lose nothing."""
    y, x = np.mgrid[:height, :width] / max(height, width)
    return np.stack([60 + 120 * x, 200 - 90 * y, 80 + 60 * x * y], axis=-1).round().astype(np.uint8)


def by_area(frame: av.VideoFrame, look: Look = Look()) -> np.ndarray:  # noqa: B008
    image = look.upright(frame.reformat(format="rgb24").to_ndarray())
    return np.asarray(cv2.resize(image, (8, 6), interpolation=cv2.INTER_AREA))


def test_a_pixel_counts_in_the_cells_that_it_lies_in() -> None:
    assert shares(3, 2) == pytest.approx(np.array([[2 / 3, 1 / 3, 0], [0, 1 / 3, 2 / 3]]))
    assert shares(45, 16).sum(axis=1) == pytest.approx(np.ones(16), abs=1e-6)


@pytest.mark.parametrize("colour", [(0, 0, 0), (255, 255, 255), (200, 30, 40), (20, 180, 60), (30, 60, 220)])
def test_a_picture_of_one_colour_has_cells_of_it(colour: tuple[int, int, int]) -> None:
    found = Cells(8, 6)(stored(np.full((48, 64, 3), colour, np.uint8)), Look())
    assert found.shape == (6, 8, 3) and found.dtype == np.uint8
    assert np.abs(found.astype(int) - colour).max() <= 2


@pytest.mark.parametrize("size", [(48, 64), (50, 90), (288, 360)])
def test_cells_are_those_of_the_picture(size: tuple[int, int]) -> None:
    frame = stored(smooth(*size))
    assert np.abs(Cells(8, 6)(frame, Look()).astype(int) - by_area(frame)).max() <= 2


@pytest.mark.parametrize(("frame", "look"), [
    (stored(smooth()), QUARTER), (stored(smooth(), "yuv444p"), Look()), (stored(smooth(49, 65)), Look()),
    (stored(smooth(10, 12)), Look()), (stored(smooth(), "yuvj420p"), Look())])
def test_other_pictures_are_made_rgb_first(frame: av.VideoFrame, look: Look) -> None:
    assert (Cells(8, 6)(frame, look) == by_area(frame, look)).all()


def test_pictures_of_another_colour_space_are_made_rgb_first() -> None:
    frame = stored(smooth())
    frame.colorspace = 1  # BT.709
    assert (Cells(8, 6)(frame, Look()) == by_area(frame)).all()
