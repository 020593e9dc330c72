"""Pictures read between their pixels: themselves on them, bicubic between them, and the same whatever was changed."""

import cv2
import numpy as np
import pytest

from dnnvss.render.finer import FinerPicture, finer_places, finer_times


def picture(seed: int = 0, size: tuple[int, int] = (40, 60)) -> np.ndarray:
    """Noise without what is finer than a few pixels, as a camera sees."""
    noise = np.random.default_rng(seed).integers(0, 256, (*size, 3), np.uint8)
    return cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 1.5), None, 0, 255, cv2.NORM_MINMAX)  # type: ignore[call-overload, no-any-return]


def read(finer: FinerPicture, shift: tuple[float, float], size: tuple[int, int] = (40, 60)) -> np.ndarray:
    y, x = np.mgrid[: size[0], : size[1]]
    places = finer_places(np.stack([x + shift[0], y + shift[1]]), finer.times).astype(np.float32)
    return finer.read(places[0], places[1])


@pytest.mark.parametrize("size, times", [((8, 360), 3), ((8, 10_000), 3), ((8, 12_000), 1), ((8, 40_000), 1),
                                         ((2560, 1440), 3), ((3840, 2160), 1), ((1, 1), 3)])
def test_no_picture_is_larger_than_opencv_can_address_or_a_cache_could_serve(size: tuple[int, int], times: int) -> None:
    assert finer_times(size) == times


def test_a_pixel_read_where_it_was_is_itself() -> None:
    own = picture()
    assert (read(FinerPicture.of(own, 3), (0, 0)) == own).all()


@pytest.mark.parametrize("shift", [(0.5, 0.5), (0.3, -0.2), (-1.25, 2.75)])
def test_between_pixels_it_is_near_the_bicubic_reading(shift: tuple[float, float]) -> None:
    own = picture()
    y, x = np.mgrid[:40, :60].astype(np.float32)
    bicubic = cv2.remap(own, x + np.float32(shift[0]), y + np.float32(shift[1]), cv2.INTER_CUBIC,
                        borderMode=cv2.BORDER_REPLICATE)

    def error(other: np.ndarray) -> float:
        return float(np.square(other.astype(float) - bicubic)[5:-5, 5:-5].mean())

    plain = error(cv2.remap(own, x + np.float32(shift[0]), y + np.float32(shift[1]), cv2.INTER_LINEAR,
                            borderMode=cv2.BORDER_REPLICATE))
    assert error(read(FinerPicture.of(own, 3), shift)) < 0.15 * plain


@pytest.mark.parametrize("shift", [(0, 0), (0.3, -0.2), (-1.25, 2.75)])
def test_a_picture_that_is_not_enlarged_is_read_bicubically(shift: tuple[float, float]) -> None:
    own = picture()
    y, x = np.mgrid[:40, :60].astype(np.float32)
    wanted = cv2.remap(own, x + np.float32(shift[0]), y + np.float32(shift[1]), cv2.INTER_CUBIC,
                       borderMode=cv2.BORDER_REPLICATE)
    np.testing.assert_array_equal(read(FinerPicture.of(own, 1), shift), wanted)


@pytest.mark.parametrize("part", [(slice(10, 25), slice(20, 41)), (slice(0, 7), slice(50, 60)), None])
@pytest.mark.parametrize("times", [1, 3])
def test_what_changed_is_taken_over_as_if_all_were_made_anew(part: tuple[slice, slice] | None, times: int) -> None:
    before, after = picture(1), picture(1)
    inside = part or (slice(0, 40), slice(0, 60))
    after[inside] = picture(2)[inside]
    finer = FinerPicture.of(before, times)
    finer.take(after, part)
    np.testing.assert_array_equal(finer.pixels, FinerPicture.of(after, times).pixels)
