"""A head from elsewhere: how it stands and where its points are is found, and a take makes it speak."""

from pathlib import Path

import numpy as np
import pytest
from face.mesh_cases import foreign_head, write_obj

from dnnvss.errors import DnnvssError
from dnnvss.face.mesh import Head, Mesh, packaged_head
from dnnvss.face.mesh.guess import best_turn, faults, guess_points, turned, turns, upright
from dnnvss.face.mesh.net import packaged_net
from dnnvss.face.mesh.other import open_head

HEAD, NET = packaged_head(), packaged_net()
REST = NET.at(HEAD.mesh.vertices)
LIPS = np.array([name.startswith("lips") for name in NET.names])
UPRIGHT = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]], float)


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> tuple[Head, str, np.ndarray]:
    """The head from elsewhere as a file is opened, and its true control points, both upright."""
    mesh, there = foreign_head(seed=5)
    path = write_obj(tmp_path_factory.mktemp("other") / "other.obj", Head(mesh))
    head, said = open_head(path)
    return head, said, there(REST) @ UPRIGHT.T


def test_turns_are_the_rotations_that_take_axes_to_axes() -> None:
    assert len(turns()) == 24 and len(np.unique(turns(), axis=0)) == 24
    np.testing.assert_array_equal(turns()[0], np.eye(3))
    for turn in turns():
        assert np.linalg.det(turn) == pytest.approx(1)
        np.testing.assert_array_equal(upright(3 * REST @ turn.T + 2) @ turn, np.eye(3))


def test_points_are_found_without_the_names_of_parts() -> None:
    mesh, there = foreign_head(seed=1, parts=False)
    away = np.sqrt(((guess_points(mesh) - there(REST)) ** 2).sum(axis=1))
    assert away[LIPS].mean() < 0.1 and away.mean() < 0.5  # centimetres


def test_a_head_from_elsewhere_is_turned_upright_and_keeps_its_size(
    opened: tuple[Head, str, np.ndarray],
) -> None:
    head, said, true = opened
    assert "turned upright" in said and len(head.names) == 52
    low, high = head.mesh.vertices.min(axis=0), head.mesh.vertices.max(axis=0)
    assert np.all((low < true.min(axis=0) + 2) & (true.max(axis=0) - 2 < high))
    assert 15 < high[1] - low[1] < 30


def lips(head: Head, true: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The vertices of a mesh nearest to the middles of the inner lips, a few of the upper and of the lower."""
    names = list(NET.names)
    ring = [names.index(f"lips_inner{k:02d}") for k in range(1, 40, 2) if f"lips_inner{k:02d}" in names]
    facing, own = head.mesh.normals(), HEAD.mesh.normals()[NET.vertices]
    quarter = len(ring) // 4
    found = []
    for middle in (quarter, len(ring) - quarter):
        some = [ring[middle + k] for k in (-1, 0, 1)]
        away = np.sqrt(((head.mesh.vertices[:, None] - true[some]) ** 2).sum(axis=2))
        found.append((away + 10 * (facing @ own[some].T < 0.5)).argmin(axis=0))
    return found[0], found[1]


def test_its_lips_part_on_open_vowels_and_touch_on_p_b_and_m(
    opened: tuple[Head, str, np.ndarray],
) -> None:
    head, _, true = opened
    jaw = np.array([0.0, 0.5, 0.35, 0.5, 0.3, 0.6, 0.0])  # rest, AA, B, AA, M, AE, rest
    shut = np.array([0.0, 0.0, 0.35, 0.0, 0.3, 0.0, 0.0])
    moved = head.vertices(head.weights({"JawOpen": jaw, "MouthClose": shut}))
    upper, lower = lips(head, true)
    gap = (moved[:, upper, 1] - moved[:, lower, 1]).mean(axis=1)
    gap = 10 * (gap - gap[0])
    assert gap[[1, 3, 5]].min() > 8, "millimetres"
    assert np.abs(gap[[2, 4, 6]]).max() < 1.5
    stays = np.abs(moved[1, upper] - moved[0, upper]).max()
    assert stays < 0.3, "the upper lip stays when the jaw goes down"


def test_what_is_no_face_is_refused() -> None:
    u, w = np.meshgrid(np.linspace(0, np.pi, 30), np.linspace(0, 2 * np.pi, 60), indexing="ij")
    egg = np.stack([0.75 * np.sin(u) * np.cos(w), 1.1 * np.cos(u), np.sin(u) * np.sin(w)], axis=2)
    k = np.arange(30 * 60).reshape(30, 60)
    faces = np.stack([k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]], axis=2).reshape(-1, 4)
    with pytest.raises(DnnvssError, match="fits this mesh at") as told:
        guess_points(Mesh(egg.reshape(-1, 3), faces))
    assert "--points" in str(told.value)


def test_faults_are_named() -> None:
    assert faults(REST) == [] and faults(20 * REST @ turns()[9].T) == []
    names = np.array([name.rstrip("0123456789") for name in NET.names])
    swapped = REST.copy()
    swapped[names == "lips_outer"] *= [1, -1, 1]
    assert "the lips" in faults(swapped)
    flat = REST.copy()
    flat[names == "nose_bridge", 2] -= 0.2
    assert "the nose" in faults(flat)
    torn = REST + np.random.default_rng(0).normal(0, 0.03, REST.shape)
    assert "the face" in faults(torn)


def test_a_mesh_that_stands_upright_is_not_turned(tmp_path: Path) -> None:
    assert turned(HEAD.mesh, np.eye(3)) is HEAD.mesh
    head, said = open_head(write_obj(tmp_path / "same.obj", HEAD))
    assert "turned" not in said
    np.testing.assert_allclose(head.mesh.vertices, HEAD.mesh.vertices, atol=1e-6)


@pytest.mark.parametrize("turn", [np.eye(3), UPRIGHT.T])
def test_a_mask_without_the_back_of_the_head_is_found(turn: np.ndarray) -> None:
    v = HEAD.mesh.vertices
    inside = (v[:, 2] > 0.02) & (np.abs(v[:, 1] + 0.01) < 0.09) & (np.abs(v[:, 0]) < 0.075)
    skin = [k for k, part in enumerate(HEAD.mesh.parts) if part in ("skin", "lips", "brow")]
    faces = HEAD.mesh.faces[inside[HEAD.mesh.faces].all(axis=1) & np.isin(HEAD.mesh.part_of, skin)]
    used, corners = np.unique(faces, return_inverse=True)
    places = (100 * v * [1.05, 1, 0.95] + 0.3 * np.sin(40 * v[:, [1, 2, 0]])) @ turn.T
    mask = Mesh(places[used], corners.reshape(-1, 4))
    away = np.sqrt(((guess_points(mask) - NET.at(places)) ** 2).sum(axis=1))
    assert away[LIPS].mean() < 0.15 and away[LIPS].max() < 0.4  # centimetres


def test_a_mesh_without_a_head_is_left_as_it_stands() -> None:
    egg = HEAD.mesh.vertices / np.linalg.norm(HEAD.mesh.vertices, axis=1, keepdims=True) * [0.7, 1, 0.9]
    turn, found = best_turn(Mesh(egg, HEAD.mesh.faces))
    assert not found.fits
    np.testing.assert_array_equal(turn, np.eye(3))


def test_a_head_inside_out_is_turned_and_others_are_not(tmp_path: Path) -> None:
    a, b, c, d = HEAD.mesh.faces.T
    inside = np.where((c == d)[:, None], np.stack([c, b, a, a], 1), np.stack([d, c, b, a], 1))
    head, _ = open_head(write_obj(tmp_path / "inside.obj", Head(Mesh(HEAD.mesh.vertices, inside))))
    np.testing.assert_allclose(head.mesh.normals(), HEAD.mesh.normals(), atol=1e-6)
    assert HEAD.mesh.outward is HEAD.mesh
