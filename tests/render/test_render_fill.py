"""Shapes laid over one another: by hand, and the same head by EGL as by OpenCV."""

import sys
import threading

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.face.mesh import packaged_head
from dnnvss.render.egl import Egl, EglFill, open_egl
from dnnvss.render.fill import VARIABLE, OpenCvFill, fill_for
from dnnvss.render.solid import Solid, whole_head

GROUND = (250, 248, 245)


def egl() -> Egl:
    """EGL, or the reason why a test of it is skipped."""
    try:
        return open_egl()
    except DnnvssError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("way", ["opencv", "egl"])
def test_the_last_shape_lies_on_top_and_edges_stand_where_pixels_end(way, monkeypatch):
    if way == "egl":
        egl()
    monkeypatch.setenv(VARIABLE, way)
    fill = fill_for((8, 6), GROUND, 8)
    square = np.array([[2, 1], [2, 4], [6, 4], [6, 1]], float)
    half = np.array([[2, 1], [2, 4], [4, 4], [4, 1]], float)
    picture = fill(np.stack([square, half]), np.array([[200.0, 10, 20], [30, 40, 50.4]]))
    assert picture.shape == (6, 8, 3) and picture.dtype == np.uint8
    assert (picture[2, 5] == [200, 10, 20]).all() and (picture[2, 2] == [30, 40, 50]).all()
    # OpenCV's shapes are wider by half a drawn pixel
    np.testing.assert_allclose(picture[2, 4], [200, 10, 20], atol=25)
    np.testing.assert_allclose(picture[5], np.tile(GROUND, (8, 1)), atol=40)
    np.testing.assert_allclose(picture[2, [1, 6]], np.tile(GROUND, (2, 1)), atol=40)


@pytest.mark.parametrize("turn", [0, 35, -90])
def test_egl_draws_the_head_that_opencv_draws(turn, monkeypatch):
    egl()
    head = packaged_head()
    weights = np.zeros((2, len(head.names)), np.float32)
    weights[1, [head.position("jawOpen"), head.position("mouthSmileLeft")]] = 0.6, 1
    pictures = {}
    for way in ("opencv", "egl"):
        monkeypatch.setenv(VARIABLE, way)
        solid = Solid(head.mesh, whole_head(head.mesh, 480, turn), smooth=2)
        pictures[way] = np.array([solid.picture(head.vertices(row)) for row in weights], float)
    apart = np.abs(pictures["egl"] - pictures["opencv"]).max(axis=-1)
    assert apart.mean() < 1.5 and (apart > 16).mean() < 0.02
    moved = np.abs(np.diff(pictures["egl"], axis=0)).max(axis=-1) > 60
    assert (np.abs(np.diff(pictures["opencv"], axis=0)).max(axis=-1)[0][moved[0]] > 30).mean() > 0.97


def test_egl_draws_in_any_thread_and_grows_with_its_shapes():
    egl()
    fill, found = EglFill((64, 48), GROUND, 2), []
    square = np.array([[[0, 0], [0, 48], [64, 48], [64, 0]]], float)

    def draw(count: int) -> None:
        colours = np.full((count, 3), 100.0)
        colours[-1] = 7
        found.append(fill(np.repeat(square, count, axis=0), colours))

    for count in (1, 500, 20):
        thread = threading.Thread(target=draw, args=(count,))
        thread.start()
        thread.join()
    draw(3)
    assert len(found) == 4 and all((picture == 7).all() for picture in found)


def test_a_picture_too_large_for_the_driver_is_refused():
    egl()
    with pytest.raises(DnnvssError, match="too large for EGL"):
        EglFill((100_000, 100), GROUND, 2)


def test_what_draws_is_chosen(monkeypatch):
    monkeypatch.setenv(VARIABLE, "opencv")
    assert isinstance(fill_for((8, 8), GROUND, 1), OpenCvFill)
    monkeypatch.setenv(VARIABLE, "vulkan")
    with pytest.raises(DnnvssError, match="no way to draw"):
        fill_for((8, 8), GROUND, 1)
    processor, card = Egl(None, "llvmpipe (LLVM 15.0.6, 256 bits)"), Egl(None, "NVIDIA H200/PCIe/SSE2")
    assert card.by_card and not processor.by_card


def test_what_is_missing_is_named(monkeypatch):
    open_egl.cache_clear()
    monkeypatch.setitem(sys.modules, "moderngl", None)
    monkeypatch.setenv(VARIABLE, "egl")
    with pytest.raises(DnnvssError, match="moderngl is not installed") as error:
        fill_for((8, 8), GROUND, 1)
    assert "dnnvss[egl]" in str(error.value)
    monkeypatch.undo()
    pytest.importorskip("moderngl")
    monkeypatch.setattr("dnnvss.render.egl._LIBRARIES", {"libgl": "libGL.so.1", "libegl": "libNone.so.1"})
    with pytest.raises(DnnvssError, match="Install libegl1"):
        open_egl()
    open_egl.cache_clear()
