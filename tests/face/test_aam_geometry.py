"""Pose, mesh and warp: exactness on shapes whose answers are known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dnnvss.errors import DnnvssError
from dnnvss.face.aam import Warp, triangulate
from dnnvss.face.aam.mesh import barycentric, rim, signed_area
from dnnvss.face.pose import PoseReference, fit_pose, mean_shape, smooth_pose, to_image, to_reference

SQUARE = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 6.0], [0.0, 6.0]])


def test_triangles_of_a_square_cover_it_once_and_turn_one_way() -> None:
    triangles = triangulate(SQUARE)
    areas = signed_area(SQUARE, triangles)
    assert len(triangles) == 2 and (areas > 0).all() and areas.sum() == pytest.approx(48)


def test_slivers_on_the_rim_are_left_out() -> None:
    points = np.vstack([SQUARE, [[4.0, 6.001]]])
    assert (signed_area(points, triangulate(points)) > 0.5).all()


def test_the_rim_passes_each_point_once_and_inner_slivers_stay() -> None:
    random = np.random.default_rng(8)
    for _ in range(60):
        along = np.sort(random.uniform(0, np.pi, 9))
        jaw = np.column_stack([40 * np.cos(along), 30 * np.sin(along)]) + random.normal(0, 0.3, (9, 2))
        lips = np.column_stack([np.linspace(-12, 12, 7), np.r_[8:8:4j, 8:8.3:3j]])
        points = np.vstack([jaw, lips, lips + np.array([0, 0.2]), random.uniform(-6, 6, (4, 2)) - [0, 4]])
        triangles = triangulate(points)
        outline = points[rim(triangles)]
        x, y = outline.T
        enclosed = 0.5 * abs((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
        assert signed_area(points, triangles).sum() == pytest.approx(enclosed)


def test_a_mesh_in_two_patches_has_no_rim() -> None:
    with pytest.raises(DnnvssError, match="not one closed line"):
        rim(np.array([[0, 1, 2], [3, 4, 5]]))


def test_barycentric_coordinates_by_hand() -> None:
    corners = np.array([[[0.0, 0.0], [4.0, 0.0], [0.0, 2.0]], [[1.0, 1.0], [1.0, 3.0], [5.0, 1.0]]])
    found = barycentric(np.array([[1.0, 0.5], [4.0, 0.0], [2.0, 2.0]]), corners, np.array([0, 0, 1]))
    assert found == pytest.approx(np.array([[0.5, 0.25, 0.25], [0, 1, 0], [0.25, 0.5, 0.25]]))


def test_warp_at_its_own_shape_returns_the_pixels() -> None:
    image = np.random.default_rng(1).integers(0, 256, (6, 8, 3), dtype=np.uint8)
    warp = Warp(SQUARE, triangulate(SQUARE))
    assert warp.size == (6, 8) and len(warp.pixels) == 48
    texture = warp.sample(image, SQUARE)
    assert (texture == image.reshape(-1, 3)).all()
    assert (warp.picture(texture) == image).all()


def test_warp_of_an_affine_picture_is_exact() -> None:
    """A linear ramp seen through an affine map stays a ramp; bilinear reading is exact on it."""
    y, x = np.mgrid[:60, :60] + 0.5
    image = np.stack([x, y, 0.5 * x + 0.25 * y], axis=-1).astype(np.float32)
    warp = Warp(SQUARE, triangulate(SQUARE), scale=2.0)
    matrix, move = np.array([[3.0, 0.7], [-0.4, 2.5]]), np.array([10.0, 12.0])
    texture = warp.sample(image, SQUARE @ matrix.T + move)
    row, column = np.divmod(warp.pixels, warp.size[1])
    centres = (np.column_stack([column, row]) + 0.5) / 2
    expected = centres @ matrix.T + move
    # cv2.remap rounds positions to 1/32 pixel
    assert texture[:, :2] == pytest.approx(expected, abs=1 / 32)
    assert texture[:, 2] == pytest.approx(expected @ [0.5, 0.25], abs=1 / 32)


def test_pixels_outside_the_mesh_have_no_texture() -> None:
    triangle = np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]])
    warp = Warp(triangle, np.array([[0, 1, 2]]))
    picture = warp.picture(np.ones((len(warp.pixels), 1)), fill=-1.0)[..., 0]
    y, x = np.mgrid[:10, :10] + 0.5
    assert ((picture == 1) == (x + y <= 10)).all()


@given(st.floats(0.5, 2), st.floats(-1, 1), st.floats(-50, 50), st.floats(-50, 50))
def test_pose_finds_the_similarity_and_undoes_it(scale: float, angle: float, x: float, y: float) -> None:
    reference = np.random.default_rng(2).normal(0, 10, (7, 2)) + 40
    pivot = reference.mean(axis=0)
    pose = np.array([[scale * np.cos(angle), scale * np.sin(angle), x, y]])
    placed = to_image(reference[None], pose, pivot)
    assert fit_pose(placed, reference) == pytest.approx(pose, abs=1e-9)
    assert to_reference(placed, pose, pivot)[0] == pytest.approx(reference, abs=1e-9)


def test_pose_against_a_dense_least_squares_solve() -> None:
    random = np.random.default_rng(3)
    reference, points = random.normal(0, 5, (6, 2)), random.normal(0, 5, (1, 6, 2))
    pivot = reference.mean(axis=0)
    (x, y), one = (reference - pivot).T, np.ones(6)
    rows = np.concatenate([np.column_stack([x, -y, one, 0 * one]), np.column_stack([y, x, 0 * one, one])])
    expected = np.linalg.lstsq(rows, np.concatenate([points[0, :, 0], points[0, :, 1]]), rcond=None)[0]
    assert fit_pose(points, reference)[0] == pytest.approx(expected, abs=1e-10)


def test_mean_shape_of_one_shape_in_many_poses_is_that_shape() -> None:
    shape = np.random.default_rng(4).normal(0, 10, (8, 2))
    random = np.random.default_rng(5)
    poses = np.column_stack([random.normal(1, 0.05, 41), random.normal(0, 0.05, 41), random.normal(50, 3, (41, 2))])
    mean = mean_shape(to_image(shape[None], poses, shape.mean(axis=0)))
    back = to_reference(mean, fit_pose(mean[None], shape)[0], shape.mean(axis=0))
    assert back == pytest.approx(shape, abs=1e-3)


@pytest.mark.parametrize("sigma", [0.7, 3.0, 40.0])
def test_smoothing_keeps_a_straight_line_to_its_ends_across_a_gap(sigma: float) -> None:
    line = np.outer(np.arange(30.0), [0.1, -0.2, 3.0, 1.0]) + 5
    valid = np.ones(30, dtype=bool)
    valid[10:14] = False
    broken = line.copy()
    broken[10:14] = 1e3
    assert smooth_pose(broken, valid, sigma) == pytest.approx(line, abs=1e-6)


@pytest.mark.parametrize("sigma", [1e-9, 0.13, 0.19, 0.2, 0.25])
def test_next_to_no_smoothing_leaves_poses_as_they_are(sigma: float) -> None:
    pose = np.tile([1.0, 0.0, 160.0, 160.0], (20, 1)) + np.random.default_rng(6).normal(0, 0.01, (20, 4))
    valid = np.ones(20, dtype=bool)
    valid[[4, 6]] = False  # the frame between them has no neighbour to lay a line through
    assert smooth_pose(pose, valid, sigma) == pytest.approx(smooth_pose(pose, valid, 0.0), abs=0.03)


def test_smoothing_takes_out_jitter_as_the_equivalent_kernel_says() -> None:
    noise = np.random.default_rng(6).normal(0, 1, (4000, 4))
    smooth = smooth_pose(noise, np.ones(4000, dtype=bool), 3.0)
    # inside, the line's value is the Gaussian mean: variance 1 / (2 sqrt(pi) sigma)
    assert smooth[50:-50].var() == pytest.approx(1 / (2 * np.sqrt(np.pi) * 3), rel=0.1)


def test_no_valid_frame_gives_the_reference_pose() -> None:
    reference = PoseReference(SQUARE, 0.1)
    poses = reference.poses(np.zeros((3, 4, 2)), np.zeros(3, dtype=bool), 25.0)
    assert poses == pytest.approx(np.tile([1, 0, 4, 3], (3, 1)))
    assert np.isinf(reference.residual(np.zeros((2, 4, 2)))).all()
