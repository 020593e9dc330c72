"""What is loaded before it is used: nothing that takes long."""

import subprocess
import sys
from importlib.util import find_spec

import pytest

SLOW = ("torch", "lightning", "hydra", "sklearn", "tensorboard", "nltk", "g2p_en", "joblib", "matplotlib", "aiohttp",
        "pocketsphinx", "onnx", "onnxruntime", "praatio", "HanTa", "scipy.interpolate", "scipy.ndimage", "scipy.signal",
        "scipy.optimize", "scipy.spatial", "scipy.fft", "scipy.stats", "scipy.io", "dnnvss.face.mesh", "dnnvss.studio",
        "dnnvss.training.module", "dnnvss.speech.align", "dnnvss.acoustics.transcriber")


def loaded(program: str) -> set[str]:
    told = f"{program}; import sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


@pytest.mark.parametrize("module", ["dnnvss.commands.speak", "dnnvss.export.exported", "dnnvss.curves"])
def test_nothing_slow_is_imported_before_it_is_used(module: str) -> None:
    assert not loaded(f"import {module}") & set(SLOW)


def test_the_list_names_what_there_is() -> None:
    ours = {name for name in SLOW if name.startswith(("dnnvss", "scipy"))}
    assert all(map(find_spec, ours))
