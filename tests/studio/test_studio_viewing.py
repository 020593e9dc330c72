"""The page of viewing tests in a real browser: every design to its end, on a desktop and a phone, with a reload."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browser import CHROMIUM, Browser, open_browser
from viewing_cases import design, sheet_of, write_test

from dnnvss.evaluation.viewing.answers import answer_files, receive
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


def _asked() -> tuple[Any, ...]:
    from dnnvss.evaluation.viewing.design import Question

    return Question("Do you wear glasses?", ("Yes", "No")), Question("Which is your first language?")
