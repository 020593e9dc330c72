"""Several talkers in one training, from the command line: runs of each, killed and resumed, spoken with, swept over."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from conftest import run_command

from data_prep.demo import prepare_demo
from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.corpus import Corpus
from dnnvss.runs.bundling import write_bundle
from dnnvss.runs.files import RunFiles
from dnnvss.runs.run import Run
from dnnvss.runs.talkers import TalkersIndex, talker_run
from dnnvss.synthesis.request import SpeakRequest
from dnnvss.synthesis.speak import speak

QUICK = ["model=feedforward", "model.network.hidden=[24]", "trainer.epochs=3", "trainer.progress=false", "aam=demo",
         "trainer.accelerator=cpu", "trainer.precision=32-true", "aam.modes=6", "jobs=1", "sample=false"]


@pytest.fixture(scope="module")
def home(demo: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two talkers, one of six sentences without some sounds, and a training of both."""
    home = tmp_path_factory.mktemp("together")
    shutil.copytree(demo, home / "ann")
    prepare_demo(home / "bob", sentences=6, size=96, seed=5, jobs=1)
    assert train(home, f"runs={home}/runs") == 0
    return home


def train(home: Path, *given: str) -> int:
    return run_command("train", f"corpus=[{home}/ann,{home}/bob]", *QUICK, *given)


def folder(runs: Path) -> Path:
    (found,) = [path.parent for path in runs.glob("*/talkers.json")]
    return found


@pytest.mark.slow
def test_each_talker_has_a_run_like_any_other(home: Path, tmp_path: Path) -> None:
    both = folder(home / "runs")
    assert both.name.startswith("ann+bob-ph_class-feedforward-") and not (both / "parts").exists()
    for name, other in (("ann", "bob"), ("bob", "ann")):
        run = Run.open(talker_run(both, name))
        assert files.read_json(RunFiles(run.folder).provenance)["heard_with"] == [other]
        assert f"together with {other}." in (run.folder / "metrics.md").read_text()
        every = {u.id for kind in ("train", "val", "test") for u in Corpus.open(home / name).split(kind)}
        assert read_arrays(RunFiles(run.folder).prediction("predicted"), "").keys() == every  # left out in turn
        before = speak(run, SpeakRequest("pack my box", engine="none")).trajectory
        assert before.shape[1] == len(run.face.names)
        bundle = write_bundle(run, tmp_path / name, "model.npz")
        after = speak(Run.open(bundle), SpeakRequest("pack my box", engine="none")).trajectory
        np.testing.assert_array_equal(before, after)
    bob, ann = (Run.open(talker_run(both, name)).voice for name in ("bob", "ann"))
    assert set(bob.phones) == set(ann.phones)


@pytest.mark.slow
def test_a_training_that_was_killed_ends_as_one_that_was_not(home: Path, tmp_path: Path,
                                                             monkeypatch: pytest.MonkeyPatch) -> None:
    import dnnvss.runs.together as together

    fit, calls = together.TogetherFit._fit, []

    def killed(*given: object) -> object:
        calls.append(1)
        if len(calls) == 3:  # the second part is being fitted
            raise KeyboardInterrupt
        return fit(*given)  # type: ignore[arg-type]

    with monkeypatch.context() as patched:
        patched.setattr(together.TogetherFit, "_fit", killed)
        assert train(home, f"run={tmp_path}/both") == 130
    assert (tmp_path / "both" / "parts" / "1").is_dir()
    assert train(home, f"run={tmp_path}/both") == 0
    whole, again = folder(home / "runs"), tmp_path / "both"
    assert TalkersIndex.load(whole) == TalkersIndex.load(again)
    for name in ("ann", "bob"):
        own, other = (read_arrays(RunFiles(talker_run(f, name)).prediction("predicted"), "") for f in (whole, again))
        for sentence, values in own.items():
            np.testing.assert_array_equal(other[sentence], values)
    assert train(home, f"run={tmp_path}/both", "seed=2") == 1
    assert train(home, f"run={tmp_path}/both") == 0  # which only reports


@pytest.mark.slow
def test_a_talker_speaks_by_name_and_a_sweep_makes_a_table_of_each(home: Path, tmp_path: Path,
                                                                   capsys: pytest.CaptureFixture[str],
                                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    both = folder(home / "runs")
    out = ["text=hello", f"out={tmp_path}/hello.mp4", "speech=none"]
    assert run_command("speak", f"run={both}", "talker=bob", *out) == 0
    assert "of bob" in capsys.readouterr().out
    assert run_command("speak", f"runs={home}/runs", "talker=ann", *out) == 0
    assert run_command("speak", f"run={both}", *out) == 1 and "Add talker=NAME" in capsys.readouterr().err
    assert run_command("speak", f"run={both}", "talker=eve", *out) == 1 and "one of ann, bob" in capsys.readouterr().err
    monkeypatch.chdir(tmp_path)
    assert train(home, "-m", f"runs={tmp_path}/swept", "folds=0", "labels=ph,ph_a") == 0
    for name in ("ann", "bob"):
        assert "labels=ph_a" in (tmp_path / "swept" / f"sweep-{name}" / "evaluation.md").read_text()
