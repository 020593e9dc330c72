"""What is loaded before it is used: nothing that takes long."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from conftest import CLOCK, TABLE

from dnnvss.systems import Example
from dnnvss.systems.registry import make_system
from dnnvss.training.arrays import save_arrays

SLOW = ("torch", "lightning", "hydra", "sklearn", "tensorboard", "nltk", "g2p_en", "joblib", "matplotlib", "aiohttp",
        "pocketsphinx", "onnx", "onnxruntime", "praatio", "HanTa", "scipy.interpolate", "scipy.ndimage", "scipy.signal",
        "scipy.optimize", "scipy.spatial", "scipy.fft", "scipy.stats", "scipy.io", "dnnvss.face.mesh", "dnnvss.studio",
        "dnnvss.training.module", "dnnvss.speech.align", "dnnvss.acoustics.transcriber")

PLAIN: dict[str, dict[str, object]] = {
    "kernel": {}, "codebook": {}, "hsmm": {}, "fragments": {}, "ensemble": {"systems": {"kernel": {}, "codebook": {}}},
    "segments": {"guide": {"system": "kernel"}},
    "guided": {"network": {"kind": "feedforward", "hidden": [8]},
               "fit": {"epochs": 2, "progress": False, "figure_every": 0, "accelerator": "cpu"}},
    "phone_mean": {}, "training_mean": {}}
"""Systems that speak without torch, and settings of theirs."""


def loaded(program: str) -> set[str]:
    told = f"{program}\nimport sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", told], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


@pytest.mark.parametrize("module", ["dnnvss.commands.speak", "dnnvss.export.exported", "dnnvss.curves"])
def test_nothing_slow_is_imported_before_it_is_used(module: str) -> None:
    assert not loaded(f"import {module}") & set(SLOW)


def test_systems_are_opened_without_torch(
        examples: dict[str, list[Example]], tmp_path: Path) -> None:
    """Made from plain settings, with what they learnt out of a file of theirs, as a run is opened."""
    for name, settings in PLAIN.items():
        model = make_system(name, settings, TABLE, CLOCK)
        model.fit(examples["val"], examples["val"], tmp_path)
        save_arrays(tmp_path / f"{name}.npz", model.state())
    assert not loaded(f"""
from pathlib import Path
from dnnvss.features import FeatureTable
from dnnvss.systems.registry import make_system
from dnnvss.timing import FrameClock
from dnnvss.training.learnt import read_learnt
table = FeatureTable({TABLE.names!r})
for name, settings in {PLAIN!r}.items():
    model = make_system(name, settings, table, FrameClock({str(CLOCK.rate)!r}))
    model.load_state(read_learnt(Path({str(tmp_path)!r}) / f"{{name}}.npz"))
""") & {"torch", "lightning", "sklearn"}


def test_the_list_names_what_there_is() -> None:
    ours = {name for name in SLOW if name.startswith(("dnnvss", "scipy"))}
    assert all(map(find_spec, ours))
