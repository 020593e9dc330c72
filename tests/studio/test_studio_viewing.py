"""The page of viewing tests in a real browser: every design to its end, on a desktop and a phone, with a reload."""

import json
import shutil
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browser import CHROMIUM, Browser, open_browser
from conftest import run_command
from viewing_cases import design, plain, sheet_of, simulated, write_test

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.viewing.answers import answer_files, receive
from dnnvss.evaluation.viewing.sheet import Sheet
from dnnvss.studio.server import Server
from dnnvss.studio.viewing import ViewingDesk

DESIGNS = {"preference": {"tie": True}, "dscqs": {}, "single": {}, "words": {}, "turing": {}, "intelligibility": {}}
needs_browser = pytest.mark.skipif(not CHROMIUM, reason="needs the program chromium to open the page")
_WATCH = """window.refused = []; window.failed = [];
    addEventListener('securitypolicyviolation', e => refused.push(e.violatedDirective + ' ' + e.blockedURI));
    addEventListener('error', e => failed.push(e.message));
    addEventListener('unhandledrejection', e => failed.push(String(e.reason)));"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with open_browser(tmp_path_factory.mktemp("profile")) as opened:
        opened.call("Page.addScriptToEvaluateOnNewDocument", source=_WATCH)
        yield opened


def size(browser: Browser, phone: bool) -> None:
    width, height = (390, 844) if phone else (1280, 800)
    browser.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=2 if phone else 1,
                 mobile=phone, screenWidth=width, screenHeight=height)
    browser.call("Emulation.setTouchEmulationEnabled", enabled=phone)


def visible(browser: Browser) -> str:
    return str(browser.ask("[...document.querySelectorAll('main > section')].find(s => !s.hidden)?.id || ''"))


def click(browser: Browser, where: str) -> None:
    browser.wait(f"document.querySelector('{where}') && !document.querySelector('{where}').disabled", 20)
    browser.ask(f"document.querySelector('{where}').click()")


def answer_trial(browser: Browser) -> None:
    """Play the trial to its end and answer it, as far as an attention check asks; then go on."""
    at = browser.ask("state.stage + state.at")
    browser.wait("trial && !document.getElementById('play').disabled")
    assert browser.ask("trial.controls.every(c => c.disabled) && document.getElementById('next').disabled")
    browser.key(" ")
    browser.wait("trial.whole && !trial.busy", 20)
    browser.ask("""(() => { const e = trial.trial.expect;
        if (scored) trial.controls.forEach((c, k) => { c.value = e === 'least' ? 0 : e === 'most' ? 100 : 30 + 40 * k;
            c.dispatchEvent(new Event('input')); });
        else if (trial.controls[0].type === 'text') { trial.controls[0].value = e || 'bin';
            trial.controls[0].dispatchEvent(new Event('input')); }
        else trial.controls.find(c => !e || c.dataset.value === e).click(); })()""")
    browser.wait("!document.getElementById('next').disabled")
    browser.key("Enter")
    browser.wait(f"state.stage + state.at !== '{at}'")


def through(browser: Browser, shots: Path | None = None) -> list[str]:
    """Go from wherever the page is to its end, with a reload in the middle; return the sections that were seen."""
    sections, reloaded = list[str](), False
    while True:
        section = visible(browser)
        if shots is not None and section not in sections:
            browser.screenshot(shots / f"{section}.png")
        sections.append(section)
        if section == "end":
            return sections
        if section == "welcome":
            click(browser, "#agree")
            browser.wait("state.stage !== 'welcome'")
        elif section == "questions":
            browser.ask("document.querySelectorAll('#asked select').forEach(s => { s.selectedIndex = 1; })")
            click(browser, "#answered")
        elif section == "screen":
            click(browser, "#dark button:nth-child(4)")
            click(browser, "#bright button:nth-child(5)")
            click(browser, "#seen")
        elif section == "headphones":
            click(browser, "#tones")
            click(browser, "#quietest button:nth-child(2)")
        elif section == "trial":
            if browser.ask("state.stage === 'trials' && state.at === 2") and not reloaded:
                before, reloaded = browser.ask("JSON.stringify(state)"), True
                browser.call("Page.reload")
                browser.wait("document.readyState === 'complete' && typeof state === 'object' && trial")
                assert browser.ask("JSON.stringify(state)") == before
            answer_trial(browser)
        elif section == "rest":
            click(browser, "#rise")
        elif section == "comment":
            browser.ask("document.getElementById('words').value = '<img src=x onerror=alert(1)>'")
            click(browser, "#finish")


@needs_browser
@pytest.mark.slow
@pytest.mark.parametrize("phone", [False, True], ids=["desktop", "phone"])
@pytest.mark.parametrize("name", DESIGNS)
def test_every_design_runs_to_its_end(name: str, phone: bool, browser: Browser, tmp_path: Path) -> None:
    size(browser, phone)
    sheet = sheet_of(design(name, phones="allowed", screen=name == "preference", per_viewer=4, each="once",
                            questions=_asked() if name == "preference" else (), **DESIGNS[name]))
    folder = write_test(tmp_path / "test", sheet)
    desk = ViewingDesk(folder)
    with Server(desk.page()) as server:
        browser.call("Page.navigate", url=server.url)
        browser.wait("document.readyState === 'complete' && typeof state === 'object'")
        sections = through(browser)
        browser.wait("document.getElementById('sent').textContent.startsWith('Your answers have been sent')")
        assert browser.ask("refused") == [] and browser.ask("failed") == []
    received = receive(sheet, answer_files(folder / "answers"))
    assert received.refused == {} and len(received.answers) == 1
    answer = next(iter(received.answers.values()))
    assert answer.comment == "<img src=x onerror=alert(1)>" and answer.device.phone == phone
    assert sections.count("rest") == (len(answer.rows) - 1) // 3
    if name == "preference":
        assert answer.device.squares == (3, 4) and answer.questions == ("Yes", "")
        apart = [row.apart for row in answer.rows]
        assert all(a is not None and abs(a) <= 40 for a in apart), apart  # a frame at 25 a second


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small preference test on disk."""
    sheet = sheet_of(design("preference", screen=False, checks=0, sentences=2, per_viewer=2))
    return write_test(tmp_path_factory.mktemp("test"), sheet)


@needs_browser
def test_a_double_click_is_enough_and_the_answers_come_as_a_file(
    folder: Path, browser: Browser, tmp_path: Path
) -> None:
    size(browser, False)
    browser.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    browser.call("Page.navigate", url=f"{(folder / 'page' / 'index.html').as_uri()}?list=1")
    browser.wait("document.readyState === 'complete' && typeof state === 'object'")
    through(browser)
    assert browser.ask("document.getElementById('sent').textContent").startswith("Please save your answers")
    assert browser.ask("failed") == [] and not browser.ask("state.served")
    assert browser.ask("document.getElementById('anew').offsetParent === null")  # the answers are nowhere else yet
    click(browser, "#save")
    assert browser.ask("document.getElementById('anew').offsetParent !== null")
    for _ in range(100):
        if found := list(tmp_path.glob("answers-*.json")):
            break
        browser.ask("new Promise(r => setTimeout(r, 50))")
    received = receive(Sheet.open(folder), answer_files(tmp_path))
    assert len(found) == 1 and [a.list for a in received.answers.values()] == [1] and received.refused == {}
    click(browser, "#anew")
    browser.wait("typeof state === 'object' && state.stage === 'welcome' && state.rows.length === 0")


@needs_browser
def test_a_pair_comes_to_its_end_where_no_picture_is_shown(folder: Path, browser: Browser) -> None:
    size(browser, False)
    with Server(ViewingDesk(folder).page()) as server:
        browser.call("Page.navigate", url=server.url)
        browser.wait("document.readyState === 'complete' && typeof state === 'object'")
        browser.ask("HTMLVideoElement.prototype.requestVideoFrameCallback = () => 0")  # as in a tab that is hidden
        click(browser, "#agree")
        browser.wait("trial")
        browser.key(" ")
        assert browser.wait("trial.whole && !trial.busy", 20) and browser.ask("trial.apart") is None


@needs_browser
def test_a_phone_is_refused_where_the_test_says_so(folder: Path, browser: Browser) -> None:
    size(browser, True)
    with Server(ViewingDesk(folder).page()) as server:
        browser.call("Page.navigate", url=server.url)
        browser.wait("document.readyState === 'complete' && typeof state === 'object'")
        assert browser.ask("document.getElementById('agree').disabled")
        assert "larger screen" in browser.ask("document.getElementById('refusal').textContent")
    size(browser, False)


@needs_browser
@pytest.mark.slow
def test_the_headphone_check_counts_what_is_heard(browser: Browser, tmp_path: Path) -> None:
    size(browser, False)
    made = design("single", headphones=True, screen=False, practice=0, checks=0, sentences=1, per_viewer=1, each="once")
    test = write_test(tmp_path, sheet_of(made))
    with Server(ViewingDesk(test).page()) as server:
        browser.call("Page.navigate", url=server.url)
        browser.wait("document.readyState === 'complete' && typeof state === 'object'")
        browser.ask("""window.played = 0; window.real = tones;
            tones = order => played++ ? Promise.resolve() : real(order)""")  # once is enough
        sections = through(browser)
        browser.wait("state.sent")
        tones = browser.ask("state.device.tones")
    assert sections.count("headphones") == 6 and 0 <= tones <= 6
    assert next(iter(receive(Sheet.open(test), answer_files(test / "answers")).answers.values())).device.tones == tones


def test_the_server_gives_lists_and_takes_answers_of_its_page_alone(folder: Path) -> None:
    desk = ViewingDesk(folder)
    sheet = desk.sheet
    with Server(desk.page(), names=["study.example.org"]) as server:
        def ask(path: str, value: Any = None, **headers: str) -> tuple[int, Any]:
            data = None if value is None else value if isinstance(value, bytes) else json.dumps(value).encode()
            request = urllib.request.Request(server.url + path, data, {"Content-Type": "application/json", **headers})
            try:
                with urllib.request.urlopen(request, timeout=10) as answer:
                    body = answer.read()
                    return answer.status, json.loads(body) if body[:1] == b"{" else body
            except urllib.error.HTTPError as error:
                with error:
                    return error.code, json.load(error)

        stimulus = sheet.stimuli[0].id
        assert ask("test.js")[1].startswith(b"const TEST = {") and ask(f"stimuli/{stimulus}.mp4")[1][4:8] == b"ftyp"
        for path in ("stimuli/..%2F..%2Fkey.json", "stimuli/key.json", f"stimuli/{stimulus}"):
            assert ask(path)[0] == 400
        assert ask("key.json")[0] == ask("answers/x.json")[0] == 404
        lists = [ask("place", {"viewer": f"{n:032x}"})[1]["list"] for n in range(5)]
        assert sorted(lists[:2]) == [0, 1] and lists[0] == ask("place", {"viewer": f"{0:032x}"})[1]["list"]
        assert max(map(lists.count, lists)) - min(map(lists.count, lists)) <= 1
        for bad in ({"viewer": "../x"}, {"viewer": 3}, {}, [], "x", {"viewer": "a" * 32, "more": 1}):
            assert ask("place", bad)[0] == 400
        good = plain(simulated(sheet, 77, {"good": 1.0, "bad": 0.0}))
        assert ask("answers", {**good, "rows": good["rows"][:1]})[0] == ask("answers", b"{")[0] == 400
        assert ask("answers", b'{"a": "' + b"x" * 2_000_000 + b'"}')[0] == 413
        name = f"{good['viewer']}.json"
        assert ask("answers", good, Host="evil.example")[0] == 403
        assert ask("answers", good, Origin="https://evil.example")[0] == 403
        assert list((folder / "answers").iterdir()) == []
        proxied = {"Host": "study.example.org", "Origin": "https://study.example.org"}
        assert ask("answers", good, **proxied) == (200, {"taken": name}) == ask("answers", good)
        assert "another answer" in ask("answers", {**good, "comment": "more"})[1]["error"]
        (folder / "answers" / name).write_text("{")
        status, said = ask("answers", good)
        assert status == 400 and "another answer" in said["error"] and str(folder) not in said["error"]
        files.write_json(folder / "answers" / name, good)
    assert ViewingDesk(folder).count == 1
    (folder / "answers" / name).unlink()


def test_so_many_answers_are_kept_and_no_more(folder: Path) -> None:
    desk = ViewingDesk(folder, most=2)
    sent = [plain(simulated(desk.sheet, n, {"good": 1.0, "bad": 0.0})) for n in range(3)]
    names = [desk.take(each) for each in sent[:2]]
    assert desk.take(sent[0]) == names[0]  # which is kept already
    for again in (desk, ViewingDesk(folder, most=2)):
        with pytest.raises(DnnvssError, match="takes no more answers"):
            again.take(sent[2])
    assert sorted(p.name for p in (folder / "answers").iterdir()) == sorted(names)
    for name in names:
        (folder / "answers" / name).unlink()


def test_a_full_disk_keeps_no_answer_and_tells_the_viewer_no_path(
    folder: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    desk = ViewingDesk(folder)
    sent = plain(simulated(desk.sheet, 1, {"good": 1.0, "bad": 0.0}))

    def full(path: Path, value: Any) -> None:
        raise DnnvssError("cannot be written (No space left on device)", file=path)

    with monkeypatch.context() as disk:
        disk.setattr(files, "write_json", full)
        with pytest.raises(DnnvssError, match=r"cannot be kept here now.*Save them as a file") as told:
            desk.take(sent)
    assert str(folder) not in str(told.value) and "No space left" in caplog.text and desk.count == 0
    (folder / "answers" / desk.take(sent)).unlink()  # sent again


def test_all_addresses_need_the_name_that_viewers_open(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("viewing", "serve", folder, "--host", "0.0.0.0", "--port", "0") == 2
    assert "--name 192.168.0.7:8767" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["answers", "page"])
def test_a_test_whose_folders_are_links_elsewhere_is_refused(name: str, folder: Path, tmp_path: Path) -> None:
    test, elsewhere = tmp_path / "test", tmp_path / "elsewhere"
    shutil.copytree(folder, test)
    (test / name).replace(elsewhere) if (test / name).exists() else elsewhere.mkdir()
    (test / name).symlink_to(elsewhere)
    with pytest.raises(DnnvssError, match="leads out of the folder"):
        ViewingDesk(test)
    assert name == "page" or list(elsewhere.iterdir()) == []


def test_a_test_without_its_stimuli_is_not_served(folder: Path, tmp_path: Path) -> None:
    sheet = Sheet.open(folder)
    sheet.save(tmp_path)
    with pytest.raises(DnnvssError, match=f"{len(sheet.stimuli)} of {len(sheet.stimuli)} stimuli are missing"):
        ViewingDesk(tmp_path)


def test_a_damaged_key_is_refused_in_one_line(folder: Path, tmp_path: Path) -> None:
    key = json.loads((folder / "key.json").read_text())
    changes: list[dict[str, Any]] = [
        {"design": {"kind": "evil"}}, {"trials": []}, {"lists": [[10 ** 9]]}, {"lists": []}, {"conditions": []},
        {"stimuli": [{**key["stimuli"][0], "sentence": 99}]}, {"words": ["x"]}, {"more": 1},
        {"trials": [{**t, "stimuli": ["../../secret"]} for t in key["trials"]]}]
    for change in changes:
        (tmp_path / "key.json").write_text(json.dumps({**key, **change}))
        with pytest.raises(DnnvssError, match=r"key\.json"):
            ViewingDesk(tmp_path)


def _asked() -> tuple[Any, ...]:
    from dnnvss.evaluation.viewing.design import Question

    return Question("Do you wear glasses?", ("Yes", "No")), Question("Which is your first language?")
