"""A face of points is drawn where its points are, with a mouth that opens and closes."""

import numpy as np
import pytest
from face.points_cases import GROUPS, SETTINGS, clips

from dnnvss.errors import DnnvssError
from dnnvss.face.points import PointsFace, fit_points
from dnnvss.render.sketch import HEIGHT, Sketch
from dnnvss.render.strokes import strokes_of


@pytest.fixture(scope="module", params=[2, 3])
def face(request: pytest.FixtureRequest) -> PointsFace:
    return fit_points(clips(request.param), GROUPS, SETTINGS)


def opened(face: PointsFace, amount: float) -> np.ndarray:
    """Parameters (1, 2) of a mouth whose aperture is ``amount``."""
    gauge = face.gauges["aperture"]
    return (gauge.vector * (amount - gauge.constant) / (gauge.vector @ gauge.vector))[None]


def test_pictures_have_the_size_and_number_asked_for(face: PointsFace) -> None:
    sketch, double = Sketch(face), Sketch(face, 2.0)
    assert sketch.size[1] == HEIGHT and sketch.size[0] % 2 == 0
    assert double.size[1] == 2 * HEIGHT
    pictures = list(sketch.frames(np.zeros((3, face.size))))
    assert [p.shape for p in pictures] == [(HEIGHT, sketch.size[0], 3)] * 3
    assert pictures[0].dtype == np.uint8
    np.testing.assert_array_equal(pictures[0], pictures[1])
    with pytest.raises(DnnvssError, match="scale"):
        Sketch(face, 0.0)


def test_points_lie_in_the_picture_as_in_the_face(face: PointsFace) -> None:
    sketch = Sketch(face)
    parameters = np.random.default_rng(0).normal(0, 0.5, (20, 2)) * face.deviations + opened(face, 12)
    placed, own = sketch.points_in_image(parameters), face.points(parameters)
    assert (placed > 0).all() and (placed < sketch.size).all()
    down = placed[..., 1] - placed[:1, :1, 1]
    zoom = np.ptp(down) / np.ptp(own[..., 1])
    assert down == pytest.approx(zoom * (own[..., 1] - own[0, 0, 1]), abs=1e-6)


def test_the_mouth_is_dark_when_open_and_shut_when_its_lips_cross(face: PointsFace) -> None:
    sketch = Sketch(face)
    inner = face.layout.inner
    for aperture, dark in ((14.0, True), (-4.0, False)):
        parameters = opened(face, aperture)
        points = sketch.points_in_image(parameters)[0]
        upper, lower = points[inner[1]], points[inner[3]]
        assert (lower[1] - upper[1] > 5) == dark
        assert lower[1] >= upper[1] - 1e-9
        x, y = ((upper + lower) / 2).astype(int)
        red = next(sketch.frames(parameters))[y, x, 0]
        assert (red < 120) == dark


def test_dots_mark_the_modelled_points_in_the_view_of_the_mesh(face: PointsFace) -> None:
    sketch = Sketch(face, 2.0)
    parameters = opened(face, 10)
    plain, mesh = (next(sketch.view(name, parameters)) for name in sketch.views)
    x, y = sketch.points_in_image(parameters)[0, -2].astype(int)  # the chin
    assert mesh[y, x].astype(int).sum() < plain[y, x].astype(int).sum() - 60


def test_lines_are_closed_broken_and_joined_where_the_points_say() -> None:
    ring = [[np.cos(a), np.sin(a)] for a in np.arange(8) * np.pi / 4]
    brow = [[10 + x, y] for y in (0, 1) for x in range(5)]
    jaw = [[x, 5 + x % 2] for x in range(5)]
    wings = [[0, 0], [0, 1], [30, 0], [30, 1]]
    rest = np.array(ring + brow + jaw + wings, float)
    groups = {"right_eye": (0, 8), "right_brow": (8, 18), "jaw": (18, 23), "wings": (23, 27)}
    strokes = strokes_of(groups, rest, "lips_outer", "lips_inner", ("right_eye",))
    found = sorted((s.kind, s.closed, s.rows.tolist()) for s in strokes)
    assert found == [("brow", True, [8, 9, 10, 11, 12, 17, 16, 15, 14, 13]), ("eye", True, list(range(8))),
                     ("line", False, [18, 19, 20, 21, 22]), ("line", False, [23, 24]), ("line", False, [25, 26])]


def test_curves_run_through_their_landmarks() -> None:
    rest = np.array([[0, 0], [4, 1], [6, 5], [2, 7], [-1, 4]], float)
    for closed in (False, True):
        stroke = strokes_of({"line": (0, 5)}, rest, "", "", ())[0]
        stroke = type(stroke)("line", stroke.rows, closed)
        curve = stroke.curve(rest)
        assert np.abs(curve[::8][:5] - rest).max() < 1e-12
        assert len(curve) == (40 if closed else 33)
    with_middle = stroke.curve(np.array([[0, 0], [1, 0], [2, 0], [3, 0], [4, 0]], float))
    assert with_middle[8 + 4] == pytest.approx([1.5, 0])
