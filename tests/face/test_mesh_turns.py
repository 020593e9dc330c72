"""Heads that turn and eyes that look: by hand, and as the app's own take says them twice."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dnnvss.face.mesh import Mesh, packaged_head
from dnnvss.face.mesh.eyes import eye_shapes
from dnnvss.face.mesh.gltf_read import read_gltf
from dnnvss.face.mesh.gltf_write import write_glb
from dnnvss.face.mesh.turns import Turns
from dnnvss.render.solid import whole_head

HEAD = packaged_head()
MESH = HEAD.mesh
NOSE = int(MESH.vertices[:, 2].argmax())


def nose(curves: dict[str, list[float]], frame: int = 0) -> np.ndarray:
    """How far the tip of the nose moves, in metres: to the talker's left, up, forward."""
    turns = Turns.of(MESH, {name: np.array(track) for name, track in curves.items()})
    assert turns is not None
    return turns.turned(MESH.vertices, frame)[NOSE] - MESH.vertices[NOSE]


def test_nothing_turns_where_no_angle_is_given_or_all_are_zero():
    assert Turns.of(MESH, {"JawOpen": np.ones(3)}) is None
    assert Turns.of(MESH, {"HeadYaw": np.zeros(3), "HeadPitch": np.zeros(3)}) is None


def test_yaw_goes_right_pitch_down_and_roll_to_the_left():
    assert nose({"HeadYaw": [0.3]})[0] < -0.02 and nose({"headpitch": [0.3]})[1] < -0.02
    turns = Turns.of(MESH, {"HeadRoll": np.array([0.3])})
    top = int(MESH.vertices[:, 1].argmax())
    assert turns.turned(MESH.vertices, 0)[top, 0] > MESH.vertices[top, 0] + 0.03
    np.testing.assert_allclose(nose({"HeadYaw": [10.0]}), nose({"HeadYaw": [np.deg2rad(10)]}), atol=1e-9)


def test_a_turn_keeps_all_distances_and_its_pivot():
    turns = Turns.of(MESH, {"HeadYaw": np.array([0, 0.5]), "HeadPitch": np.array([0, -0.2]),
                            "HeadRoll": np.array([0, 0.1])})
    np.testing.assert_allclose(turns.turned(MESH.vertices, 0), MESH.vertices, atol=1e-15)
    moved = turns.turned(MESH.vertices, 1)
    np.testing.assert_allclose(np.linalg.norm(moved - turns.pivot, axis=1),
                               np.linalg.norm(MESH.vertices - turns.pivot, axis=1))
    angles = Rotation.from_matrix(turns.rotations[1]).as_euler("YXZ")
    np.testing.assert_allclose(angles, [-0.5, -0.2, -0.1])


def test_eyes_that_roll_as_the_app_has_it_have_no_torsion():
    """The app's eyes pitch after they yaw: read as angles, they roll by the product of both (.97 of it in a take)."""
    eye = Rotation.from_euler("XYZ", [0.2, -0.3, 0])
    yaw, pitch, roll = eye.as_euler("YXZ") * [-1, 1, -1]
    assert roll == pytest.approx(yaw * pitch, rel=0.03)


def test_neighbouring_quaternions_do_not_jump():
    yaw = np.linspace(-8, 8, 400)  # more than half a turn: degrees
    made = Turns.of(MESH, {"HeadYaw": yaw * 40}).quaternions
    assert ((made[1:] * made[:-1]).sum(axis=1) > 0.99).all()


def test_the_picture_has_room_for_a_head_that_turns():
    tracks = {"HeadYaw": 0.6 * np.sin(np.arange(90) / 9), "HeadRoll": 0.4 * np.cos(np.arange(90) / 7)}
    turns = Turns.of(MESH, tracks)
    camera = whole_head(MESH, 240, turns=turns)
    for frame in range(90):
        seen = camera.seen(turns.turned(MESH.vertices, frame))[:, :2]
        assert seen.min() > 0 and (seen.max(axis=0) < camera.size).all()


def test_a_glb_turns_the_head_about_its_neck(tmp_path):
    turns = Turns.of(MESH, {"HeadYaw": np.array([0, 0.4, -0.4]), "HeadPitch": np.array([0.1, 0, 0])})
    weights = np.zeros((3, len(HEAD.names)))
    path = write_glb(tmp_path / "a.glb", HEAD, weights, np.arange(3) / 25, turns=turns)
    np.testing.assert_allclose(read_gltf(path).mesh.vertices, MESH.vertices, atol=1e-6)
    still = write_glb(tmp_path / "b.glb", HEAD, weights, np.arange(3) / 25)
    assert b'"neck"' in path.read_bytes() and b'"neck"' not in still.read_bytes()


def test_eyes_of_another_mesh_look_where_the_heads_look():
    scaled = Mesh(MESH.vertices * 100 + [3, 0, 0], MESH.faces, MESH.parts, MESH.part_of)
    shapes = eye_shapes(scaled, 3.0)
    assert len(shapes) == 8
    for name, (rows, moved) in shapes.items():
        iris = np.isin(rows, MESH.of_part("iris"))
        own = 100 * HEAD.shapes[HEAD.position(name)][rows]
        assert np.abs(moved - own)[iris].max() < 0.2, f"{name}: centimetres"
        assert np.abs(moved).max() > 0.25
    assert eye_shapes(Mesh(MESH.vertices, MESH.faces), 0.0) == {}
