"""The surface of Bezier triangles, what is bound to it, and the packaged head's shapes on other meshes."""

import time
from dataclasses import replace

import numpy as np
import pytest
from face.mesh_cases import write_obj

from dnnvss.errors import DnnvssError
from dnnvss.face.mesh import Mesh, packaged_head
from dnnvss.face.mesh.bezier import BezierSurface
from dnnvss.face.mesh.deformer import bind
from dnnvss.face.mesh.net import packaged_net
from dnnvss.face.mesh.other import open_head
from dnnvss.face.mesh.tongue import BACK, TIP, speaking_head, tongue_curves
from dnnvss.face.mesh.transfer import find_points, transfer_to, with_shapes
from dnnvss.timing import FrameClock, Tier

HEAD, NET = packaged_head(), packaged_net()
REST = NET.at(HEAD.mesh.vertices)
SURFACE = BezierSurface(NET.triangles, len(NET.names))
RING = HEAD.curves["lips_inner"]


def at(**weights: float) -> np.ndarray:
    """Vertices of the packaged head for some weights."""
    return HEAD.vertices(HEAD.weights({name: np.array([w]) for name, w in weights.items()}))[0]


def gap(vertices: np.ndarray) -> float:
    """Millimetres between the middles of the inner lips."""
    quarter = len(RING) // 4
    return 1000 * float(vertices[RING[quarter], 1] - vertices[RING[-quarter], 1])


def other(v: np.ndarray) -> np.ndarray:
    """Another head: wider, lower, 37 times as large, elsewhere, with other features."""
    wide = v * [1.12, 0.93, 1.05]
    return (wide + 0.002 * np.sin(wide[:, [1, 2, 0]] * 30)) * 37 + [3, 100, -5]


@pytest.fixture(scope="module")
def deformer():
    return bind(HEAD.mesh, SURFACE, REST)


@pytest.fixture(scope="module")
def mesh():
    return Mesh(other(HEAD.mesh.vertices), HEAD.mesh.faces, HEAD.mesh.parts, HEAD.mesh.part_of)


def test_the_surface_interpolates_its_points():
    points = REST + np.random.default_rng(0).normal(0, 0.002, REST.shape)
    for corner in range(3):
        found = SURFACE.points(
            points,
            np.arange(len(NET.triangles)),
            np.tile(np.eye(3)[corner], (len(NET.triangles), 1)),
        )
        np.testing.assert_allclose(found, points[NET.triangles[:, corner]], atol=1e-12)


def test_the_surface_and_its_normals_have_no_gaps_at_edges():
    points = REST + np.random.default_rng(1).normal(0, 0.002, REST.shape)
    along = np.linspace(0, 1, 7)
    seen: dict[frozenset[int], tuple[np.ndarray, np.ndarray, int]] = {}
    shared = 0
    for k, corners in enumerate(NET.triangles.tolist()):
        for side in range(3):
            a, b = corners[side], corners[(side + 1) % 3]
            where = np.zeros((7, 3))
            where[:, side], where[:, (side + 1) % 3] = 1 - along, along
            place = SURFACE.points(points, np.full(7, k), where)
            normal = SURFACE.weights(np.full(7, k), where)[2] @ SURFACE.controls(points)[1].reshape(
                -1, 3
            )
            edge = frozenset((a, b))
            if edge in seen:
                theirs, facing, first = seen[edge]
                turn = slice(None) if first == a else slice(None, None, -1)
                np.testing.assert_allclose(place[turn], theirs, atol=1e-6)
                np.testing.assert_allclose(normal[turn], facing, atol=1e-6)
                shared += 1
            seen[edge] = place, normal, a
        if shared > 120:
            break
    assert shared > 100


def test_flat_points_make_a_flat_surface():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    flat = BezierSurface(np.array([[0, 1, 2], [1, 3, 2]]), 4)
    where = np.random.default_rng(2).dirichlet(np.ones(3), 50)
    found = flat.points(points, np.zeros(50, int), where)
    np.testing.assert_allclose(found, where @ points[[0, 1, 2]], atol=1e-12)


def test_a_mesh_at_rest_is_itself_and_moves_as_a_whole_with_its_points(deformer):
    np.testing.assert_allclose(deformer.vertices(REST), HEAD.mesh.vertices, atol=1e-12)
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    moved = deformer.vertices(REST @ turn + 0.1)[deformer.bound]
    np.testing.assert_allclose(moved, (HEAD.mesh.vertices @ turn + 0.1)[deformer.bound], atol=1e-9)


@pytest.mark.parametrize(
    "weights", [{"jawOpen": 0.7}, {"mouthPucker": 0.9}, {"mouthSmileLeft": 0.8}]
)
def test_the_deformed_head_is_near_the_one_of_shapes(deformer, weights):
    goal = at(**weights)
    away = np.sqrt(((deformer.vertices(NET.at(goal)) - goal)[deformer.bound] ** 2).sum(axis=1))
    assert away.mean() < 0.0004 and np.percentile(away, 99) < 0.003


def test_lips_part_and_touch_in_the_mesh(deformer):
    assert gap(deformer.vertices(NET.at(at(jawOpen=0.5)))) > 0.9 * gap(at(jawOpen=0.5)) > 10
    assert abs(gap(deformer.vertices(NET.at(at(jawOpen=0.4, mouthClose=0.4))))) < 2.5
    opened = deformer.vertices(NET.at(at(jawOpen=0.5)))
    upper = HEAD.mesh.vertices[RING[9], 1] - opened[RING[9], 1]
    assert abs(upper) < 0.003, "the upper lip stays when the lower one goes"


def test_a_mesh_retargeted_to_itself_is_itself():
    self_ = transfer_to(HEAD.mesh, REST)
    np.testing.assert_allclose(self_.vertices(HEAD.mesh.vertices), HEAD.mesh.vertices, atol=1e-12)
    goal = at(jawOpen=0.6)
    made = self_.vertices(goal)
    teeth = HEAD.mesh.of_part("lower_teeth")
    assert np.abs(made - goal)[teeth].max() < 0.001, "the lower teeth follow the chin"
    upper = HEAD.mesh.of_part("upper_teeth")
    np.testing.assert_array_equal(made[upper], HEAD.mesh.vertices[upper])


def test_another_head_is_found_and_speaks(mesh):
    points = find_points(mesh)
    lips = [k for k, name in enumerate(NET.names) if name.startswith("lips")]
    away = np.sqrt(((points - other(REST))[lips] ** 2).sum(axis=1)) / 37
    assert away.mean() < 0.001
    made = with_shapes(mesh, transfer_to(mesh, points))
    opened = made.vertices(made.weights({"jawOpen": np.array([0.5])}))[0]
    wanted = gap(other(at(jawOpen=0.5))) - gap(mesh.vertices)
    assert 0.6 < (gap(opened) - gap(mesh.vertices)) / wanted < 1.4


def test_named_points_put_the_head_exactly_there(mesh):
    rows = {name: other(REST)[k] for k, name in enumerate(NET.names) if k % 5 == 0}
    points = find_points(mesh, rows)
    np.testing.assert_allclose(points[::5], other(REST)[::5], atol=1e-7)


def test_what_is_no_head_is_told(mesh, tmp_path):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    cube = Mesh(
        corners,
        np.array(
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        ),
    )
    with pytest.raises(DnnvssError) as told:
        find_points(cube)
    assert "--points" in str(told.value)
    with pytest.raises(DnnvssError, match="no point of the head is named 'ear'"):
        find_points(mesh, {"ear": np.zeros(3)})
    path = write_obj(tmp_path / "head.obj", replace(HEAD, mesh=mesh))
    (tmp_path / "p.json").write_text(
        '{"nose_bridge07": 999999, "a": 1, "b": 1, "c": 1, "d": 1, "e": 1}'
    )
    with pytest.raises(DnnvssError, match="no vertex of"):
        open_head(path, tmp_path / "p.json")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", "3 vertices, which make no head"),
        ("".join(f"v {k % 9} {k // 9} 0\n" for k in range(81)) + "f 1 2 11\n", "is flat: 8 x 8 x 0"),
    ],
)
def test_what_has_no_room_for_a_head_is_told(text, said, tmp_path):
    (tmp_path / "a.obj").write_text(text)
    with pytest.raises(DnnvssError, match=said):
        open_head(tmp_path / "a.obj")


@pytest.mark.parametrize("place", ["[1" + "0" * 400 + ", 0, 0]", "[1e300, 0, 0]", "[true, 0, 0]", "true"])
def test_places_of_points_that_are_none_are_told(place, mesh, tmp_path):
    path = write_obj(tmp_path / "head.obj", replace(HEAD, mesh=mesh))
    named = ", ".join(f'"lips_outer{k:02}": {place}' for k in range(1, 8))
    (tmp_path / "p.json").write_text("{" + named + "}")
    with pytest.raises(DnnvssError, match="no place"):
        open_head(path, tmp_path / "p.json")


def test_named_points_in_one_place_are_told(mesh, tmp_path):
    path = write_obj(tmp_path / "head.obj", replace(HEAD, mesh=mesh))
    named = ", ".join(f'"{name}": 5' for name in packaged_net().names[:8])
    (tmp_path / "p.json").write_text("{" + named + "}")
    with pytest.raises(DnnvssError, match=r"p\.json"):
        open_head(path, tmp_path / "p.json")


def test_a_head_with_holes_is_moved_all_the_same(mesh):
    keep = np.ones(len(mesh.faces), bool)
    keep[np.random.default_rng(4).choice(len(keep), 400, replace=False)] = False
    torn = Mesh(mesh.vertices, mesh.faces[keep], mesh.parts, mesh.part_of[keep])
    made = transfer_to(torn, other(REST)).vertices(at(jawOpen=0.5))
    assert np.isfinite(made).all() and np.abs(made - mesh.vertices).max() < 37 * 0.06


def test_deforming_is_fast_enough_for_two_hundred_frames_a_second(deformer):
    moved = [NET.at(at(jawOpen=w)) for w in np.linspace(0, 0.5, 30)]
    deformer.vertices(moved[0])
    start = time.process_time()
    for points in moved:
        deformer.vertices(points)
    assert (time.process_time() - start) / len(moved) < 1 / 100  # 2 ms where nothing else runs


def test_the_tongue_rises_where_phones_want_it():
    tier = Tier("phones", [(0, 0.2, "T"), (0.2, 0.4, "AA"), (0.4, 0.6, "K")])
    curves = tongue_curves(tier, FrameClock(100), 60)
    assert curves[TIP][10] == 1 and curves[TIP][30] == 0 and curves[BACK][50] == 1
    head = speaking_head()
    tongue = head.mesh.of_part("tongue")
    raised = (
        head.vertices(head.weights({TIP: np.array([1.0])}))[0][tongue, 1]
        - head.mesh.vertices[tongue, 1]
    )
    assert 0.01 < raised.max() < 0.02 and raised.min() == 0
