"""Points of a head on a mesh: what is set under a pixel, what follows, and the page in a real browser."""

import json
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, open_browser
from conftest import run_command
from face.mesh_cases import write_obj

from dnnvss.errors import DnnvssError
from dnnvss.face.mesh import packaged_head
from dnnvss.face.mesh.net import packaged_net
from dnnvss.face.mesh.other import read_points
from dnnvss.face.mesh.pointing import HeadPoints, listed
from dnnvss.render.head_points import VIEWS, View
from dnnvss.studio.heads import HeadDesk
from dnnvss.studio.page import Asked
from dnnvss.studio.server import Server

HEAD, NET = packaged_head(), packaged_net()
REST = dict(zip(NET.names, NET.at(HEAD.mesh.vertices), strict=True))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Points as if guessed on the packaged head itself."""
    path = write_obj(tmp_path / "mine.obj", HEAD)
    HeadPoints(tmp_path / "points", path, True, (), {n: REST[n] for n in listed()}).save()
    return tmp_path / "points"


def sent(name: str, view: str, x: float, y: float) -> Asked:
    return Asked(body={"name": name, "view": view, "x": x, "y": y})


def test_the_place_under_a_pixel_is_that_which_is_seen_there() -> None:
    for name in VIEWS:
        view = View.of(HEAD.mesh, name, 600)
        tip = HEAD.mesh.vertices[HEAD.curves["nose_bridge"][-1]]
        at, faces = view.seen(tip[None])
        found = view.place(*at[0])
        assert faces[0] and found is not None
        np.testing.assert_allclose(view.camera.seen(found[None])[0, :2], at[0], atol=1e-6)
        assert np.abs(found - tip).max() < 0.004
        assert view.place(2, 2) is None
    back = View.of(HEAD.mesh, "front", 600).seen(HEAD.mesh.vertices[HEAD.mesh.vertices[:, 2].argmin()][None])
    assert not back[1][0]


def test_a_guessed_point_carries_those_near_it_that_nobody_set(folder: Path) -> None:
    points = HeadPoints.open(folder)
    step = np.array([0.004, 0.0, 0.0])
    first = points.moved("lips_outer03", points.points["lips_outer03"] + step)
    near, far = ((first.points[n] - points.points[n])[0] for n in ("lips_outer05", "left_eye01"))
    assert 0.001 < near < 0.004 and abs(far) < 1e-6
    second = first.moved("lips_outer05", first.points["lips_outer05"] + step)
    np.testing.assert_array_equal(second.points["lips_outer03"], first.points["lips_outer03"])
    assert second.placed == ("lips_outer03", "lips_outer05")


def test_without_a_guess_six_points_tell_the_others(folder: Path) -> None:
    points = HeadPoints(folder, HeadPoints.open(folder).path)
    chosen = ("lips_outer01", "lips_outer19", "nose_bridge07", "face_oval01", "face_oval19", "left_eye01")
    for k, name in enumerate(chosen):
        assert len(points.points) == k
        points = points.moved(name, 3 * REST[name] + 1)
    assert set(points.points) == set(listed())
    for name, place in points.points.items():
        np.testing.assert_allclose(place, 3 * REST[name] + 1, atol=1e-6)
    with pytest.raises(DnnvssError, match="named 'ear'"):
        points.moved("ear", np.zeros(3))


def test_what_the_page_sets_is_on_disk_at_once_and_taken_back(folder: Path) -> None:
    desk = HeadDesk(folder)
    before = (folder / "points.json").read_bytes()
    seen = desk.overview()["seen"]["front"]["lips_outer01"]
    state = desk.move(sent("lips_outer01", "front", seen[0] - 6, seen[1]))
    assert state["placed"] == ("lips_outer01",) and state["undo"] and not state["faults"]
    now = read_points(folder / "points.json", HEAD.mesh)["lips_outer01"]
    assert 0.0005 < REST["lips_outer01"][0] - now[0] < 0.003
    for wrong in ({"name": "lips_outer01", "view": "back", "x": 1, "y": 1}, [], {"name": 3},
                  {"name": "lips_outer01", "view": "front", "x": "1", "y": None}):
        with pytest.raises(DnnvssError):
            desk.move(Asked(body=wrong))
    with pytest.raises(DnnvssError, match="nothing of the mesh"):
        desk.move(sent("lips_outer01", "front", 1, 1))
    assert desk.undo()["placed"] == () and not desk.undo()["undo"]
    assert (folder / "points.json").read_bytes() == before
    assert HeadDesk(folder).overview()["next"].startswith("dnnvss rig TAKE.csv --out take.mp4 --head ")


def test_the_command_guesses_draws_and_keeps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mesh, out = write_obj(tmp_path / "mine.obj", HEAD), tmp_path / "heads" / "mine"
    assert run_command("points", str(mesh), "--out", str(out)) == 0
    assert "158 points guessed" in capsys.readouterr().out
    found = read_points(out / "points.json", HEAD.mesh)
    assert max(np.abs(found[n] - REST[n]).max() for n in found if n.startswith("lips")) < 0.001
    assert (out / "points.png").stat().st_size > 20_000
    assert run_command("points", "--out", str(out)) == 0
    assert "158 points in" in capsys.readouterr().out
    assert run_command("points", str(tmp_path / "other.obj"), "--out", str(out)) == 1
    assert "holds the points of" in capsys.readouterr().err
    (out / "head.json").write_text(json.dumps({"mesh": str(mesh), "placed": ["ear"]}))
    assert run_command("points", "--out", str(out)) == 1
    assert "named 'ear'" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(not CHROMIUM, reason="needs the program chromium to open the page")
def test_the_page_in_a_browser(folder: Path, tmp_path: Path) -> None:
    with Server(HeadDesk(folder).page()) as server, open_browser(tmp_path / "profile") as browser:
        browser.call("Page.navigate", url=server.url)
        browser.wait("typeof order !== 'undefined' && order.includes(chosen)")
        browser.key("l")
        dot = "document.querySelector('figure circle[data-point=lips_outer01]').getBoundingClientRect()"
        x, y = browser.ask(f"(() => {{ const c = {dot}; return [c.x + c.width / 2, c.y + c.height / 2]; }})()")
        browser.drag((x, y), (x - 12, y + 4))
        browser.wait("document.getElementById('said').textContent === 'lips outer 1 is set'")
        assert browser.ask("state.placed.length") == 1
        assert HeadPoints.open(folder).placed == ("lips_outer01",)
        browser.key(".")
        browser.wait("chosen === 'lips_outer03'")
        browser.drag((x, y), (x, y))  # a click on the point there chooses it again
        browser.key("z")
        browser.wait("state.placed.length === 0")
        assert HeadPoints.open(folder).placed == ()
