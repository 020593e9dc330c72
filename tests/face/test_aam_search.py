"""The search: its parts against their definitions, and the whole on pictures whose points are known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from face import search_cases as cases

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.search.find import detect, search
from dnnvss.face.aam.search.fit import fit_search, learn_limits
from dnnvss.face.aam.search.model import SearchLimits, SearchModel, SearchSettings, build
from dnnvss.face.aam.search.shapes import Shapes, fit_shapes, mesh_for, slopes


def _turned(points: np.ndarray, scale: float, angle: float, move: tuple[float, float]) -> np.ndarray:
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return points @ turn.T + move


@pytest.fixture(scope="module")
def shapes() -> Shapes:
    return fit_shapes(cases.labelled()[1], 0.99)


def test_modes_are_orthonormal_and_free_of_pose(shapes: Shapes) -> None:
    basis = shapes.basis.reshape(len(shapes.basis), -1)
    np.testing.assert_allclose(basis @ basis.T, np.eye(len(basis)), atol=1e-9)


def test_points_of_the_model_are_their_own_projection_in_any_pose(shapes: Shapes) -> None:
    own = shapes.deviations * np.linspace(-1.5, 1.5, len(shapes.deviations))
    points = _turned(shapes.mean + np.tensordot(own, shapes.modes, axes=1), 1.3, 0.2, (40, -7))
    projected, parameters = shapes.project(np.float32(points.T))
    np.testing.assert_allclose(projected.T, points, atol=1e-3)
    np.testing.assert_allclose(parameters, own, atol=1e-3 * shapes.deviations.max())
    assert float(shapes.scale(points)) == pytest.approx(1.3, rel=1e-6)


def test_no_mode_leaves_three_deviations(shapes: Shapes) -> None:
    far = shapes.mean + 9 * shapes.deviations[0] * shapes.modes[0]
    _, parameters = shapes.project(np.float32(far.T))
    assert parameters[0] == pytest.approx(3 * shapes.deviations[0], rel=1e-4)


def test_slopes_of_an_affine_map_are_its_matrix(shapes: Shapes) -> None:
    matrix = np.array([[1.2, 0.3], [-0.1, 0.8]])
    local = slopes(shapes.mean, shapes.triangles) @ (shapes.mean @ matrix.T + [5, 6])
    inside = np.isin(np.arange(len(shapes.mean)), shapes.triangles)
    np.testing.assert_allclose(local[0][inside], np.tile(matrix[:, 0], (inside.sum(), 1)), atol=1e-9)
    np.testing.assert_allclose(local[1][inside], np.tile(matrix[:, 1], (inside.sum(), 1)), atol=1e-9)


def test_the_mesh_does_not_join_lips_that_part() -> None:
    closed = np.array([(0, 0), (4, -3), (8, 0), (4, 3), (3, -0.1), (5, -0.1), (3, 0.1), (5, 0.1)], float)
    opened = closed + np.array([(0, 0), (0, 0), (0, 0), (0, 4), (0, 0), (0, 0), (0, 4), (0, 4)])
    triangles = mesh_for((closed + opened) / 2, np.stack([closed, opened]))
    a, b, c = np.moveaxis(opened[triangles], 1, 0)
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert (area > 0).all()


def test_the_step_is_that_of_the_written_out_least_squares() -> None:
    model = cases.model()
    level = model.levels[-1]
    random = np.random.default_rng(0)
    coefficients, left, _ = level.explain(random.normal(100, 20, level.appearance.shape[1]).astype(np.float32))
    own = random.normal(size=len(model.shapes.modes)).astype(np.float32)
    gx, gy = level._gradients
    wx, wy = level._carried
    jacobian = ((coefficients @ gx) * wx + (coefficients @ gy) * wy).T.astype(float)
    basis = level.appearance.T.astype(float)
    outside = jacobian - basis @ (basis.T @ jacobian)
    precision = np.concatenate([np.zeros(4), level.prior / model.shapes.deviations**2]) * (left @ left) / len(left)
    hessian = outside.T @ jacobian + np.diag(precision)
    expected = np.linalg.solve(hessian, jacobian.T @ left + precision * np.concatenate([np.zeros(4), own]))
    np.testing.assert_allclose(level.step(coefficients, left, own), expected, rtol=2e-3, atol=1e-3)


def test_light_does_not_matter() -> None:
    level = cases.model().levels[-1]
    texture = np.random.default_rng(1).normal(100, 30, level.appearance.shape[1]).astype(np.float32)
    assert level.explain(1.7 * texture - 30)[2] == pytest.approx(level.explain(texture)[2], rel=1e-3)


@pytest.mark.parametrize("settings", [SearchSettings(), SearchSettings(colour="rgb"), SearchSettings(project_out=True)])
def test_unseen_frames_are_found(settings: SearchSettings) -> None:
    model = build(*cases.labelled(), settings, SearchLimits(1.0, np.inf, 0.0))
    pictures, points = cases.clip(5)
    found = [search(model, i, model.shapes.mean + p.mean(axis=0)) for i, p in zip(pictures[::5], points[::5],
                                                                                   strict=True)]
    errors = [cases.error(f.points, p) for f, p in zip(found, points[::5], strict=True)]
    assert np.mean(errors) < 0.3 and np.max(errors) < 0.6


def test_a_start_far_off_is_bettered_by_the_mean_picture() -> None:
    model = cases.model()
    pictures, points = cases.clip(5)
    random = np.random.default_rng(0)
    errors = []
    for picture, true in zip(pictures[::4], points[::4], strict=True):
        turn = random.uniform(0, 2 * np.pi)
        start = model.shapes.mean + true.mean(axis=0) + 12 * np.array([np.cos(turn), np.sin(turn)])
        errors.append(cases.error(search(model, picture, start, wide=True).points, true))
    assert np.max(errors) < 0.6


def test_a_bright_patch_over_the_cheek_moves_the_lips_little() -> None:
    model = cases.model()
    pictures, points = cases.clip(5)
    picture = pictures[0].copy()
    x, y = points[0][cases.LIPS].max(axis=0).astype(int) + np.array([6, 2])
    picture[y:y + 6, x:x + 6] = 255
    assert cases.error(search(model, picture, points[0]).points, points[0]) < 0.6


@pytest.mark.parametrize("larger", [0.6, 1.5, 2.5])
def test_faces_of_other_sizes_are_detected(larger: float) -> None:
    model = cases.model()
    picture, points = cases.clip(5)[0][0], cases.clip(5)[1][0]
    side = round(cases.SIZE * larger)
    resized = np.asarray(cases.cv2.resize(picture, (side, side), interpolation=cases.cv2.INTER_AREA))
    found = detect(model, resized)[0]
    assert cases.error(found.points, points * side / cases.SIZE) < 0.5 * max(larger, 1)


def test_a_saved_model_finds_the_same(tmp_path: Path) -> None:
    model = cases.model()
    again = SearchModel.load(model.save(tmp_path / "search.npz"))
    picture, points = cases.clip(5)[0][3], cases.clip(5)[1][3]
    assert again.settings == model.settings and again.limits == model.limits
    np.testing.assert_array_equal(search(again, picture, points).points, search(model, picture, points).points)


def test_limits_come_from_frames_that_the_model_had_not_seen() -> None:
    model = cases.model()
    images, points = cases.labelled()
    seen = learn_limits([search(model, i, p) for i, p in zip(images, points, strict=True)])
    assert model.limits.error >= seen.error > 0


def test_wrong_labels_are_refused() -> None:
    images, points = cases.labelled()
    with pytest.raises(DnnvssError, match="labelled frame 3 are not in its picture"):
        fit_search(images, np.where(np.arange(len(points))[:, None, None] == 3, points + 900, points))
    with pytest.raises(DnnvssError, match="on one line"):
        fit_search(images, np.stack([np.linspace(10, 50, 12)] * 2, axis=1)[None].repeat(len(images), 0))
    with pytest.raises(DnnvssError, match="a model needs 3"):
        fit_search(images[:2], points[:2])
    with pytest.raises(DnnvssError, match=r"search\.scales"):
        replace(SearchSettings(), scales=(1.0, 0.5))
    for name in ("shape_variance", "appearance_variance"):
        with pytest.raises(DnnvssError, match=rf"search\.{name} is 1\.0\. Give a share above 0 and below 1"):
            replace(SearchSettings(), **{name: 1.0})
