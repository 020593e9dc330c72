"""A talker who learns from a run of another: trained, told, moved to where that run is not, and bundled."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from conftest import composed

from data_prep.demo import prepare_demo
from dnnvss import files
from dnnvss.commands.train import train
from dnnvss.runs.bundling import write_bundle
from dnnvss.runs.run import Run
from dnnvss.synthesis.request import SpeakRequest
from dnnvss.synthesis.speak import speak

QUICK = ["trainer.progress=false", "aam.modes=6", "jobs=1", "sample=false", "folds=0"]
FEW = [f"~model.candidates.{name}" for name in ("codebook", "hsmm", "ensemble", "guided")]


def trained(run: Path, corpus: Path, *given: str) -> Path:
    train(composed("train", f"corpus.out={corpus}", f"run={run}", *QUICK, *given))
    return run


@pytest.mark.slow
def test_a_talker_of_few_sentences_learns_from_another(demo: Path, tmp_path: Path,
                                                       capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(demo, tmp_path / "first")
    prepare_demo(tmp_path / "second", sentences=6, size=96, seed=5, jobs=1)
    source = trained(tmp_path / "runs" / "source", tmp_path / "first", "model=kernel")
    own = trained(tmp_path / "runs" / "own", tmp_path / "second", f"knowledge={source}", *FEW)
    told = capsys.readouterr().out
    assert "model=auto tries adapted" in told
    assert "adapted" in files.read_json(own / "choice.json")["trials"]
    learnt = trained(tmp_path / "runs" / "learnt", tmp_path / "second", f"knowledge={source}", "model=adapted")
    assert "of speech, and on what runs of demo had learnt." in capsys.readouterr().out
    theirs, voice = Run.open(source).voice, Run.open(learnt).voice
    assert set(voice.phones) >= set(theirs.phones) and voice.borrowed
    request = SpeakRequest("pack my box", engine="none")
    before = speak(Run.open(learnt), request)
    shutil.rmtree(source)
    moved = Path(shutil.move(learnt, tmp_path / "elsewhere"))
    for run in (Run.open(moved), Run.open(write_bundle(Run.open(moved), tmp_path / "bundle"))):
        np.testing.assert_array_equal(speak(run, request).trajectory, before.trajectory)
