"""Predicted variances, and training with parameter generation inside the loss."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import CLOCK, TABLE, of_layers

from dnnvss.curves import STATIC_DELTA_DELTA2, mlpg
from dnnvss.errors import DnnvssError
from dnnvss.systems import Example
from dnnvss.systems.network import NetworkModel
from dnnvss.training import FitSettings
from dnnvss.training.regression import FrameRegression

SETTINGS = FitSettings(epochs=6, batch_size=32, learning_rate=3e-3, progress=False, figure_every=0, accelerator="cpu",
                       schedule="constant", refine=3, refine_rate=1e-3)
JOIN = partial(mlpg, windows=STATIC_DELTA_DELTA2)


def network(settings: FitSettings = SETTINGS, variances: bool = False) -> NetworkModel:
    return NetworkModel(TABLE, CLOCK, NetworkModel.Settings(of_layers(16, 16), settings, variances=variances))


def trajectory_error(model: NetworkModel, examples: list[Example]) -> float:
    found = [(model.predict(e), e) for e in examples]
    return float(np.mean([((mlpg(p.mean, p.variance) - e.targets[:, 0]) ** 2 / model.deviation_[0] ** 2).mean()
                          for p, e in found]))


def test_gaussian_loss_by_hand() -> None:
    objective = FrameRegression(replace(SETTINGS, stream_weights=(1.0,)), streams=1, dimensions=2)
    target, log4 = torch.tensor([[1.0, 2.0]]), float(np.log(4))
    predicted = torch.tensor([[3.0, 2.0, log4, 0.0]])  # errors 2 and 0, variances 4 and 1
    first, second = 0.5 * (4 / 4 + log4) * 2, 0.0  # times the root of the variance
    assert objective.error(predicted, target).item() == pytest.approx((first + second) / 2)
    assert objective.error(predicted[:, :2], target).item() == pytest.approx(2.0)


def test_variances_are_learnt_where_they_differ(tmp_path: Path, examples: dict[str, list[Example]]) -> None:
    """Noise that is added to one half of the frames, those of odd phone number, shows in the predicted variance."""
    rng = np.random.default_rng(0)
    noisy = {}
    for split, own in examples.items():
        noisy[split] = []
        for e in own:
            owner = e.alignment["phones"].frame_index(CLOCK)
            loud = np.array([p in ("AA", "AE", "AH", "AO", "AW", "AY") for p in e.alignment["phones"].labels])[owner]
            targets = e.targets + (loud[:, None, None] * rng.normal(scale=2.0, size=e.targets.shape)).astype(np.float32)
            noisy[split].append((replace(e, targets=targets), loud))
    model = network(replace(SETTINGS, epochs=40), variances=True)
    model.fit([e for e, _ in noisy["train"]], [e for e, _ in noisy["val"]], tmp_path)
    predicted = [(model.predict(e).variance[:, 0], loud) for e, loud in noisy["test"]]
    loud, quiet = (np.concatenate([v[m if side else ~m] for v, m in predicted]).mean() for side in (True, False))
    assert loud > 2 * quiet
    errors = [((model.predict(e).mean - e.targets) ** 2 / model.predict(e).variance) for e, _ in noisy["val"]]
    np.testing.assert_allclose(np.concatenate(errors).mean(axis=0), 1.0, rtol=1e-4)  # scaled on these frames


@pytest.mark.parametrize("variances", [False, True])
def test_refining_lowers_the_trajectory_error_and_restores(
        tmp_path: Path, examples: dict[str, list[Example]], variances: bool) -> None:
    model = network(variances=variances)
    model.fit(examples["train"], examples["val"], tmp_path)
    before = trajectory_error(model, examples["val"])
    model.refine(examples["train"], examples["val"], JOIN, tmp_path / "refine")
    assert trajectory_error(model, examples["val"]) < before
    other = network(variances=variances)
    other.load_state(model.state())
    np.testing.assert_array_equal(other.predict(examples["test"][0]).mean, model.predict(examples["test"][0]).mean)


def test_predicted_variances_of_several_members_fit_the_validation_errors(
        tmp_path: Path, examples: dict[str, list[Example]]) -> None:
    model = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(of_layers(16, 16), replace(SETTINGS, refine=0), members=3,
                                                             variances=True))
    model.fit(examples["train"], examples["val"], tmp_path)
    found = [(model.predict(e), e.targets) for e in examples["val"]]
    scores = np.concatenate([(p.mean - t) ** 2 / p.variance for p, t in found]).mean(axis=0)
    np.testing.assert_allclose(scores, 1.0, rtol=1e-4)


def test_clips_without_a_measured_frame_say_nothing(tmp_path: Path, examples: dict[str, list[Example]]) -> None:
    model, blind = network(), replace(SETTINGS, refine=2)
    model.fit(examples["train"], examples["val"], tmp_path)
    state = model.state()
    results = []
    unseen = [replace(examples["test"][k % 2], id=f"unseen{k}") for k in range(8)]  # a whole group
    unseen = [replace(e, valid=np.zeros_like(e.valid)) for e in unseen]
    for name, more in (("alone", []), ("more", unseen)):
        again = network(blind)
        again.load_state(state)
        again.refine(examples["train"], [*more, *examples["val"]], JOIN, tmp_path / name)
        results.append(again.predict(examples["test"][0]).mean)
    np.testing.assert_array_equal(*results)
    assert not np.array_equal(results[0], model.predict(examples["test"][0]).mean)


def test_divergence_is_named(tmp_path: Path, examples: dict[str, list[Example]]) -> None:
    model = network(replace(SETTINGS, epochs=1, refine_rate=1e30))
    model.fit(examples["train"], examples["val"], tmp_path)
    with pytest.raises(DnnvssError, match="refine_rate"):
        model.refine(examples["train"], examples["val"], JOIN, tmp_path / "refine")
