"""The areas of the studio: what is found, how it is named, and that nothing else is served."""

import json
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from tensorboard.compat.proto.event_pb2 import Event
from tensorboard.summary.writer.record_writer import RecordWriter

from dnnvss.errors import DnnvssError
from dnnvss.pages import document, only
from dnnvss.staging import locked
from dnnvss.studio.areas import with_areas
from dnnvss.studio.areas.curves import POINTS, EventFile, FitCurves
from dnnvss.studio.areas.documents import document as served_document
from dnnvss.studio.areas.places import found
from dnnvss.studio.areas.training import RUNNING, STOPPED, state_of
from dnnvss.studio.page import Content, Page, Route
from dnnvss.studio.server import Server


def touch(path: Path, text: str = "") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def test_marks_are_found_two_folders_deep_and_links_are_not_followed(tmp_path: Path) -> None:
    root = tmp_path / "root"
    for name in ("a", "b/c", "d/e/f", ".hidden", "a/within"):
        touch(root / name / "mark.json")
    touch(tmp_path / "outside" / "mark.json")
    (root / "link").symlink_to(tmp_path / "outside")
    touch(root / "linked" / "other")
    (root / "linked" / "mark.json").symlink_to(tmp_path / "outside" / "mark.json")
    names = [thing.name for thing in found([root, root], ["mark.json"])]
    assert names == ["a", "c"]
    assert [thing.name for thing in found([root], ["mark.json"], deep=1)] == ["a"]
    assert found([tmp_path / "none"], ["mark.json"]) == []


def test_names_tell_things_apart_and_are_never_paths(tmp_path: Path) -> None:
    for name in ("x/same", "y/same", "z/it's <b>", "z/plain one"):
        touch(tmp_path / name / "m")
    names = [thing.name for thing in found([tmp_path], ["m"])]
    assert len(set(names)) == 4 and "plain one" in names and "same" not in names
    assert not any(set(name) & set("<>/'") for name in names)


@pytest.mark.parametrize("name", ["../secret.txt", "videos/../../secret.txt", "secret.txt", "videos/a.txt",
                                  "linked.html", "videos/deep/a.mp4", "videos", "/etc/passwd", ""])
def test_only_the_files_of_a_thing_are_served(tmp_path: Path, name: str) -> None:
    touch(tmp_path / "secret.txt", "secret")
    touch(tmp_path / "run" / "secret.txt")
    touch(tmp_path / "run" / "videos" / "a.mp4")
    touch(tmp_path / "run" / "videos" / "a.txt")
    touch(tmp_path / "run" / "videos" / "deep" / "a.mp4")
    (tmp_path / "run" / "linked.html").symlink_to(tmp_path / "secret.txt")
    allowed = ("linked.html", "videos/*.mp4")
    assert served_document(tmp_path / "run", "videos/a.mp4", allowed) == tmp_path / "run" / "videos" / "a.mp4"
    with pytest.raises(DnnvssError):
        served_document(tmp_path / "run", name, allowed)


def write_events(path: Path, losses: list[float], picture: bytes = b"PNG") -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        writer = RecordWriter(file)
        for epoch, loss in enumerate(losses):
            event = Event(wall_time=1000.0 + epoch, step=10 * epoch)
            event.summary.value.add(tag="val/loss", simple_value=loss)
            event.summary.value.add(tag="epoch", simple_value=epoch)
            writer.write(event.SerializeToString())
        event = Event(wall_time=2000.0, step=3)
        event.summary.value.add(tag="trajectory").image.encoded_image_string = picture
        writer.write(event.SerializeToString())


def test_curves_come_by_epoch_and_a_cut_event_waits_for_its_end(tmp_path: Path) -> None:
    path = tmp_path / "tensorboard" / "events.out.tfevents.1"
    write_events(path, [0.5, 0.25, float("nan")])
    whole = path.read_bytes()
    path.write_bytes(whole[:-5])
    curves = FitCurves(tmp_path)
    (fit,) = curves.fits()
    assert fit["curves"] == {"val/loss": [[0, 0.5], [1, 0.25]]} and fit["pictures"] == [] and fit["name"] == "fit"
    path.write_bytes(whole)
    (fit,) = curves.fits()
    assert fit["pictures"] == [3] and fit["last"] == 2000.0 and not fit["damaged"]
    assert curves.picture("fit", 3) == b"PNG"
    with pytest.raises(DnnvssError):
        curves.picture("fit", 4)


def test_a_damaged_or_endless_file_of_events_ends_its_own_reading(tmp_path: Path) -> None:
    path = tmp_path / "events.out.tfevents.1"
    write_events(path, [0.5])
    good = path.read_bytes()
    for bad in (b"\xff" * 12, (20).to_bytes(8, "little") + b"\0" * 4 + b"\xff" * 24):
        path.write_bytes(good + bad)
        events = EventFile(path)
        events.refresh()
        assert events.damaged and events.scalars["val/loss"] == {0: 0.5}
    write_events(path, [1.0] * (POINTS + 10))
    events = EventFile(path)
    events.refresh()
    assert len(events.scalars["val/loss"]) == POINTS


@pytest.mark.slow
def test_curves_are_read_without_torch() -> None:
    code = "import sys, dnnvss.studio.areas.training; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_a_run_is_running_while_its_lock_is_held(tmp_path: Path) -> None:
    run = tmp_path / "run"
    touch(run / "run.json", "{}")
    assert state_of(run)[0] == STOPPED
    with locked(run):
        assert state_of(run) == (RUNNING, "being fitted")
        touch(run / "model.npz")
        assert state_of(run) == (RUNNING, "fitted, being evaluated")


def test_a_run_of_several_talkers_is_running_while_their_training_is(tmp_path: Path) -> None:
    touch(tmp_path / "both" / "talkers.json", '{"talkers": {"ann": "ann-1"}}')
    run = touch(tmp_path / "both" / "ann-1" / "run.json", "{}").parent
    assert state_of(run)[0] == STOPPED
    with locked(tmp_path / "both"):
        assert state_of(run) == (RUNNING, "being fitted")


def test_a_document_lets_only_its_own_script_run() -> None:
    page = document("t", "<p>x</p>", script="let a = 1;", data='{"a": "</script><script>evil()"}')
    assert only("let a = 1;") in page and "</script><script>evil" not in page
    assert "script-src 'none'" in document("t", "")


@pytest.fixture
def served(tmp_path: Path) -> Iterator[str]:
    touch(tmp_path / "runs" / "one" / "metrics.json", '{"headline": 0.5}')
    touch(tmp_path / "runs" / "one" / "run.json", "{}")
    touch(tmp_path / "runs" / "one" / "verdict.html", "<script>evil()</script>")
    touch(tmp_path / "runs" / "odd" / "metrics.json", "{")
    touch(tmp_path / "runs" / "odd" / "run.json", "{}")
    touch(tmp_path / "runs" / "table2-grid" / "evaluation.html")
    touch(tmp_path / "runs" / "table2-grid" / "side_by_side.mp4")
    touch(tmp_path / "data" / "compared" / "evaluation.html")
    touch(tmp_path / "data" / "broken" / "corpus.json", "[]")
    page = Page("speaking", (Route("GET", "/v1/own", lambda asked: Content(b"own", "text/plain")),))
    with Server(with_areas(page, tmp_path / "runs", [tmp_path / "data"])) as server:
        yield server.url


def ask(url: str) -> tuple[int, bytes, str]:
    try:
        with urllib.request.urlopen(url, timeout=20) as answer:
            return answer.status, answer.read(), answer.headers["Content-Security-Policy"]
    except urllib.error.HTTPError as error:
        return error.code, error.read(), ""


def test_every_area_lists_what_there_is_and_says_how_to_begin(served: str) -> None:
    assert ask(f"{served}v1/own")[1] == b"own"
    for area in ("footage", "labelling", "training", "results", "viewing"):
        assert b"<nav" in ask(f"{served}{area}/")[1]
        told = json.loads(ask(f"{served}{area}/items")[1])
        assert told["begin"] and all(each["command"].startswith("dnnvss ") for each in told["begin"])
    (broken,) = json.loads(ask(f"{served}footage/items")[1])["items"]
    assert "corpus.json" in broken["wrong"]
    items = {item["name"]: item for item in json.loads(ask(f"{served}results/items")[1])["items"]}
    assert items["odd"]["wrong"] and items["one"]["facts"] == {"correlation on the test split": "0.500"}
    assert {name for name, item in items.items() if item["state"] == "comparison"} == {"table2-grid", "compared"}
    assert [link["path"] for link in items["table2-grid"]["links"]] == ["evaluation.html", "side_by_side.mp4"]


def test_a_page_out_of_a_folder_runs_no_script_of_its_own(served: str) -> None:
    status, body, policy = ask(f"{served}results/one/verdict.html")
    assert status == 200 and b"evil" in body
    assert "script-src 'sha256-" in policy and "default-src 'none'" in policy and "sandbox" in policy


@pytest.mark.parametrize("path", ["results/one/config.yaml", "results/one/%2e%2e%2fodd%2fmetrics.json",
                                  "results/none/x", "results/one/", "training/one/picture?step=x",
                                  "results/..%2fdata/x", "training/one/picture?step=1&fit=..%2f..",
                                  "labelling/one/labels", "results/one/run.json"])
def test_what_no_area_has_is_refused_in_words(served: str, path: str) -> None:
    status, body, _ = ask(served + path)
    assert status in (400, 404) and "error" in json.loads(body) and b"Traceback" not in body
