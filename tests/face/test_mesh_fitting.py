"""A face's points on the head: where they lie, how they are warped, and the weights that reach them."""

import numpy as np
import pytest
from face.mesh_cases import swing
from scipy.optimize import lsq_linear

from dnnvss.errors import DnnvssError
from dnnvss.face.mesh import packaged_head
from dnnvss.face.mesh.fitting import OnHead
from dnnvss.face.mesh.places import at_vertices, match_contours
from dnnvss.face.mesh.volume import KERNELS, fit_warp
from dnnvss.face.mesh.weights import FitSettings, fit_weights, what_is_told

HEAD = packaged_head()
CURVES = ("lips_outer", "lips_inner", "face_oval", "nose_base")


def captured(weights, axes=3, scale=3.0, turn=1.0):
    """Points of the head's own curves as a face has them: another size and place, y down; and its contours."""
    rows, contours = [], {}
    for name in CURVES:
        contours[name] = range(len(rows), len(rows) + len(HEAD.curves[name]))
        rows += list(HEAD.curves[name])
    return (HEAD.vertices(weights)[:, rows] * [scale, -scale * turn, scale] + 40)[
        ..., :axes
    ], contours


@pytest.mark.parametrize("axes", [2, 3])
def test_points_of_the_heads_own_curves_find_themselves(axes):
    (neutral,), contours = captured(np.zeros((1, 52)), axes)
    places, rows = match_contours(HEAD, contours, neutral * [1, -1, 1][:axes])
    mine = np.concatenate([HEAD.curves[name] for name in CURVES])[rows]
    away = np.abs(places.at(HEAD.mesh.vertices) - HEAD.mesh.vertices[mine])[:, :2]
    assert np.median(away) < 5e-4 and away.max() < 8e-3


def test_markers_on_the_lips_alone_open_the_mouth():
    weights = swing(40, "jawOpen")
    points, contours = captured(weights)
    (neutral,), _ = captured(np.zeros((1, 52)))
    markers = {"lips": list(contours["lips_outer"])[::3], "jaw": list(contours["face_oval"])[::2], "brow": [0, 1]}
    fitted = OnHead.of(HEAD, markers, neutral).fit(points)
    ring = HEAD.curves["lips_inner"]
    gaps = [v[:, ring[9], 1] - v[:, ring[-9], 1] for v in (HEAD.vertices(weights), HEAD.vertices(fitted.weights))]
    assert np.corrcoef(*gaps)[0, 1] > 0.99


def test_a_markup_of_other_names_is_told():
    with pytest.raises(DnnvssError, match="runs round the lips"):
        match_contours(HEAD, {"left_ear": [0, 1, 2]}, np.zeros((3, 2)))


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_warp_takes_its_centres_to_their_goals(kernel):
    draw = np.random.default_rng(0)
    source, target = draw.normal(size=(60, 3)) * 1000 + 5000, draw.normal(size=(60, 3))
    warp = fit_warp(source, target, kernel)
    np.testing.assert_allclose(warp(source), target, atol=1e-9)


def test_a_warp_of_points_onto_themselves_moves_nothing():
    source = np.random.default_rng(1).normal(size=(40, 3))
    elsewhere = np.random.default_rng(2).normal(size=(500, 3)) * 3
    np.testing.assert_allclose(fit_warp(source, source)(elsewhere), elsewhere, atol=1e-9)


def test_a_warp_of_a_similarity_is_that_similarity_everywhere():
    draw = np.random.default_rng(3)
    source, elsewhere = draw.normal(size=(40, 3)), draw.normal(size=(100, 3)) * 3
    turn, _ = np.linalg.qr(draw.normal(size=(3, 3)))
    np.testing.assert_allclose(
        fit_warp(source, 2 * source @ turn + 1)(elsewhere), 2 * elsewhere @ turn + 1, atol=1e-9
    )


def test_centres_that_fall_together_and_points_in_a_plane():
    source = np.random.default_rng(4).normal(size=(20, 3))
    doubled = np.concatenate([source, source[:3]])
    np.testing.assert_allclose(fit_warp(doubled, doubled)(source), source, atol=1e-9)
    with pytest.raises(DnnvssError, match="a line or a plane"):
        fit_warp(source * [1, 1, 0], source)
    with pytest.raises(DnnvssError, match="cannot be taken"):
        fit_warp(source, source[:5])


def test_weights_are_those_of_bounded_least_squares():
    draw = np.random.default_rng(0)
    basis = draw.normal(size=(12, 60))
    wanted = np.clip(draw.normal(0.2, 0.5, size=(5, 12)), 0, 1) @ basis + 0.3 * draw.normal(
        size=(5, 60)
    )
    found = fit_weights(basis, wanted, settings=FitSettings(ridge=1e-3, smooth=0))
    cost = np.sqrt(1e-3 * np.trace(basis @ basis.T) / 12)
    for ours, goal in zip(found, wanted, strict=True):
        own = lsq_linear(
            np.vstack([basis.T, cost * np.eye(12)]), np.r_[goal, np.zeros(12)], (0, 1), tol=1e-12
        )
        np.testing.assert_allclose(ours, own.x, atol=1e-4)


def test_smoothness_over_time_is_that_of_the_whole_problem():
    draw = np.random.default_rng(1)
    basis, frames = draw.normal(size=(3, 8)), 6
    wanted = draw.normal(size=(frames, 8))
    settings = FitSettings(ridge=0.1, smooth=0.5, level=0.2)
    unit = np.trace(basis @ basis.T) / 3
    rows = [
        np.kron(np.eye(frames), basis.T),
        np.sqrt(0.1 * unit) * np.eye(3 * frames),
        np.sqrt(0.5 * unit) * np.kron(np.diff(np.eye(frames), axis=0), np.eye(3)),
        np.sqrt(0.2 * unit) * np.kron(np.eye(frames), [[1, -1, 0]]),
    ]
    goal = np.zeros(sum(map(len, rows)))
    goal[: wanted.size] = wanted.ravel()
    own = lsq_linear(np.vstack(rows), goal, (0, 1), tol=1e-13).x.reshape(frames, 3)
    found = fit_weights(basis, wanted, ["smileLeft", "smileRight", "jawOpen"], settings)
    np.testing.assert_allclose(found, own, atol=1e-4)


def test_shapes_that_move_the_points_alike_are_ambiguous():
    draw = np.random.default_rng(2)
    basis = draw.normal(size=(4, 30))
    basis[3] = basis[2] * 1.01
    basis[1] = 1e-4 * basis[1]
    told = what_is_told(basis)
    assert told.clear.tolist() == [True, False, False, False]
    assert told.seen.tolist() == [True, False, True, True]


def test_a_head_moved_by_known_weights_comes_back():
    moved = (
        "jawOpen",
        "mouthPucker",
        "mouthSmileLeft",
        "mouthSmileRight",
        "mouthUpperUpLeft",
        "jawLeft",
    )
    weights = swing(60, *moved)
    points, _ = captured(weights)
    (neutral,), _ = captured(np.zeros((1, 52)))
    mine = np.concatenate([HEAD.curves[name] for name in CURVES])
    names = [f"{name}{k + 1:02d}" for name in CURVES for k in range(len(HEAD.curves[name]))]
    on = OnHead(
        HEAD, at_vertices(names, mine), np.arange(len(mine)), neutral, FitSettings(1e-5, 1e-6, 0.0)
    )
    fitted = on.fit(points)
    clear = on.told.clear
    assert clear.sum() >= 20 and clear[HEAD.position("jawOpen")]
    assert np.abs(fitted.weights - weights)[:, clear].max() < 0.05
    assert fitted.errors.max() < 0.01
    assert set(fitted.ambiguous) | set(fitted.unseen) == {
        n for n, c in zip(HEAD.names, clear, strict=True) if not c
    }
    assert not np.any(fitted.weights[:, [HEAD.position(name) for name in fitted.unseen]])


@pytest.mark.parametrize("axes", [2, 3])
def test_other_sizes_and_faces_open_the_same_mouth(axes):
    weights = swing(40, "jawOpen")
    points, contours = captured(weights, axes, 7.0, turn=1.1)
    (neutral,), _ = captured(np.zeros((1, 52)), axes, 7.0, turn=1.1)
    fitted = OnHead.of(HEAD, contours, neutral).fit(points)
    ring = HEAD.curves["lips_inner"]
    gaps = [
        v[:, ring[9], 1] - v[:, ring[-9], 1]
        for v in (HEAD.vertices(weights), HEAD.vertices(fitted.weights))
    ]
    assert np.corrcoef(*gaps)[0, 1] > 0.99 and abs(gaps[1].max() / gaps[0].max() - 1) < 0.15
    assert "of the mouth's width RMS" in fitted.lines()[0]
