"""The packaged head: its shapes, its curves, and what is drawn of it."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from dnnvss.errors import DnnvssError
from dnnvss.face.mesh import Mesh, packaged_head
from dnnvss.render.solid import Solid, whole_head

HEAD = packaged_head()
SIDES = {"Left": "Right", "Right": "Left"}


def at(**weights: float) -> np.ndarray:
    """Vertices for some weights."""
    return HEAD.vertices(
        HEAD.weights({name: np.array([value]) for name, value in weights.items()})
    )[0]


def gap(vertices: np.ndarray) -> float:
    """Millimetres between the middles of the inner lips."""
    ring = HEAD.curves["lips_inner"]
    quarter = len(ring) // 4
    upper, lower = ring[quarter], ring[len(ring) - quarter]
    return 1000 * float(vertices[upper, 1] - vertices[lower, 1])


def test_the_head_has_the_shapes_of_arkit_and_stands_still_without_weights():
    assert len(HEAD.names) == 52 and len(set(HEAD.names)) == 52
    assert {"jawOpen", "mouthPucker", "eyeBlinkLeft", "tongueOut", "mouthClose"} <= set(HEAD.names)
    np.testing.assert_array_equal(HEAD.vertices(np.zeros(52)), HEAD.mesh.vertices)


def test_shapes_add_up():
    both = at(jawOpen=0.4, mouthPucker=0.5)
    alone = at(jawOpen=0.4) + at(mouthPucker=0.5) - HEAD.mesh.vertices
    np.testing.assert_allclose(both, alone, atol=1e-7)


def test_the_jaw_opens_the_lips_and_mouth_close_shuts_them_over_an_open_jaw():
    assert abs(gap(HEAD.mesh.vertices)) < 2
    assert gap(at(jawOpen=1.0)) > 25
    assert gap(at(jawOpen=1.0, mouthClose=1.0)) < 0.2 * gap(at(jawOpen=1.0))


def test_shapes_of_the_left_mirror_those_of_the_right():
    vertices = HEAD.mesh.vertices
    away, other = cKDTree(vertices).query(vertices * [-1, 1, 1])
    paired = away < 1e-4
    assert paired.mean() > 0.95
    for name in HEAD.names:
        for side, opposite in SIDES.items():
            if name.endswith(side):
                ours = HEAD.shapes[HEAD.names.index(name)]
                theirs = HEAD.shapes[HEAD.names.index(name.removesuffix(side) + opposite)][other]
                assert np.abs(ours[paired] - theirs[paired] * [-1, 1, 1]).max() < 0.002, name


def test_rings_run_from_the_talkers_right_over_the_upper_side():
    for name in ("lips_outer", "lips_inner", "right_eye", "left_eye"):
        ring = HEAD.mesh.vertices[HEAD.curves[name]]
        assert ring[:, 0].argmin() == 0
        assert ring[len(ring) // 4, 1] >= ring[-(len(ring) // 4), 1]


def test_parts_lie_where_they_belong():
    v = HEAD.mesh.vertices
    assert (
        v[HEAD.mesh.of_part("lower_teeth"), 1].mean()
        < v[HEAD.mesh.of_part("upper_teeth"), 1].mean()
    )
    for part in ("iris", "pupil"):
        assert len(HEAD.mesh.of_part(part)) and (v[HEAD.mesh.of_part(part), 2] > 0.08).all()


def test_curves_of_other_names_are_told():
    with pytest.raises(DnnvssError, match="none of the curves smile"):
        HEAD.weights({"smile": np.zeros(3)})
    with pytest.raises(DnnvssError, match="no shape 'smile'"):
        HEAD.position("smile")


def test_normals_of_a_cube_point_outward():
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    faces = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    cube = Mesh(corners, faces)
    np.testing.assert_allclose(cube.normals(), corners / np.sqrt(3), atol=1e-12)
    assert len(cube.triangles) == 12 and len(cube.edges) == 12


@pytest.mark.parametrize("wrong", ["corner", "nowhere", "huge", "none"])
def test_a_mesh_that_is_none_is_refused(wrong):
    vertices, faces = np.eye(3), np.array([[0, 1, 2, 2]])
    if wrong == "corner":
        faces = np.array([[0, 1, 3, 3]])
    if wrong == "nowhere":
        vertices[0, 0] = np.nan
    if wrong == "huge":
        vertices = np.zeros((500_001, 3))
    if wrong == "none":
        faces = faces[:0]
    with pytest.raises(DnnvssError):
        Mesh(vertices, faces)


def test_the_picture_shows_lips_eyes_and_teeth_where_they_are():
    camera = whole_head(HEAD.mesh, 240)
    solid = Solid(HEAD.mesh, camera)
    still, opened = solid.picture(HEAD.mesh.vertices), solid.picture(at(jawOpen=0.8))
    assert still.shape == (240, camera.size[0], 3)
    x, y = camera.seen(HEAD.mesh.vertices[HEAD.mesh.of_part("pupil")])[0, :2].astype(int)
    assert still[y, x].max() < 120
    mouth = (
        camera.seen(HEAD.mesh.vertices[HEAD.curves["lips_inner"]])[:, :2].mean(axis=0).astype(int)
    )
    changed = np.abs(still.astype(int) - opened)[mouth[1] + 2 : mouth[1] + 12, mouth[0]]
    assert changed.max() > 60
    ground = (still == still[0, 0]).all(axis=2)
    assert (ground != ground[:, ::-1]).mean() < 0.02
