"""Sweeps that share their work out and resume, and bundles that speak without what training needs."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT, composed, run_command
from omegaconf import DictConfig

from data_prep.demo import prepare_demo
from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.commands.speak import synthesise
from dnnvss.commands.train import train
from dnnvss.media import video_info
from dnnvss.runs.run import Run

FAST = ["model=feedforward", "labels=ph", "folds=0", "debug=default", "aam.modes=8", "jobs=1",
        "trainer.accelerator=cpu"]
SIZES = ([8], [16], [8, 8], [16, 16])


def configure(name: str, *overrides: str) -> DictConfig:
    return composed(name, *overrides)


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small prepared corpus, a finished run of one size and one of another that was cut short."""
    home = tmp_path_factory.mktemp("scale")
    prepare_demo(home / "demo", sentences=8, size=64, jobs=1)
    for hidden in SIZES[:2]:
        train(configure("train", f"corpus.out={home}/demo", f"runs={home}/runs", f"model.network.hidden={hidden}",
                        *FAST))
    for path in (home / "runs").glob("*/metrics.json"):
        if Run.open(path.parent).settings.model["network"]["hidden"] == SIZES[1]:
            path.unlink()
    return home


@pytest.mark.slow
def test_a_sweep_resumes_and_ends_with_a_heat_map(home: Path, tmp_path: Path) -> None:
    finished = next((home / "runs").glob("*/metrics.json"))
    before = finished.stat().st_mtime_ns
    sizes = ",".join(str(s).replace(" ", "") for s in SIZES)
    done = subprocess.run(
        [sys.executable, ROOT / "train.py", "-m", "+experiment=table4", f"model.network.hidden={sizes}", *FAST,
         f"corpus.out={home}/demo", f"runs={home}/runs"],
        capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr
    assert finished.stat().st_mtime_ns == before  # was only reported
    out = home / "runs" / "table4-demo"
    kept = files.read_json(out / "sizes.json")
    assert [[k["width"]] * k["layers"] for k in kept] == [[8], [16], [8, 8], [16, 16]]
    by_size = {str(k["layers"]) + str(k["width"]): k["correlation"] for k in kept}
    assert by_size["18"] == files.read_json(finished)["systems"]["model"]["regions"]["speech"]["correlation"]["mean"]
    assert len(list((home / "runs").glob("*/metrics.json"))) == 4
    assert (out / "sizes.png").stat().st_size > 5000 and "hidden=[16,16]" in (out / "evaluation.md").read_text()
    assert not list(tmp_path.glob(".sweep-*"))  # the notes of the jobs are gone


@pytest.mark.slow
def test_a_run_that_fails_does_not_end_the_sweep(home: Path, tmp_path: Path) -> None:
    sizes = ",".join(str(s).replace(" ", "") for s in (SIZES[0], [8, -1], SIZES[2]))
    done = subprocess.run(
        [sys.executable, ROOT / "train.py", "-m", "+experiment=table4", f"model.network.hidden={sizes}", *FAST,
         f"corpus.out={home}/demo", f"runs={home}/runs"],
        capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 1 and "the sweep goes on without this run" in done.stderr
    assert "1 run(s) of the sweep failed" in done.stderr and "[8,-1]" in done.stderr
    newest = max((home / "runs").glob("table4-demo*/sizes.json"), key=lambda p: p.stat().st_mtime_ns)
    assert len(files.read_json(newest)) == 2
    assert not list(tmp_path.glob(".sweep-*"))


@pytest.mark.slow
def test_a_bundle_speaks_as_its_run_does_without_torch_or_hydra(home: Path, tmp_path: Path) -> None:
    pytest.importorskip("onnxscript", reason="the extra `export` is not installed")
    run = next((home / "runs").glob("*/metrics.json")).parent
    assert run_command("export", str(run), "--out", str(tmp_path / "bundle")) == 0
    text, where = "text=Hello, my friend: I am here", f"out={tmp_path}/a.mp4"
    told = "print('LOADED', *sorted({'torch', 'lightning', 'hydra', 'sklearn', 'nltk'} & set(sys.modules)))"
    program = (f"import atexit, runpy, sys; sys.argv = sys.argv[1:]; atexit.register(lambda: {told}); "
               "runpy.run_path(sys.argv[0], run_name='__main__')")
    done = subprocess.run([sys.executable, "-c", program, ROOT / "synth.py", f"run={tmp_path}/bundle", text, where,
                           "speech=none"], capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "LOADED"
    synthesise(configure("synth", f"run={run}", "text='Hello, my friend: I am here'", f"out={tmp_path}/b.mp4",
                         "speech=none"))
    ours, theirs = (read_arrays(tmp_path / f"{n}.npz")["parameters"] for n in "ab")
    np.testing.assert_allclose(ours, theirs, atol=1e-5 * np.abs(theirs).max())
    assert video_info(tmp_path / "a.mp4").size == (64, 64)
