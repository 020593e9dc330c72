"""A take that three.js plays in a browser: the weights that it shows are those of the take."""

import functools
import http.server
import os
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browser import CHROMIUM, open_browser

from dnnvss.export.take import Take, write_take
from dnnvss.face.mesh import packaged_head
from dnnvss.timing import FrameClock

pytestmark = pytest.mark.slow

PAGE = """<!doctype html><script type="importmap">{"imports": {"three": "/three/build/three.module.js"}}</script>
<script type="module">
import { AnimationMixer, Box3, Vector3 } from "three";
import { GLTFLoader } from "/three/examples/jsm/loaders/GLTFLoader.js";
new GLTFLoader().load("/take.glb", gltf => {
  const meshes = [];
  gltf.scene.traverse(o => { if (o.isMesh) meshes.push(o); });
  const mixer = new AnimationMixer(gltf.scene);
  mixer.clipAction(gltf.animations[0]).play();
  window.at = seconds => { mixer.setTime(seconds); const m = meshes[0];
    const named = Object.entries(m.morphTargetDictionary);
    return Object.fromEntries(named.map(([n, k]) => [n, m.morphTargetInfluences[k]])); };
  window.neck = () => gltf.scene.getObjectByName("neck").quaternion.toArray();
  window.size = () => new Box3().setFromObject(gltf.scene).getSize(new Vector3()).toArray();
  window.ready = meshes.length;
}, undefined, error => { window.failed = String(error); });
</script>"""


@pytest.fixture
def site(tmp_path: Path) -> Iterator[tuple[str, Take]]:
    """A page with three.js and a take beside it, and the take."""
    three = Path(os.environ.get("DNNVSS_NODE_MODULES", "")) / "three"
    if CHROMIUM is None or not (three / "build" / "three.module.js").is_file():
        pytest.skip("needs chromium, and DNNVSS_NODE_MODULES=a folder into which npm put three")
    (tmp_path / "three").symlink_to(three.resolve())
    (tmp_path / "index.html").write_text(PAGE)
    opened = 0.5 - 0.5 * np.cos(np.arange(50) / 6)
    curves = {"jawOpen": opened, "mouthPucker": opened[::-1], "HeadYaw": np.linspace(-0.4, 0.4, 50)}
    take = Take(curves, FrameClock(25), head=packaged_head())
    write_take(tmp_path / "take.glb", take)
    quiet = type("Quiet", (http.server.SimpleHTTPRequestHandler,), {"log_message": lambda *_: None})
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(quiet, directory=str(tmp_path)))
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/index.html", take
    server.shutdown()
    server.server_close()
    thread.join(10)


def test_three_plays_the_take(site: tuple[str, Take], tmp_path: Path) -> None:
    address, take = site
    with open_browser(tmp_path / "profile") as browser:
        browser.call("Page.navigate", url=address)
        assert browser.wait("window.failed || window.ready") != 0
        assert not browser.ask("window.failed || ''")
        for frame in (0, 7, 20, 41):
            shown = browser.ask(f"window.at({frame / 25})")
            assert set(shown) == set(packaged_head().names)
            assert shown["jawOpen"] == pytest.approx(take.curves["jawOpen"][frame], abs=1e-4)
            assert shown["mouthPucker"] == pytest.approx(take.curves["mouthPucker"][frame], abs=1e-4)
            assert shown["browInnerUp"] == 0
            half = -take.curves["HeadYaw"][frame] / 2
            assert browser.ask("window.neck()") == pytest.approx([0, np.sin(half), 0, np.cos(half)], abs=1e-4)
        size = browser.ask("window.size()")
        own = np.ptp(packaged_head().mesh.vertices, axis=0)
        assert (np.array(size) >= own - 1e-3).all() and (np.array(size) < 2 * own).all()
