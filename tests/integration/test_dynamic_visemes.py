"""Dynamic visemes through the whole row: learnt, predicted, tested from either source, spoken, and overridden."""

import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from conftest import composed
from omegaconf import DictConfig

from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.commands.speak import synthesise
from dnnvss.commands.train import train
from dnnvss.evaluation.picture_book import draw_units
from dnnvss.evaluation.runs import read_run
from dnnvss.formats import read_alignment, write_alignment
from dnnvss.runs.run import Run
from dnnvss.timing import Tier

FAST = ["model=feedforward", "trainer.epochs=2",
        "trainer.progress=false", "trainer.figure_every=0", "trainer.accelerator=cpu", "jobs=1",
        "model.network.hidden=[32]", "aam.modes=8", "sample=false", "visemes.units=12", "visemes.least=3",
        "visemes.samples=2", "visemes.predictor.folds=2", "visemes.predictor.hidden=[32]"]


def configure(name: str, *overrides: str) -> DictConfig:
    return composed(name, *overrides)


@pytest.fixture(scope="module")
def home(encoded: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small prepared corpus and a finished run with dynamic visemes."""
    home = tmp_path_factory.mktemp("visemes")
    shutil.copytree(encoded, home / "demo")
    train(configure("train", f"corpus.out={home}/demo", f"run={home}/run", "labels=ph_dv", *FAST))
    return home


def test_page_of_results_tells_the_sources_apart(home: Path) -> None:
    page = (home / "run" / "metrics.md").read_text()
    assert "dynamic visemes predicted from text" in page.splitlines()[0]
    systems = files.read_json(home / "run" / "metrics.json")["systems"]
    oracle = "model, dynamic visemes cut from the test video (oracle)"
    assert {"model", oracle} <= set(systems) and systems["model"] != systems[oracle]
    assert set(read_run(home / "run").styled) == {"articulated", "oracle"}
    units = files.read_json(home / "run" / "units.json")
    assert units["source"] == "predicted" and 0 < units["predicted"]["frames"] < 1


def test_units_come_from_training_clips_and_test_clips_are_predicted_without_their_video(home: Path) -> None:
    run = Run.open(home / "run")
    assert run.units is not None and 2 <= len(run.units.visemes) <= 12
    kept = files.read_json(next((home / "demo" / "visemes").glob("*/tiers.json")))
    assert {len(t["predicted"]) for t in kept.values()} == {1, 3}  # the best; in tests two more


def test_text_gets_predicted_units_and_an_alignment_overrides_them(home: Path) -> None:
    def speak(out: str, *what: str) -> np.ndarray:
        synthesise(configure("synth", f"run={home}/run", f"out={home}/{out}.mp4", "speech=none", "style=plain", *what))
        return read_arrays(home / f"{out}.npz")["parameters"]

    speak("a", "text='my papa may buy a puppy'")
    assert files.read_json(home / "a.json")["visemes"] == "predicted from text"
    alignment = read_alignment(home / "a.TextGrid")
    tier = alignment["visemes"]
    same = speak("b", f"alignment={home}/a.TextGrid")
    assert files.read_json(home / "b.json")["visemes"] == "given with the alignment"
    write_alignment(home / "given.TextGrid", alignment.with_tier(Tier("visemes", [(tier.start, tier.end, "1")])))
    other = speak("c", f"alignment={home}/given.TextGrid")
    assert np.abs(same - other).max() > 1e-3 * np.abs(same).max()
    assert read_alignment(home / "c.TextGrid")["visemes"].labels == ("1",)


def test_picture_book_has_a_strip_for_each_unit(home: Path, tmp_path: Path) -> None:
    run = Run.open(home / "run")
    assert run.units is not None
    few = draw_units(tmp_path / "few.png", run.units.visemes, run.face, pictures=2, across=3)
    picture = cv2.imread(str(few))
    rows = -(-len(run.units.visemes) // 3)
    assert picture.shape[0] % rows == 0 and picture.shape[1] % 3 == 0 and picture.std() > 10
