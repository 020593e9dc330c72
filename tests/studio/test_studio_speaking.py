"""The studio with a run: the service by its routes, and the page in a real browser."""

import asyncio
import http.client
import io
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import aiohttp
import cv2
import numpy as np
import pytest
from browser import CHROMIUM, Browser, open_browser
from conftest import run_command

from dnnvss.commands.studio import styles
from dnnvss.media import read_video, video_info
from dnnvss.studio.pool import PoolLimits
from dnnvss.studio.server import Server
from dnnvss.studio.speaking import SpeakingDesk
from dnnvss.studio.speaking.uploads import ALIGNMENTS

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Client:
    """A program that uses the service."""

    server: Server

    def ask(self, method: str, path: str, body: Any = None, kind: str = "application/json") -> tuple[int, bytes]:
        data = body if isinstance(body, bytes | type(None)) else json.dumps(body).encode()
        with closing(http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=60)) as connection:
            connection.request(method, path, data, {"Content-Type": kind} if data is not None else {})
            answer = connection.getresponse()
            return answer.status, answer.read()

    def wait(self) -> None:
        """Wait until a worker is there."""
        until = time.monotonic() + 120
        while self.ask("GET", "/v1/health")[0] != 200:
            assert time.monotonic() < until, "no worker came"
            time.sleep(0.1)

    def json(self, method: str, path: str, body: Any = None) -> Any:
        status, data = self.ask(method, path, body)
        assert status == 200, data
        return json.loads(data)


@pytest.fixture(scope="module")
def runs(demo: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("studio")
    shutil.copytree(demo, folder / "corpus")
    assert run_command("train", "corpus=demo", f"corpus.out={folder / 'corpus'}", "model=phone_mean", "sample=false",
                       f"runs={folder / 'runs'}") == 0
    return folder / "runs"


@pytest.fixture(scope="module")
def client(runs: Path) -> Iterator[Client]:
    desk = SpeakingDesk(runs, styles(), PoolLimits(workers=2))
    with Server(desk.page()) as server:
        client = Client(server)
        client.wait()
        yield client
    desk.close()


@pytest.fixture
def take(client: Client) -> Any:
    run = client.json("GET", "/v1/runs")["runs"][0]["name"]
    return client.json("POST", "/v1/speak", {"run": run, "text": "papa may move", "engine": "formant"})


def pictures(data: bytes) -> list[np.ndarray]:
    found, at = [], 0
    while at < len(data):
        length = int.from_bytes(data[at:at + 4], "little")
        found.append(cv2.imdecode(np.frombuffer(data[at + 4:at + 4 + length], np.uint8), cv2.IMREAD_COLOR)[..., ::-1])
        at += 4 + length
    return found


def test_pictures_are_those_of_the_video(client: Client, take: Any, tmp_path: Path) -> None:
    status, data = client.ask("GET", f"/v1/takes/{take['id']}/pictures?first=5&count=7")
    shown = pictures(data)
    assert status == 200 and len(shown) == 7
    (tmp_path / "speech.mp4").write_bytes(client.ask("GET", f"/v1/takes/{take['id']}/files/speech.mp4")[1])
    film = read_video(tmp_path / "speech.mp4")
    assert len(film) == take["frames"] and video_info(tmp_path / "speech.mp4").has_audio
    for picture, frame in zip(shown, film[5:12], strict=True):
        assert np.abs(picture.astype(float) - frame[:picture.shape[0], :picture.shape[1]]).mean() < 4


def test_a_face_lives_where_that_is_asked_for(client: Client, take: Any) -> None:
    living = client.json("POST", f"/v1/takes/{take['id']}", {"life": 1.0, "seed": 4})
    still, first, again = (pictures(client.ask("GET", f"/v1/takes/{name}/pictures?first={at}&count=6")[1])
                           for name, at in ((take["id"], 5), (living["id"], 5), (living["id"], 8)))
    assert all((one != other).any() for one, other in zip(still, first, strict=True))
    assert all((one == other).all() for one, other in zip(first[3:], again[:3], strict=True))
    told = json.loads(client.ask("GET", f"/v1/takes/{living['id']}/files/speech.json")[1])["life"]
    assert told["share"] == 1 and told["seed"] == 4
    assert living["curves"] == take["curves"] and "style.life=1.0 style.seed=4" in living["command"]


def test_keys_are_held_and_the_rest_stays(client: Client, take: Any) -> None:
    name = "aperture"
    values = take["curves"][name]["values"]
    middle = (len(values) // 2 + 0.5) / take["rate"]
    goal = max(values) * 0.9
    key = {"time": middle - 0.03, "end": middle + 0.03, "name": name, "low": goal, "high": goal}
    changed = client.json("POST", f"/v1/takes/{take['id']}", {"keys": [key]})
    assert changed["tiers"] == take["tiers"]
    assert changed["curves"][name]["values"][len(values) // 2] == pytest.approx(goal, abs=0.3)
    assert "import_keys=keys.csv" in changed["command"]


def test_the_command_and_the_files_give_the_same_again(client: Client, take: Any, tmp_path: Path,
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    key = {"time": 0.5, "end": 0.6, "name": "aperture", "low": 1.0, "high": 1.0}
    changed = client.json("POST", f"/v1/takes/{take['id']}", {"articulation": 1.3, "seed": 7, "keys": [key]})
    status, data = client.ask("GET", f"/v1/takes/{changed['id']}/files/all.zip")
    assert status == 200
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        archive.extractall(tmp_path)
    own = np.load(tmp_path / "speech.npz")["parameters"]
    monkeypatch.chdir(tmp_path)
    words = shlex.split(changed["command"])
    assert words[:2] == ["dnnvss", "speak"] and "style.seed=7" in words
    runs = Path(words[2].removeprefix("run=")).parent
    assert run_command("speak", *words[2:], "out=again.mp4") == 0
    assert run_command("speak", "session=session.json", f"runs={runs}", "out=reopened.mp4") == 0
    for name in ("again", "reopened"):
        np.testing.assert_allclose(np.load(f"{name}.npz")["parameters"], own, atol=1e-5)
        seen, given = (np.array(list(read_video(Path(f"{own}.mp4"))), dtype=float) for own in (name, "speech"))
        assert np.abs(seen - given).mean() < 0.5  # grey levels: the encoder's, where threads are others
        assert json.loads(Path(f"{name}.json").read_text())["life"]["seed"] == 7


def test_a_voice_gives_the_same_again_though_it_is_taken_away_at_another_rate(
    client: Client, take: Any, runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = json.loads((runs.parent / "corpus" / "utterances.jsonl").read_text().splitlines()[0])
    wav = (runs.parent / "corpus" / said["audio"]).read_bytes()
    sound = json.loads(client.ask("POST", "/v1/sounds", wav, "application/octet-stream")[1])["id"]
    voiced = client.json("POST", "/v1/speak", {"run": take["run"], "text": said["text"], "sound": sound})
    for name in ("session.json", "speech.wav", "speech.TextGrid", "speech.npz"):
        (tmp_path / name).write_bytes(client.ask("GET", f"/v1/takes/{voiced['id']}/files/{name}")[1])
    own = np.load(tmp_path / "speech.npz")["points"]
    monkeypatch.chdir(tmp_path)
    words = shlex.split(voiced["command"])
    assert run_command("speak", *words[2:], "out=again.mp4") == 0
    assert run_command("speak", "session=session.json", "wav=speech.wav", f"runs={runs}", "out=reopened.mp4") == 0
    for name in ("again", "reopened"):
        np.testing.assert_allclose(np.load(f"{name}.npz")["points"], own, atol=1e-4)


def test_a_voice_that_was_brought_is_followed(client: Client, take: Any) -> None:
    _, wav = client.ask("GET", f"/v1/takes/{take['id']}/sound")
    status, data = client.ask("POST", "/v1/sounds", wav, "application/octet-stream")
    assert status == 200
    sound = json.loads(data)
    body = {"run": take["run"], "sound": sound["id"], "alignment": take["alignment"]}
    again = client.json("POST", "/v1/speak", body)
    assert again["frames"] == take["frames"]
    status, data = client.ask("GET", f"/v1/takes/{take['id']}/files/speech.TextGrid")
    status, data = client.ask("POST", "/v1/alignments/own.TextGrid", data, "application/octet-stream")
    assert status == 200
    assert json.loads(data)["phones"]["labels"] == take["alignment"]["phones"]["labels"]


@pytest.mark.parametrize("path", ["/v1/takes/x", "/v1/takes/{id}/files/..%2F..%2Fmodel.npz", "/v1/takes/{id}/files/a",
                                  "/v1/takes/{id}/pictures?first=-1", "/v1/takes/{id}/pictures?count=1000000",
                                  "/v1/takes/{id}/pictures?first=99999", "/v1/takes/{id}/pictures?view=soul"])
def test_what_there_is_not_is_refused(client: Client, take: Any, path: str) -> None:
    status, data = client.ask("GET", path.replace("{id}", take["id"]))
    assert status == 400 and b"error" in data and b"Traceback" not in data


def test_a_stream_has_every_picture_in_order(client: Client, take: Any) -> None:
    texts, numbers, first = asyncio.run(streamed(client.server.port, {"run": take["run"], "text": "papa may move",
                                                                      "engine": "formant"}))
    told = json.loads(texts[0])
    assert numbers == list(range(told["frames"]))
    assert first == pictures_of(client, told["id"], 0)
    texts, numbers, _ = asyncio.run(streamed(client.server.port, {"run": "none"}))
    assert "no run" in json.loads(texts[0])["error"] and not numbers


async def streamed(port: int, body: Any) -> tuple[list[str], list[int], bytes]:
    texts, numbers, first = [], [], b""
    async with (aiohttp.ClientSession() as session,
                session.ws_connect(f"http://127.0.0.1:{port}/v1/stream") as socket):
        await socket.send_str(json.dumps(body))
        async for message in socket:
            if message.type == aiohttp.WSMsgType.TEXT:
                texts.append(message.data)
            else:
                numbers.append(int.from_bytes(message.data[:4], "little"))
                first = first or message.data[4:]
    return texts, numbers, first


def pictures_of(client: Client, take: str, first: int) -> bytes:
    return client.ask("GET", f"/v1/takes/{take}/pictures?first={first}&count=1")[1][4:]


@pytest.mark.parametrize("own, told", [
    ({"text": "a" * 20_001}, "has 20001 signs. Say at most 20000"), ({"speed": 9}, "speed=9 is too much. Give"),
    ({"engin": "none"}, "engin is no setting. Did you mean engine"), ([], "no table of names and values")])
def test_who_asks_wrongly_is_told_what_would_be_right(client: Client, take: Any, own: Any, told: str) -> None:
    body = {"run": take["run"], "text": "a"} | own if own else own
    status, data = client.ask("POST", "/v1/speak", body)
    assert status == 400 and told in json.loads(data)["error"]


def test_runs_are_named_and_never_paths(client: Client, runs: Path) -> None:
    for name in ("../corpus", str(runs), "", "runs\0"):
        assert client.ask("POST", "/v1/speak", {"run": name, "text": "a"})[0] == 400


def test_rig_files_are_those_of_their_commands(client: Client, take: Any, tmp_path: Path,
                                               monkeypatch: pytest.MonkeyPatch) -> None:
    names = {"livelink.csv", "shapes.json", "head.glb", "plain.csv"}
    assert names < set(take["files"]) and names < set(take["commands"])
    monkeypatch.chdir(tmp_path)
    for name in sorted(names):
        status, data = client.ask("GET", f"/v1/takes/{take['id']}/files/{name}")
        assert status == 200
        words = shlex.split(take["commands"][name])
        assert run_command("speak", *words[2:], "out=again.mp4") == 0
        own = (tmp_path / name).read_bytes()
        if name == "livelink.csv":
            rows = [[[float(word) for word in line.split(",")[2:]] for line in text.decode().splitlines()[1:]]
                    for text in (data, own)]
            np.testing.assert_allclose(rows[0], rows[1], atol=1e-5)
            assert np.shape(rows[0]) == (take["frames"], 61) and data.splitlines()[0] == own.splitlines()[0]
        elif name == "head.glb":
            assert data[:4] == b"glTF" and len(data) == len(own)
        else:
            assert len(data.splitlines()) == len(own.splitlines())


def test_the_client_in_the_docs_is_as_short_as_it_says_and_works(client: Client, tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "studio.md").read_text("utf-8")
    found = re.search(r"```python\n(.*?)```", text, re.S)
    assert found is not None and len(found[1].splitlines()) <= 20
    (tmp_path / "client.py").write_text(found[1])
    done = subprocess.run([sys.executable, "client.py", f"http://127.0.0.1:{client.server.port}"], cwd=tmp_path,
                          capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert re.match(r"\d+ pictures at 30.0 a second", done.stdout)
    assert video_info(tmp_path / "speech.mp4").has_audio
    assert (tmp_path / "livelink.csv").read_text().startswith("Timecode,BlendShapeCount,")


def test_a_take_outlives_the_worker_that_said_it(client: Client, take: Any) -> None:
    asked = {path: client.ask("GET", f"/v1/takes/{take['id']}{path}")[1]
             for path in ("", "/pictures?first=3&count=4", "/sound")}
    changed = client.json("POST", f"/v1/takes/{take['id']}", {"articulation": 1.4})
    for pid in workers():
        os.kill(pid, signal.SIGKILL)
    time.sleep(0.3)  # until the loss is noticed
    client.wait()
    for path, before in asked.items():
        status, data = client.ask("GET", f"/v1/takes/{take['id']}{path}")
        assert status == 200 and data == before
    again = client.json("POST", f"/v1/takes/{take['id']}", {"articulation": 1.4})
    assert again["curves"] == changed["curves"]
    assert client.json("GET", "/v1/health")["replaced"] >= 2


def workers() -> list[int]:
    """The workers of services of this process."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            words = (folder / "cmdline").read_bytes()
            parent = (folder / "stat").read_text().rsplit(")", 1)[1].split()[1]
        except OSError:
            continue
        if int(parent) == os.getpid() and b"dnnvss.studio.speaking.worker" in words:
            found.append(int(folder.name))
    return found


@pytest.fixture
def browser(tmp_path: Path) -> Iterator[Browser]:
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    with open_browser(tmp_path / "profile") as found:
        yield found


def spoken(browser: Browser, client: Client) -> None:
    browser.call("Page.navigate", url=client.server.url)
    browser.wait("document.getElementById('run')?.options.length > 0")
    browser.ask("document.getElementById('text').value = 'we may buy more'")
    browser.ask("document.getElementById('speak').click()")
    browser.wait("document.body.dataset.whole && document.getElementById('files').children.length")


def face(browser: Browser) -> str:
    return str(browser.ask("document.getElementById('face').toDataURL()"))


def test_from_the_text_to_a_film_in_a_browser(browser: Browser, client: Client, tmp_path: Path) -> None:
    spoken(browser, client)
    browser.wait("parseFloat(document.getElementById('clock').textContent) > 0.2")
    link = browser.ask("[...document.querySelectorAll('#files a')].find(a => a.download === 'speech.mp4').href")
    length = browser.ask(f"fetch('{link}').then(r => r.arrayBuffer()).then(b => b.byteLength)")
    assert length > 2000
    assert browser.ask("document.getElementById('said').textContent") == ""
    browser.screenshot(tmp_path / "page.png")


def test_a_dragged_curve_changes_the_picture_and_undo_brings_it_back(browser: Browser, client: Client) -> None:
    spoken(browser, client)
    browser.ask("document.getElementById('play').textContent === 'Pause' && document.getElementById('play').click()")
    left, top, width, height = browser.ask(
        "(() => { const t = document.getElementById('timeline'); t.scrollIntoView(); "
        "const r = t.getBoundingClientRect(); return [r.left, r.top, r.width, r.height]; })()")
    whole = browser.ask("document.body.dataset.whole")
    place = left + width / 2
    browser.drag((place, top + 0.9 * height), (place, top + 0.5 * height))
    browser.wait(f"document.body.dataset.whole !== '{whole}' && !document.getElementById('clear').disabled")
    held = face(browser)
    browser.ask("document.getElementById('undo').click()")
    browser.wait("document.getElementById('clear').disabled")
    time = browser.ask(f"document.getElementById('time').value = {(place - left) / width}; "
                       "document.getElementById('time').dispatchEvent(new Event('input')); 1")
    assert time == 1
    browser.wait(f"document.getElementById('face').toDataURL() !== {json.dumps(held)}")


def test_the_page_works_by_keyboard_and_on_a_narrow_screen(browser: Browser, client: Client) -> None:
    browser.call("Emulation.setDeviceMetricsOverride", width=360, height=740, deviceScaleFactor=1, mobile=True)
    spoken(browser, client)
    assert browser.ask("document.documentElement.scrollWidth") <= 360
    browser.ask("document.getElementById('timeline').focus()")
    for key in ("ArrowRight", "ArrowRight", "ArrowUp"):
        browser.key(key)
    browser.wait("!document.getElementById('clear').disabled")
    browser.key("Delete")
    browser.wait("document.getElementById('clear').disabled")


def ready(browser: Browser, client: Client) -> None:
    browser.call("Page.navigate", url=client.server.url)
    browser.wait("document.getElementById('run')?.options.length > 0")


def say(browser: Browser, text: str) -> None:
    browser.ask(f"document.getElementById('text').value = {json.dumps(text)}; document.getElementById('speak').click()")


def test_the_last_sentence_is_shown_though_an_earlier_one_comes_after_it(browser: Browser, client: Client) -> None:
    ready(browser, client)
    browser.ask("window.own = fetch; window.asked = 0; window.fetch = (path, given) => path !== '/v1/speak' || asked++ "
                "? own(path, given) : new Promise(over => setTimeout(over, 3000)).then(() => own(path, given))"
                ".finally(() => { window.late = true; }); 1")
    say(browser, "papa")
    browser.wait("asked === 1")
    say(browser, "mama may")
    browser.wait("document.body.dataset.whole && window.late")
    time.sleep(0.5)
    shown = "[...document.querySelectorAll('#words td:first-child')].map(cell => cell.textContent)"
    assert browser.ask(shown) == ["mama", "may"] and browser.ask("document.getElementById('said').textContent") == ""


def test_files_are_known_by_their_names_and_those_that_are_none_are_named(browser: Browser, client: Client) -> None:
    ready(browser, client)
    taken = browser.ask("document.getElementById('file').accept.toLowerCase()").split(",")
    assert set(ALIGNMENTS) <= set(taken)
    drop = ("(async (name, text) => { const all = new DataTransfer(); all.items.add(new File([text], name)); "
            "dispatchEvent(new DragEvent('drop', {dataTransfer: all})); })")
    browser.ask(f"{drop}('said.PHN', '0 3000 h#\\n3000 5000 pcl\\n5000 5600 p\\n5600 9000 aa\\n9000 12000 h#\\n')")
    browser.wait("document.getElementById('brought').textContent.startsWith('phone times as given')")
    browser.ask(f"{drop}('notes.png', 'no voice')")
    browser.wait("document.getElementById('said').textContent.startsWith('notes.png: cannot be read')")


def test_a_text_that_is_too_long_is_refused_and_not_cut_off(browser: Browser, client: Client) -> None:
    ready(browser, client)
    browser.ask("document.getElementById('text').focus()")
    browser.call("Input.insertText", text="a " * 10_001)
    browser.ask("document.getElementById('speak').click()")
    browser.wait("document.getElementById('said').textContent.includes('has 20001 signs. Say at most 20000')")


def test_a_studio_that_is_gone_is_told_in_words(browser: Browser, client: Client) -> None:
    ready(browser, client)
    browser.ask("window.fetch = () => Promise.reject(new TypeError('Failed to fetch'))")
    say(browser, "papa")
    browser.wait("document.getElementById('said').textContent === 'The studio does not answer. Is it still running?'")


def test_hostile_words_are_shown_as_words(browser: Browser, client: Client) -> None:
    browser.call("Page.navigate", url=client.server.url)
    browser.wait("document.getElementById('run')?.options.length > 0")
    browser.ask("document.getElementById('text').value = "
                "'<img src=x onerror=document.title=1> we <script>may</script>'")
    browser.ask("document.getElementById('speak').click()")
    browser.wait("document.getElementById('files').children.length || "
                 "document.getElementById('said').classList.contains('bad')")
    assert browser.ask("document.title") == "dnnvss studio"
    assert browser.ask("document.querySelectorAll('img').length") == 0
