"""The commands of labelling, and the page in a real browser."""

import json
import re
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, open_browser
from conftest import ROOT, run_command
from face.aam_cases import picture

from dnnvss.face.aam.labelling import export
from dnnvss.face.aam.labelling.sheet import Label, Sheet
from dnnvss.formats.landmarks import read_pts, write_pts
from dnnvss.media import write_video
from dnnvss.media.pictures import write_picture
from dnnvss.studio.labelling import LabelDesk
from dnnvss.studio.server import Server

GROUPS = {"lips_outer": (0, 4), "jaw": (4, 6)}
POINTS = np.array([[30, 40], [40, 36], [50, 40], [40, 44], [28, 60], [52, 60]], dtype=float)


@dataclass(frozen=True)
class Served:
    """A page that is being served: its labels, and where it is."""

    desk: LabelDesk
    url: str


@pytest.fixture
def served(tmp_path: Path) -> Iterator[Served]:
    folder = tmp_path / "labels"
    labels = tuple(Label("a.mp4", i, f"a_{i}.png", f"a_{i}.pts") for i in range(3))
    for i, label in enumerate(labels):
        write_picture(folder / label.image, picture(i))
        write_pts(folder / label.points, POINTS + i)
    Sheet(folder, GROUPS, labels, frozenset(), "own").save()
    desk = LabelDesk(folder)
    with Server(desk.page()) as server:
        yield Served(desk, server.url)


@pytest.fixture(scope="module")
def videos(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two videos of the toy talker, one in a folder of its own."""
    folder = tmp_path_factory.mktemp("videos")
    for name, phase in (("one.mp4", 0.0), ("deep/two.mp4", 1.0)):
        frames = [picture(3 + 3 * np.sin(phase + 0.7 * t)) for t in range(30)]
        (folder / name).parent.mkdir(exist_ok=True)
        write_video(folder / name, frames, 25)
    return folder


def test_frames_are_chosen_exported_and_added_to(
    videos: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "labels"
    assert run_command("label", "choose", str(videos), "--count", "4", "--out", str(out)) == 0
    assert "4 guesses placed by:" in capsys.readouterr().out
    sheet = Sheet.open(out)
    assert len(sheet.labels) == 4 and sheet.count == 40 and sheet.videos == str(videos.resolve())
    for label in sheet.labels:
        assert (videos / label.video).is_file() and sheet.picture(label).shape == (80, 96, 3)
        assert sheet.read(label).shape == (40, 2)
    assert {label.video for label in sheet.labels} == {"one.mp4", "deep/two.mp4"}
    moved = sheet.read(sheet.labels[0]) + 1
    sheet.write(sheet.labels[0].image, moved, done=True)
    assert run_command("label", "choose", str(videos), "--count", "6", "--out", str(out)) == 0
    more = Sheet.open(out)
    assert set(sheet.labels) <= set(more.labels) and more.read(sheet.labels[0]) == pytest.approx(moved)
    assert run_command("label", "choose", str(videos), "--count", "4", "--out", str(out), "--scheme", "ibug68") == 1
    assert "holds labels of the scheme 'lips_jaw_nostrils'" in capsys.readouterr().err


def test_videos_whose_paths_look_alike_have_pictures_of_their_own(
    tmp_path: Path
) -> None:
    out, folder = tmp_path / "labels", tmp_path / "videos"
    for k, name in enumerate(("a/b.mp4", "a_b.mp4", "a_b.avi", "A_B.mp4")):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        write_video(folder / name, [picture(2 * k + np.sin(0.7 * t)) for t in range(20)], 25)
    assert run_command("label", "choose", str(folder / "a_b.mp4"), "--count", "3", "--out", str(out)) == 0
    first = Sheet.open(out)
    assert {label.image.rpartition("_")[0] for label in first.labels} == {"a_b"}
    assert run_command("label", "choose", str(folder), "--count", "12", "--out", str(out)) == 0
    sheet = Sheet.open(out)
    assert set(first.labels) <= set(sheet.labels)
    assert {label.video for label in sheet.labels} == {"a/b.mp4", "a_b.mp4", "a_b.avi", "A_B.mp4"}
    names = {label.video: label.image.rpartition("_")[0].lower() for label in sheet.labels}
    assert len(set(names.values())) == 4
    images = [label.image.lower() for label in sheet.labels]
    assert len(set(images)) == len(images) and all((out / label.image).is_file() for label in sheet.labels)
    assert run_command("label", "choose", str(folder), "--count", "12", "--out", str(out)) == 0
    assert Sheet.open(out).labels == sheet.labels


def test_check_lists_what_is_open_and_ends_with_an_error(
    served: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = str(served.desk.sheet.folder)
    assert run_command("label", "check", folder) == 1
    said = capsys.readouterr()
    assert said.out.count("not finished") == 3 and "3 of 3 labels need a look" in said.err
    for label in served.desk.sheet.labels:
        served.desk.store(label.image, {"points": POINTS.tolist(), "done": True})
    assert run_command("label", "check", folder) == 0
    assert "none looks wrong" in capsys.readouterr().out


def test_the_page_and_the_commands_keep_what_the_others_wrote(
    videos: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "labels"
    run_command("label", "choose", str(videos), "--count", "3", "--out", str(out))
    first = Sheet.open(out)
    desk = LabelDesk(out)
    page = [{"points": first.read(label).tolist(), "done": True} for label in first.labels]
    inner = export.place

    def finished_meanwhile(*given: object) -> object:
        desk.store(first.labels[0].image, page[0])
        return inner(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(export, "place", finished_meanwhile)
    run_command("label", "choose", str(videos), "--count", "5", "--out", str(out))
    more = Sheet.open(out)
    assert len(more.labels) >= 5 and more.done == {first.labels[0].image}
    more.write(first.labels[1].image, first.read(first.labels[1]), done=True)
    desk.store(first.labels[2].image, page[2])
    now = Sheet.open(out)
    assert now.labels == more.labels and now.done == {label.image for label in first.labels}
    assert len(desk.overview()["labels"]) == len(more.labels)


def test_the_server_refuses_what_no_page_of_its_own_sends(served: Served) -> None:
    def status(path: str, data: bytes | None = None, **headers: str) -> int:
        request = urllib.request.Request(served.url + path, data, headers)
        try:
            with urllib.request.urlopen(request, timeout=10) as answer:
                return int(answer.status)
        except urllib.error.HTTPError as error:
            with error:
                return error.code

    assert status("") == status("labels") == status("image/a_0.png") == 200
    assert status("image/..%2Flabels.json") == status("points/b.png") == 400
    assert status("labels", Host="evil.example") == 403
    good = b'{"points": [[1, 2], [1, 2], [1, 2], [1, 2], [1, 2], [1, 2]], "done": true}'
    json = {"Content-Type": "application/json"}
    assert status("points/a_0.png", good) == 415  # a form of another page cannot send JSON
    assert status("points/a_0.png", good[:40], **json) == status("points/a_0.png", b"[]", **json) == 400
    assert status("points/a_0.png", good.replace(b"[1, 2]", b"[1, NaN]", 1), **json) == 400
    assert read_pts(served.desk.sheet.folder / "a_0.pts") == pytest.approx(POINTS)
    assert status("points/a_0.png", good, **json) == 200
    assert read_pts(served.desk.sheet.folder / "a_0.pts") == pytest.approx(np.tile([1, 2], (6, 1)))


@pytest.mark.skipif(not CHROMIUM, reason="needs the program chromium to open the page")
def test_points_are_dragged_in_a_browser_and_the_files_follow(served: Served, tmp_path: Path) -> None:
    folder = served.desk.sheet.folder
    with open_browser(tmp_path / "profile") as browser:
        def place(point: int) -> tuple[float, float]:
            found = browser.ask(f"""(() => {{ const r = document.querySelector('[data-point="{point}"]')
                .getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2]; }})()""")
            return float(found[0]), float(found[1])

        browser.call("Page.addScriptToEvaluateOnNewDocument", source="""window.refused = [];
            addEventListener('securitypolicyviolation', e => refused.push(e.violatedDirective + ' ' + e.blockedURI))""")
        browser.call("Page.navigate", url=served.url)
        browser.wait("document.querySelectorAll('#points circle').length == 6")
        pixel = float(browser.ask("view.getBoundingClientRect().width / box.width"))
        x, y = place(2)
        browser.drag((x, y), (x + 3 * pixel, y - 2 * pixel))
        browser.key("s")
        browser.wait("document.getElementById('said').textContent == 'saved a_0.png'")
        truth = POINTS.copy()
        truth[2] += [3, -2]
        assert read_pts(folder / "a_0.pts") == pytest.approx(truth, abs=0.02)
        assert not Sheet.open(folder).done

        browser.key("z")
        assert browser.ask("points[2]") == pytest.approx(POINTS[2].tolist(), abs=1e-5)
        browser.key("y")
        browser.key("3")  # the whole shape
        x, y = place(4)
        browser.drag((x, y), (x + 5 * pixel, y))
        browser.key("Enter")  # finished, and on to the next frame
        browser.wait("document.title.startsWith('a_1')")
        assert read_pts(folder / "a_0.pts") == pytest.approx(truth + np.array([5, 0]), abs=0.04)
        assert Sheet.open(folder).done == {"a_0.png"}

        browser.key("c")  # the previous label as a start
        browser.wait("!document.getElementById('undo').disabled")
        browser.key("n")
        browser.wait("document.title.startsWith('a_2')")
        assert read_pts(folder / "a_1.pts") == pytest.approx(read_pts(folder / "a_0.pts"), abs=1e-4)
        assert Sheet.open(folder).done == {"a_0.png"}

        before = (folder / "a_2.pts").read_bytes()
        browser.key("Enter")  # an untouched guess: there is a question first
        browser.wait("document.getElementById('said').textContent.includes('still a guess')")
        assert Sheet.open(folder).done == {"a_0.png"} and browser.ask("document.getElementById('after').hidden")
        browser.key("Enter")
        browser.wait("sheet.labels[2].done")
        assert Sheet.open(folder).done == {"a_0.png", "a_2.png"} and (folder / "a_2.pts").read_bytes() == before
        browser.key("p")
        browser.wait("document.title.startsWith('a_1')")
        browser.key("Enter")  # it was moved before: no question
        browser.wait("!document.getElementById('after').hidden")
        assert browser.ask("document.getElementById('command').textContent").startswith("dnnvss track ")

        browser.wait("document.title.startsWith('a_2')")
        browser.ask("points.pop()")
        browser.key("s")
        browser.wait("document.getElementById('said').classList.contains('bad')")
        assert "5 points" in browser.ask("document.getElementById('said').textContent")
        assert (folder / "a_2.pts").read_bytes() == before
        assert browser.ask("refused") == []  # the page does all this under its own policy


@pytest.mark.skipif(not CHROMIUM, reason="needs the program chromium to open the page")
def test_another_page_in_the_browser_can_neither_read_nor_write(served: Served, tmp_path: Path) -> None:
    folder = served.desk.folder
    before = (folder / "a_0.pts").read_bytes()
    body = json.dumps({"points": (POINTS + 5).tolist(), "done": True})
    with open_browser(tmp_path / "profile") as browser:
        browser.call("Page.navigate", url="data:text/html,elsewhere")
        browser.wait("document.body?.textContent == 'elsewhere'")
        for kind, mode in (("text/plain", "no-cors"), ("application/json", "cors")):
            sent = f"""fetch('{served.url}points/a_0.png', {{method: 'POST', mode: '{mode}',
                body: JSON.stringify({body}), headers: {{'Content-Type': '{kind}'}}}})
                .then(a => a.type, e => 'refused')"""
            assert browser.ask(sent) in ("opaque", "refused")
        assert browser.ask(f"fetch('{served.url}labels').then(a => a.text(), e => 'refused')") == "refused"
    assert (folder / "a_0.pts").read_bytes() == before and not Sheet.open(folder).done


def test_ctrl_c_ends_the_page_with_all_saved(served: Served) -> None:
    folder = served.desk.folder
    program = ("import signal, sys; signal.signal(signal.SIGINT, signal.default_int_handler); "  # nohup ignores it
               "from dnnvss.commands.label import main; sys.exit(main(sys.argv[1:]))")
    with subprocess.Popen([sys.executable, "-c", program, "page", str(folder), "--port", "0"], text=True, cwd=ROOT,
                          stdout=subprocess.PIPE, stderr=subprocess.PIPE) as page:
        assert page.stdout is not None and page.stderr is not None
        url = re.findall(r"3 frames, 0 finished; open (http://127\.0\.0\.1:\d+/)", page.stdout.readline())[0]
        body = json.dumps({"points": (POINTS + 7).tolist(), "done": True}).encode()
        request = urllib.request.Request(f"{url}points/a_1.png", body, {"Content-Type": "application/json"})
        with urllib.request.urlopen(request, timeout=10) as answer:
            assert json.load(answer) == {"saved": "a_1.png"}
        page.send_signal(signal.SIGINT)
        try:
            out, errors = page.communicate(timeout=30)
        except subprocess.TimeoutExpired:
            page.kill()
            raise
    assert page.returncode == 0 and "1 of 3 frames are finished; all is saved" in out and not errors
    assert read_pts(folder / "a_1.pts") == pytest.approx(POINTS + 7)

