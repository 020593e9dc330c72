"""How the studio's page keeps sound and picture together, and how soon it answers a hand.

``python benchmarks/studio_page.py RUNS [--workers 1] [--plays 5] [--moves 40]``: a real browser
(chromium) opens the page, plays ten words some times and drags the curve. In step: whenever the
page draws a picture, the sound that the audio device puts out at that moment (``getOutputTimestamp``, which the
page's own clock does not use) less the middle of the time that the picture stands for. Answer: from
the event of the pointer to the first picture of the changed speech; each move waits for that one.
"""

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from studio import TEN, Service, serving

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from browser import Browser, open_browser

STEP = 40.0
"""Milliseconds that sound and picture may be apart."""
ANSWER = 150.0
"""Milliseconds in which a dragged key is to be seen."""
_WATCH = """
window.drawn = []; window.begun = null; window.moved = []; window.first = [];
const start = AudioBufferSourceNode.prototype.start;
AudioBufferSourceNode.prototype.start = function (when = 0, offset = 0) {
  window.begun = {when: when || this.context.currentTime, offset, context: this.context};
  return start.call(this, when, offset);
};
const bitmap = window.createImageBitmap;
window.createImageBitmap = async blob => {
  const made = await bitmap(blob), hash = await crypto.subtle.digest('SHA-1', await blob.arrayBuffer());
  made.named = [...new Uint8Array(hash)].map(b => b.toString(16).padStart(2, '0')).join('');
  return made;
};
const draw = CanvasRenderingContext2D.prototype.drawImage;
CanvasRenderingContext2D.prototype.drawImage = function (picture, ...more) {
  const now = performance.now();
  if (picture.named && window.begun) {
    const out = window.begun.context.getOutputTimestamp();
    const sound = window.begun.offset + out.contextTime - window.begun.when + (now - out.performanceTime) / 1000;
    window.drawn.push([sound, picture.named]);
  }
  if (picture.named && picture !== window.latest) {
    window.latest = picture;
    if (window.moved.length > window.first.length) window.first.push(now);
  }
  return draw.call(this, picture, ...more);
};
"""


def opened(browser: Browser, service: Service) -> Any:
    """Open the page and say ten words; return the take."""
    browser.call("Page.addScriptToEvaluateOnNewDocument", source=_WATCH)
    browser.call("Emulation.setDeviceMetricsOverride", width=1366, height=900, deviceScaleFactor=1, mobile=False)
    browser.call("Page.navigate", url=f"http://127.0.0.1:{service.port}/")
    browser.wait("document.getElementById('run')?.options.length > 0")
    browser.ask(f"document.getElementById('text').value = {json.dumps(TEN)}")
    browser.ask("document.getElementById('speak').click()")
    browser.wait("document.body.dataset.whole && !document.getElementById('play').disabled")
    return json.loads(service.ask("GET", f"/v1/takes/{browser.ask('document.body.dataset.whole')}")[1])


def frames_of(service: Service, take: Any) -> dict[str, list[int]]:
    """The frames of a take by the SHA-1 of their pictures; still ones share theirs."""
    import hashlib

    named: dict[str, list[int]] = {}
    for first in range(0, take["frames"], 24):
        count = min(24, take["frames"] - first)
        data, at, k = service.ask("GET", f"/v1/takes/{take['id']}/pictures?first={first}&count={count}")[1], 0, first
        while at < len(data):
            length = int.from_bytes(data[at:at + 4], "little")
            named.setdefault(hashlib.sha1(data[at + 4:at + 4 + length]).hexdigest(), []).append(k)
            at, k = at + 4 + length, k + 1
    return named


def in_step(browser: Browser, service: Service, take: Any, plays: int) -> np.ndarray:
    """Milliseconds that the sound was ahead of each picture that was drawn while it played."""
    named, apart = frames_of(service, take), list[float]()
    for _ in range(plays):
        browser.ask("(b => b.textContent === 'Pause' && b.click())(document.getElementById('play'))")
        browser.ask("(() => { const t = document.getElementById('time'); t.value = 0; "
                    "t.dispatchEvent(new Event('input')); window.drawn = []; window.begun = null; })()")
        browser.ask("document.getElementById('play').click()")
        browser.wait("document.getElementById('play').textContent === 'Play' && drawn.length > 10")
        for sound, name in browser.ask("drawn"):
            if 0 < sound < take["seconds"] and name in named:
                middles = [(k + 0.5) / take["rate"] for k in named[name]]
                apart.append(1000 * min((sound - middle for middle in middles), key=abs))
    return np.array(apart)


def answers(browser: Browser, moves: int) -> np.ndarray:
    """Milliseconds from a move of the pointer that holds the curve to the first picture of it."""
    left, top, width, height = browser.ask(
        "(() => { const t = document.getElementById('timeline'); t.scrollIntoView({block: 'center'}); "
        "t.addEventListener('pointermove', e => moved.push(e.timeStamp), true); "
        "const r = t.getBoundingClientRect(); return [r.left, r.top, r.width, r.height]; })()")
    x = left + width / 2

    def mouse(kind: str, y: float, buttons: int) -> None:
        browser.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1)

    mouse("mousePressed", top + 0.85 * height, 1)
    time.sleep(1)
    browser.ask("(() => { moved = []; first = []; })()")
    for k in range(moves):
        mouse("mouseMoved", top + (0.5 + 0.3 * (k % 7) / 7) * height, 1)
        browser.wait("first.length === moved.length", 60)
        time.sleep(0.3)
    mouse("mouseReleased", top + 0.6 * height, 0)
    moved, first = browser.ask("moved"), browser.ask("first")
    return np.array([b - a for a, b in zip(moved, first, strict=False)])


def told(name: str, values: np.ndarray, most: float) -> str:
    """A line of figures."""
    far = np.abs(values)
    return (f"{name}: median {np.median(values):.0f} ms, 95 % within {np.percentile(far, 95):.0f} ms, at most "
            f"{far.max():.0f} ms, {np.mean(far <= most):.1%} within {most:.0f} ms, {len(values)} counted")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", type=Path)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--plays", type=int, default=5)
    parser.add_argument("--moves", type=int, default=40)
    options = parser.parse_args()
    with serving(options.runs, options.workers) as (service, _), \
            tempfile.TemporaryDirectory() as folder, \
            open_browser(Path(folder) / "profile") as browser:
        take = opened(browser, service)
        print(told("sound ahead of the picture", in_step(browser, service, take, options.plays), STEP), flush=True)
        print(told("a dragged key", answers(browser, options.moves), ANSWER))


if __name__ == "__main__":
    main()
