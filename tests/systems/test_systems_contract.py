"""What every model keeps to, whatever is inside: one test over all files of conf/model."""

from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import CLOCK, ROOT, TABLE
from hydra import compose, initialize_config_dir

from dnnvss.commands.plain import run_settings
from dnnvss.curves import STATIC_DELTA_DELTA2
from dnnvss.features import phones_of
from dnnvss.runs.run import make_model
from dnnvss.systems import Example, VisualModel
from dnnvss.systems.examples import Task

NAMES = sorted(p.stem for p in (ROOT / "conf" / "model").glob("*.yaml"))
SMALL = ["trainer.progress=false", "trainer.epochs=3", "trainer.figure_every=0", "trainer.batch_size=32",
         "trainer.accelerator=cpu"]


def build(name: str) -> VisualModel:
    with initialize_config_dir(str(ROOT / "conf"), version_base="1.3"):
        config = compose("train", [f"model={name}", *SMALL])
    return make_model(run_settings(config), Task(TABLE, CLOCK, STATIC_DELTA_DELTA2))


@pytest.fixture(scope="module", params=NAMES)
def fitted(request: pytest.FixtureRequest, examples: dict[str, list[Example]],
           tmp_path_factory: pytest.TempPathFactory) -> tuple[str, VisualModel]:
    model = build(request.param)
    model.fit(examples["train"], examples["val"], tmp_path_factory.mktemp(request.param))
    return request.param, model


def test_prediction_has_a_gaussian_for_every_frame(fitted: tuple[str, VisualModel], examples: dict) -> None:
    for example in examples["test"]:
        prediction = fitted[1].predict(example)
        assert prediction.mean.shape == example.targets.shape
        variance = np.broadcast_to(prediction.variance, prediction.mean.shape)
        assert np.isfinite(prediction.mean).all() and np.isfinite(variance).all() and (variance > 0).all()


def test_durations_where_learnt_are_positive_for_every_phone(fitted: tuple[str, VisualModel], examples: dict) -> None:
    durations = fitted[1].phone_durations(examples["test"][0])
    assert (durations is None) == (fitted[0] != "hsmm")
    if durations is not None:
        assert durations.shape == phones_of(examples["test"][0].codes).code.shape and (durations > 0).all()


def test_state_is_plain_and_restores_the_model(fitted: tuple[str, VisualModel], examples: dict, tmp_path: Path) -> None:
    name, model = fitted
    torch.save(model.state(), tmp_path / "state.pt")
    other = build(name)
    other.load_state(torch.load(tmp_path / "state.pt", weights_only=True))
    for example in examples["test"]:
        np.testing.assert_array_equal(other.predict(example).mean, model.predict(example).mean)
        np.testing.assert_array_equal(other.predict(example).variance, model.predict(example).variance)


def test_prediction_does_not_depend_on_earlier_ones(fitted: tuple[str, VisualModel], examples: dict) -> None:
    first, second = examples["test"]
    before = fitted[1].predict(first).mean
    fitted[1].predict(second)
    np.testing.assert_array_equal(fitted[1].predict(first).mean, before)


def test_fit_starts_anew(examples: dict, tmp_path: Path) -> None:
    model = build("phone_mean")
    model.fit(examples["train"][:4], examples["val"], tmp_path)
    model.fit(examples["train"], examples["val"], tmp_path)
    fresh = build("phone_mean")
    fresh.fit(examples["train"], examples["val"], tmp_path)
    np.testing.assert_array_equal(model.predict(examples["test"][0]).mean, fresh.predict(examples["test"][0]).mean)


def test_every_model_but_the_mean_beats_the_mean(fitted: tuple[str, VisualModel], examples: dict) -> None:
    name, model = fitted
    targets = np.concatenate([e.targets[:, 0] for e in examples["train"]])
    error = np.mean((np.concatenate([model.predict(e).mean[:, 0] for e in examples["train"]]) - targets) ** 2)
    share = error / targets.var(0).mean()
    assert share == pytest.approx(1, abs=1e-5) if name == "training_mean" else share < 0.9
