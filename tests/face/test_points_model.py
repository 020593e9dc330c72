"""A face of points finds planted movement under planted head pose, in the plane and in space."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from face.points_cases import GROUPS, ROWS, SETTINGS, clip_of, clips, movement, planted, recorded, shape, turned
from scipy.spatial.transform import Rotation

from dnnvss.errors import DnnvssError
from dnnvss.face.clips import UnusableClipError
from dnnvss.face.kinds import face_kind, load_face
from dnnvss.face.points import PointsCode, PointsFace, PointsSettings, fit_points
from dnnvss.face.points.coding import encode_points
from dnnvss.face.points.pose import SpaceReference, put_back, taken_out

BOTH = pytest.mark.parametrize("dimensions", [2, 3])


@BOTH
def test_the_modes_are_the_planted_ones(dimensions: int) -> None:
    face = fit_points(clips(dimensions), GROUPS, SETTINGS)
    assert face.names == ("shape01", "shape02")
    assert face.mean.shape == (13, dimensions)
    turn = _axes(face, shape(dimensions)[ROWS])
    found = face.modes @ turn
    for mode, wanted in zip(found, planted(dimensions), strict=True):
        sign = np.sign((mode * wanted).sum())
        assert sign * mode == pytest.approx(wanted, abs=1e-9)
    assert face.deviations == pytest.approx([9 / np.sqrt(2), 4 / np.sqrt(2)])


def _axes(face: PointsFace, own: np.ndarray) -> np.ndarray:
    """The rotation from the axes of a face's reference frame to those of shapes (P, 2 or 3)."""
    if face.dimensions == 2:
        return np.eye(2)
    left, _, right = np.linalg.svd((face.mean - face.mean.mean(axis=0)).T @ (own - own.mean(axis=0)))
    return np.asarray(left @ right)


@BOTH
def test_a_known_similarity_is_taken_out(dimensions: int) -> None:
    still = fit_points(clips(dimensions), GROUPS, SETTINGS)
    moved = encode_points(still, clip_of(recorded(dimensions, 1, turned(dimensions, 9))))[0]
    known = encode_points(still, clip_of(recorded(dimensions, 1)))[0]
    assert moved.parameters == pytest.approx(known.parameters, abs=1e-5)  # float32
    assert moved.valid.all() and not moved.outliers
    assert np.abs(moved.parameters).max() > 5


@BOTH
def test_pose_is_exact_without_smoothing(dimensions: int) -> None:
    face = fit_points(clips(dimensions), GROUPS, SETTINGS)
    plain, posed = recorded(dimensions, 2), recorded(dimensions, 2, turned(dimensions, 4))
    stable = face.layout.stable
    valid = np.ones(len(plain), bool)
    out = [taken_out(p, face.reference.poses(p[:, stable], valid, 25.0), face.reference) for p in (plain, posed)]
    assert out[0] == pytest.approx(out[1], abs=1e-9)
    pose = face.reference.poses(posed[:, stable], valid, 25.0)
    assert put_back(out[1], pose, face.reference) == pytest.approx(posed, abs=1e-9)
    assert face.reference.residual(posed[:, stable]) == pytest.approx(np.zeros(len(plain)), abs=1e-9)


def test_poses_in_space_are_smoothed_over_time() -> None:
    points = shape(3)[:4]
    reference = SpaceReference(points, 0.12)
    angles = np.linspace(0, 20, 100)
    noisy = angles + np.random.default_rng(0).normal(0, 2, 100)
    turns = Rotation.from_euler("y", noisy[:, None], degrees=True).as_matrix()
    seen = (points - points.mean(axis=0)) @ np.swapaxes(turns, 1, 2)
    pose = reference.poses(seen, np.ones(100, bool), 25.0)
    found = np.rad2deg(np.arctan2(pose[:, 2], pose[:, 0]))
    assert np.sqrt(np.mean((found - angles) ** 2)) < 0.5 * 2
    turn = pose[:, :9].reshape(-1, 3, 3)
    scale = np.cbrt(np.linalg.det(turn))
    assert turn @ np.swapaxes(turn, 1, 2) == pytest.approx(scale[:, None, None] ** 2 * np.eye(3), abs=1e-9)


@BOTH
def test_gauges_are_what_the_points_say(dimensions: int) -> None:
    face = fit_points(clips(dimensions), GROUPS, SETTINGS)
    parameters = np.random.default_rng(3).normal(0, 1, (5, 2)) * face.deviations
    points = face.points(parameters)
    gauges = face.gauges
    assert gauges["aperture"](parameters) == pytest.approx(points[:, 9, 1] - points[:, 7, 1])
    assert gauges["width"](parameters) == pytest.approx(points[:, 3, 0] - points[:, 0, 0])
    assert gauges["lower_lip"](parameters) == pytest.approx(points[:, 9, 1])
    zeros = np.zeros(2)
    assert gauges["aperture"](zeros) == pytest.approx(6, rel=0.02)
    assert gauges["width"](zeros) == pytest.approx(32, rel=0.02)
    assert {g.unit for g in gauges.values()} == {{2: "px", 3: "mm"}[dimensions]}


def test_the_axes_of_a_face_in_space_are_its_own() -> None:
    lean = Rotation.from_euler("xyz", [25, -20, 15], degrees=True).as_matrix()
    leaning = [clip_of(recorded(3, k, lambda p, i: p @ lean.T + [5, 6, 700]), f"clip{k}") for k in range(4)]
    face, upright = fit_points(leaning, GROUPS, SETTINGS), fit_points(clips(3), GROUPS, SETTINGS)
    for name in ("aperture", "width"):
        assert face.gauges[name].constant == pytest.approx(upright.gauges[name].constant, abs=1e-9)
    corners = face.mean[face.layout.outer[[0, 3]]]
    assert corners[1] - corners[0] == pytest.approx([32, 0, 0], abs=0.1)


@pytest.mark.parametrize("axes", [[0, 1, 2], [2, 0, 1], [1, 2, 0]])
def test_it_does_not_matter_how_the_tracker_s_axes_lie(axes: list[int]) -> None:
    upright = fit_points(clips(3), GROUPS, SETTINGS)
    for sign in (1, -1):  # y up and z towards the viewer
        turn = np.diag([1, sign, sign])[axes]
        own = [clip_of(recorded(3, k, lambda p, i, t=turn: p @ t.T), f"clip{k}") for k in range(4)]
        face = fit_points(own, GROUPS, SETTINGS)
        parameters = np.array([[5.0, 0.0], [0.0, 3.0]])
        for name, gauge in upright.gauges.items():
            if name != "lower_lip":  # its zero is the tracker's
                found = sorted(np.abs(face.gauges[name](parameters) - face.gauges[name].constant))
                assert face.gauges[name].constant == pytest.approx(gauge.constant, abs=1e-9)
                assert found == pytest.approx(sorted(np.abs(gauge(parameters) - gauge.constant)), abs=1e-9)
        upper, lower = (face.mean[face.layout.inner[i]] for i in (1, 3))
        assert lower[1] > upper[1]


@BOTH
def test_raw_parameters_are_the_points_themselves(dimensions: int) -> None:
    face = fit_points(clips(dimensions), GROUPS, replace(SETTINGS, modes="raw"))
    assert face.size == 13 * dimensions
    assert face.names[:2] == ("lips_outer_x01", "lips_outer_y01")
    assert face.groups["lips_inner_y"] == tuple(6 * dimensions + dimensions * i + 1 for i in range(4))
    code, shapes = encode_points(face, clip_of(recorded(dimensions, 0)))
    back = face.points(code.parameters) + code.shape_offset
    assert back == pytest.approx(shapes, abs=1e-4)
    assert (face.deviations > 0).all()
    assert face.whole(code.parameters)[:, ROWS] + code.shape_offset == pytest.approx(shapes, abs=1e-4)


@BOTH
def test_landmarks_that_are_not_modelled_follow_the_parameters(dimensions: int) -> None:
    def nod(points: np.ndarray, frame: int) -> np.ndarray:
        points = points.copy()
        points[17:, 1] += 0.5 * movement(0)[frame, 0]
        return points

    face = fit_points([clip_of(recorded(dimensions, 0, nod))], GROUPS, SETTINGS)
    rest, up = face.whole(np.zeros(2)), face.whole(np.array([2.0, 0.0]))
    assert np.abs(up - rest)[17:].max() == pytest.approx(1.0, abs=0.02)
    assert np.abs(up - rest)[:4].max() < 1e-6
    assert rest[ROWS] == pytest.approx(face.mean)


def test_ghosts_are_left_out_of_the_fit_and_of_codes() -> None:
    spoilt = recorded(2, 0)
    spoilt[50:53, 4:17, 1] += 60
    spoilt[80, :4] = spoilt[80, :4] * [1, 3]
    face = fit_points([clip_of(spoilt), *clips(2)[1:]], GROUPS, SETTINGS)
    clean = fit_points(clips(2), GROUPS, SETTINGS)
    assert face.mean == pytest.approx(clean.mean, abs=0.5)
    code, _ = encode_points(face, clip_of(spoilt))
    assert np.flatnonzero(~code.valid).tolist() == [50, 51, 52]  # 80 is bridged
    assert code.outliers == {"stable points": [80], "shape": [50, 51, 52]}
    assert code.parameters[50:53] == pytest.approx(encode_points(face, clip_of(recorded(2, 0)))[0].parameters[50:53],
                                                   abs=1.5)


@BOTH
def test_face_and_code_are_saved_and_loaded(dimensions: int, tmp_path: Path) -> None:
    face = fit_points(clips(dimensions, posed=True), GROUPS, SETTINGS)
    again = load_face(face.save(tmp_path / "face.npz"))
    assert isinstance(again, PointsFace)
    clip = clip_of(recorded(dimensions, 0, turned(dimensions, 7)))
    code = encode_points(face, clip)[0]
    np.testing.assert_array_equal(encode_points(again, clip)[0].parameters, code.parameters)
    assert again.settings == face.settings and again.names == face.names
    kept = PointsCode.load(code.save(tmp_path / "code.npz"))
    np.testing.assert_array_equal(kept.parameters, code.parameters)
    assert face.place(kept)[:, face.layout.outer] == pytest.approx(clip.landmarks()[0][:, 4:10], abs=1e-3)
    assert face.stabilise(clip.landmarks()[0], kept) == pytest.approx(face.points(kept.parameters), abs=1e-3)


def test_what_cannot_be_used_is_said() -> None:
    face = fit_points(clips(2), GROUPS, SETTINGS)
    with pytest.raises(UnusableClipError):
        encode_points(face, clip_of(recorded(2, 0), valid=np.zeros(200, bool)))
    with pytest.raises(DnnvssError, match="landmarks have shape"):
        encode_points(face, clip_of(recorded(3, 0)))
    with pytest.raises(DnnvssError, match="do not move"):
        fit_points([clip_of(np.tile(shape(2), (50, 1, 1)))], GROUPS, SETTINGS)
    line = np.tile(shape(3), (50, 1, 1))
    line[:, :4] = np.linspace(0, 1, 4)[:, None] * [60, 1, 2]
    with pytest.raises(DnnvssError, match="4 stable points lie on a line"):
        fit_points([clip_of(line)], GROUPS, SETTINGS)
    with pytest.raises(DnnvssError, match="utterance b: has landmarks"):
        fit_points([clip_of(recorded(2, 0), "a"), clip_of(recorded(3, 0), "b")], GROUPS, SETTINGS)


@pytest.mark.parametrize(("value", "said"), [
    ({"modes": "abc"}, "face.modes=abc"), ({"modes": 0}, "face.modes=0"), ({"mode": 3}, "Did you mean face.modes"),
    ({"outlier": "x"}, "face.outlier=x"), ({"pose_smoothing": -1}, "face.pose_smoothing=-1")])
def test_settings_are_checked(value: dict, said: str) -> None:
    with pytest.raises(DnnvssError, match=said):
        face_kind("points").read(value)


def test_settings_round_trip() -> None:
    settings = replace(SETTINGS, modes="raw")
    assert PointsSettings.from_dict(settings.to_dict()) == settings
