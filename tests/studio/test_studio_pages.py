"""Every page of the studio in a real browser: narrow and wide, light and dark, by keyboard, as axe-core judges it."""

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from browser import CHROMIUM, Browser, open_browser
from studio.house import furnish

from dnnvss.commands.studio import styles
from dnnvss.studio.areas import with_areas
from dnnvss.studio.server import Server
from dnnvss.studio.speaking import SpeakingDesk

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not CHROMIUM, reason="needs the program chromium")]
_WATCH = """window.refused = [];
    addEventListener('securitypolicyviolation', e => refused.push(e.violatedDirective + ' ' + e.blockedURI));
    addEventListener('error', e => refused.push(e.message));
    addEventListener('unhandledrejection', e => refused.push(String(e.reason)));"""
NET = "feedforward"
VIEWS = {
    "": "document.getElementById('run')?.options.length",
    "footage/": "document.querySelectorAll('#items .item').length === 2",
    "footage/#demo/report.md": "document.querySelector('#shown table')",
    "footage/look/look.html": "document.querySelector('.recording')",
    "labelling/": "document.querySelector('#items a')",
    "labelling/labels/": "document.querySelector('#points circle')",
    "heads/": "document.querySelector('#items .item')",
    "training/": "document.querySelector('#items a')",
    "training/#NET/fits": "document.querySelector('.chart polyline') && document.querySelector('img')?.complete",
    "results/": "document.querySelector('#items a')",
    "results/#NET/metrics.md": "document.querySelector('#shown table')",
    "results/#NET/sample.mp4": "document.querySelector('#shown video')?.readyState > 1",
    "results/NET/verdict.html": "document.querySelector('.read li')",
    "results/NET/evaluation/evaluation.html": "document.querySelectorAll('canvas').length > 2",
    "viewing/": "document.querySelectorAll('#items a').length === 2",
    "viewing/viewing/": "!document.getElementById('welcome').hidden",
    "viewing/viewing/viewing.html": "document.querySelector('svg')",
}
"""Every page as its own document, and when it is there; NET is the run of a network."""


@dataclass(frozen=True)
class Studio:
    """A studio with everything in it."""

    url: str
    net: str

    def at(self, view: str) -> str:
        """The address of a view."""
        return self.url + view.replace("NET", self.net)


@pytest.fixture(scope="module")
def studio(demo: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Studio]:
    house = furnish(tmp_path_factory.mktemp("house"), demo)
    net = next(path.name for path in (house / "runs").iterdir() if NET in path.name)
    desk = SpeakingDesk(house / "runs", styles())
    folders = [house / name for name in ("data", "labels", "viewing")]
    with Server(with_areas(desk.page(), house / "runs", folders)) as server:
        yield Studio(server.url, net)
    desk.close()


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with open_browser(tmp_path_factory.mktemp("profile")) as opened:
        opened.call("Page.addScriptToEvaluateOnNewDocument", source=_WATCH)
        opened.call("Network.enable")
        yield opened


def look(browser: Browser, width: int, scheme: str) -> None:
    browser.call("Emulation.setDeviceMetricsOverride", width=width, height=740, deviceScaleFactor=1, mobile=width < 500)
    browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])


def visit(browser: Browser, url: str, there: str = "true") -> None:
    """Go to an address, also where only what stands behind # differs."""
    browser.call("Page.navigate", url="about:blank")
    browser.wait("location.href === 'about:blank' && document.readyState === 'complete'")
    browser.call("Page.navigate", url=url)
    browser.wait(f"document.readyState === 'complete' && location.href !== 'about:blank' && Boolean({there})")


@cache
def axe() -> str:
    """The source of axe-core, where npm or DNNVSS_NODE_MODULES has it."""
    npm = shutil.which("npm")
    own = subprocess.run([npm, "root", "-g"], capture_output=True, text=True, check=False).stdout.strip() if npm else ""
    for root in (os.environ.get("DNNVSS_NODE_MODULES", ""), own):
        if root and (file := Path(root) / "axe-core" / "axe.min.js").is_file():
            return file.read_text("utf-8")
    return ""


def judged(browser: Browser) -> list[Any]:
    """What axe-core finds serious or worse in the page."""
    browser.ask(f"{axe()};1")
    told = browser.ask("axe.run(document, {resultTypes: ['violations']}).then(r => JSON.stringify(r.violations"
                       ".filter(v => ['serious', 'critical'].includes(v.impact))"
                       ".map(v => [v.id, v.nodes.slice(0, 3).map(n => n.html.slice(0, 200))])))")
    return list(json.loads(told))


@pytest.mark.parametrize("view", VIEWS)
def test_every_page_fits_a_narrow_window_and_asks_no_other_host(browser: Browser, studio: Studio, view: str) -> None:
    look(browser, 1366, "light")
    browser.asked.clear()
    visit(browser, studio.at(view), VIEWS[view])
    assert browser.ask("document.documentElement.scrollWidth") <= 1366
    light = browser.ask("getComputedStyle(document.body).backgroundColor")
    if axe():
        assert judged(browser) == []
    look(browser, 360, "dark")
    browser.wait("innerWidth === 360")
    assert browser.ask("document.documentElement.scrollWidth") <= 360
    assert browser.ask("[...document.querySelectorAll('#commands button')].every(each => each.offsetHeight < 40)")
    if not view.startswith("viewing/viewing/") or "html" in view:  # the test itself has greys of its own
        assert browser.ask("getComputedStyle(document.body).backgroundColor") != light
    if axe():
        assert judged(browser) == []
    assert browser.ask("refused") == []
    strangers = [url for url in browser.asked if not url.startswith((studio.url, "data:", "about:", "blob:"))]
    assert strangers == [] and browser.asked


def test_axe_core_was_there() -> None:
    if not axe():
        pytest.skip("axe-core is not installed: npm i -g axe-core, or DNNVSS_NODE_MODULES=the folder it is in")


def focused(browser: Browser) -> str:
    return str(browser.ask("(document.activeElement.ariaLabel || document.activeElement.textContent || "
                           "document.activeElement.id).trim().slice(0, 80)"))


def tab_to(browser: Browser, named: str) -> None:
    """Press Tab until what has the focus is named so."""
    for _ in range(60):
        browser.press("Tab")
        if focused(browser).startswith(named):
            assert browser.ask("document.activeElement.matches(':focus-visible')")
            return
    raise AssertionError(f"the keyboard never came to {named}")


@pytest.mark.parametrize(("area", "link", "reached"), [
    ("Footage", "First look", "frames[0].document.querySelector('.recording')"),
    ("Labelling", "Drag the points", "frames[0].document.querySelector('#points circle')"),
    ("Training", "Curves", "document.querySelector('#shown p strong')"),
    ("Results", "Verdict", "frames[0].document.querySelector('.read li')"),
    ("Viewing tests", "Result:", "frames[0].document.querySelector('svg')")])
def test_the_keyboard_goes_from_page_to_page_and_back(browser: Browser, studio: Studio, area: str, link: str,
                                                      reached: str) -> None:
    look(browser, 1366, "light")
    visit(browser, studio.url, "document.querySelectorAll('#areas a').length > 5")
    tab_to(browser, area)
    browser.press("Enter")
    browser.wait("location.pathname !== '/' && !!document.querySelector('#items .item a')")
    tab_to(browser, link)
    browser.press("Enter")
    browser.wait(f"!document.getElementById('view').hidden && Boolean({reached})")
    browser.ask("document.getElementById('view').focus()")
    tab_to(browser, "Back to the list")
    browser.press("Enter")
    browser.wait("!document.getElementById('list').hidden && !!document.querySelector('#items .item a')")


def test_points_are_dragged_by_keys_alone(browser: Browser, studio: Studio) -> None:
    visit(browser, studio.at("labelling/labels/"), VIEWS["labelling/labels/"])
    place = "document.getElementById('chosen').textContent"
    browser.key(".")
    browser.wait(f"{place}.includes('lips_outer 0')")
    before = browser.ask(place)
    browser.key("ArrowRight")
    browser.wait(f"{place} !== {json.dumps(before)}")
    browser.key("z")
    browser.wait(f"{place} === {json.dumps(before)}")


def test_faces_of_a_comparison_move_under_the_policy(browser: Browser, studio: Studio) -> None:
    view = "results/NET/evaluation/evaluation.html"
    visit(browser, studio.at(view), "document.querySelector('.sentence button')")
    browser.ask("document.querySelector('details[open] .sentence button').click()")
    browser.wait("parseFloat(document.querySelector('details[open] .sentence output').textContent) > 0")
    browser.wait("[...document.querySelectorAll('video')].every(v => v.readyState > 0)")


def test_a_fit_that_goes_on_is_followed(browser: Browser, studio: Studio) -> None:
    visit(browser, studio.at("training/#NET/fits"), VIEWS["training/#NET/fits"])
    assert "2 of at most 2 epochs" in browser.ask("document.getElementById('shown').textContent")
    browser.ask("document.querySelector('.pictures input').focus()")
    browser.press("ArrowLeft")
    browser.wait("document.querySelector('.pictures output').textContent === '1'")
