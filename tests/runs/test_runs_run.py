"""A run goes on under the settings that it was begun with, and says which split has nothing to learn from."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import ROOT
from hydra import compose, initialize_config_dir
from omegaconf import DictConfig, OmegaConf

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.runs.run import check_settings, run_name
from dnnvss.systems.examples import split_examples
from dnnvss.systems.units import UnitPlan


def configured(*settings: str) -> DictConfig:
    with initialize_config_dir(str(ROOT / "conf"), version_base="1.3"):
        return compose("train", list(settings))


def begun(folder: Path, *settings: str) -> Path:
    """Return a run folder as a killed run leaves it."""
    files.write_text(folder / "config.yaml", OmegaConf.to_yaml(configured(*settings), resolve=True))
    files.write_json(folder / "run.json", {"corpus": "abc"})
    return folder


def test_a_run_goes_on_under_its_own_settings_alone(tmp_path: Path) -> None:
    folder = begun(tmp_path, "trainer.epochs=3")
    check_settings(folder, configured("trainer.epochs=3", "trainer.progress=false", "jobs=2"), "abc")
    check_settings(tmp_path / "not there", configured(), "abc")
    with pytest.raises(DnnvssError, match=r"trainer\.epochs \(3, now 5\).*overwrite=true"):
        check_settings(folder, configured("trainer.epochs=5"), "abc")
    with pytest.raises(DnnvssError, match=r"corpus\.fingerprint \(abc, now xyz\)"):
        check_settings(folder, configured("trainer.epochs=3"), "xyz")
    with pytest.raises(DnnvssError, match=r"and \d+ more"):
        check_settings(folder, configured("model=hsmm"), "abc")


def test_what_makes_no_other_run_name_makes_no_other_run(tmp_path: Path) -> None:
    for settings in (["trainer.figure_every=1"], ["visemes.units=7"], ["trainer.refine_rate=0.5"]):
        assert run_name(configured(*settings), "abc") == run_name(configured(), "abc")
        check_settings(begun(tmp_path / settings[0]), configured(*settings), "abc")


def test_a_split_without_a_measured_frame_is_named(tmp_path: Path) -> None:
    splits = {"train": ["a"], "val": ["b", "c"], "test": ["d"]}
    corpus = SimpleNamespace(root=tmp_path, split=lambda name, _: [SimpleNamespace(id=i) for i in splits[name]])
    encoded = SimpleNamespace(dropped={"b": "dark"}, clip=lambda i: SimpleNamespace(valid=np.array([i != "c"])))
    task = SimpleNamespace(example=lambda *_: None)
    with pytest.raises(DnnvssError, match="'val' has no measured frame: 1 utterances, and 1 left out"):
        split_examples(task, corpus, encoded, "")  # type: ignore[arg-type]


def test_settings_that_the_viseme_network_would_not_heed_are_refused() -> None:
    config = configured("labels=ph_dv", "+visemes.predictor.fit.precision=auto")
    with pytest.raises(DnnvssError, match=r"visemes\.predictor\.fit\.precision is no setting of this fit"):
        UnitPlan.from_config(config.visemes)
    assert UnitPlan.from_config(configured("labels=ph_dv").visemes).predictor.folds == 4
