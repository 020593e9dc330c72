"""The one loop takes the steps of loops written by hand, to the last bit, and goes on where it was stopped."""

import copy
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import CLOCK, TABLE, of_layers
from torch import nn

from dnnvss.curves import STATIC_DELTA_DELTA2, mlpg
from dnnvss.errors import DnnvssError
from dnnvss.features import CodeStore, NumericScaler
from dnnvss.systems import Example
from dnnvss.systems.feedforward import FeedForward
from dnnvss.systems.network import NetworkModel
from dnnvss.training import FitSettings
from dnnvss.training.batches import FrameBatches
from dnnvss.training.classification import FrameClassification
from dnnvss.training.fit import alone, measure, run_fit
from dnnvss.training.module import FitModule
from dnnvss.training.objective import Objective
from dnnvss.training.recipe import Recipe, one_cycle, steady
from dnnvss.training.trajectories import TrajectoryError
from dnnvss.training.utterances import UtteranceBatches

CLASSES, DIMENSIONS = 4, 3
SETTINGS = FitSettings(epochs=5, batch_size=32, share=0.8, learning_rate=1e-2, weight_decay=0.01, clip=0.5, seed=3)
JOIN = partial(mlpg, windows=STATIC_DELTA_DELTA2)


def new_network(out: int, seed: int = 3) -> FeedForward:
    torch.manual_seed(seed)
    return FeedForward(TABLE.binary_width, TABLE.numeric_width, TABLE.active_width, out, [16], dropout=0.2,
                       input_dropout=0.2)


def frames(examples: list[Example], seed: int | None) -> FrameBatches:
    """Return batches of frames with a class and a beginning each."""
    store = CodeStore.join((e.id, e.codes) for e in examples)
    owner = np.concatenate([e.alignment["phones"].frame_index(CLOCK) for e in examples])
    targets = np.stack([owner % CLASSES, np.diff(owner, prepend=0) != 0], 1).astype(np.float32)
    return FrameBatches(store, NumericScaler.fit(store), targets, np.arange(len(store)), 32, 0.8, seed)


def utterances(examples: list[Example], size: int, seed: int | None = None) -> UtteranceBatches:
    """Return batches of whole utterances with their targets as they are."""
    store = CodeStore.join((e.id, e.codes) for e in examples)
    targets = np.concatenate([e.measured[0] for e in examples]).reshape(len(store), -1)
    valid = np.concatenate([e.measured[1] for e in examples])
    return UtteranceBatches(store, NumericScaler.fit(store), targets, valid, size, seed=seed)


def told(where: str, value: float) -> DnnvssError:
    return DnnvssError(f"{where} is {value}")


def decoded(outputs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    mean = outputs.reshape(-1, 3, DIMENSIONS)
    return mean, torch.ones(3, DIMENSIONS).expand(mean.shape)


def by_hand(network: nn.Module, objective: Objective, recipe: Recipe, train: FrameBatches | UtteranceBatches,
            val: FrameBatches | UtteranceBatches, epochs: int, seeded: bool) -> list[float]:
    """Fit without Lightning: ten lines that nobody can mistake."""
    optimizer, values, best = recipe.optimizer(network), [], network.state_dict()
    schedule = recipe.schedule(optimizer, epochs * len(train))
    for epoch in range(epochs):
        train.epoch = lambda epoch=epoch: epoch  # type: ignore[misc]
        if seeded:
            torch.manual_seed(SETTINGS.seed * 1_000_003 + epoch)
        for batch in train:
            loss = objective.loss(network, batch)
            assert loss is not None
            optimizer.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(network.parameters(), SETTINGS.clip)
            optimizer.step()
            schedule.step()
        values.append(measure(network, objective, val))
        if values[-1] == min(values):
            best = copy.deepcopy(network.state_dict())
    network.load_state_dict(best)
    return values


Fit = tuple[nn.Module, Objective, Recipe, FrameBatches | UtteranceBatches, FrameBatches | UtteranceBatches]


@pytest.fixture(params=["classes", "trajectories"])
def fit(request: pytest.FixtureRequest, examples: dict[str, list[Example]]) -> Fit:
    if request.param == "classes":
        return (new_network(CLASSES + 1), FrameClassification(told), one_cycle(SETTINGS),
                frames(examples["train"], SETTINGS.seed), frames(examples["val"], None))
    objective = TrajectoryError(decoded, JOIN, torch.ones(DIMENSIONS))
    return (new_network(3 * DIMENSIONS), objective, steady(SETTINGS),
            utterances(examples["train"], 3, SETTINGS.seed), utterances(examples["val"], 3))


def test_weights_and_measures_are_those_of_a_loop_written_by_hand(fit: Fit, tmp_path: Path) -> None:
    network, objective, recipe, train, val = fit
    torch.manual_seed(7)
    plain = copy.deepcopy(network)
    expected = by_hand(plain, objective, recipe, train, val, SETTINGS.epochs, isinstance(train, UtteranceBatches))
    torch.manual_seed(7)
    found = run_fit(network, objective, recipe, train, val, replace(alone(SETTINGS), patience=9), tmp_path)
    np.testing.assert_allclose(found, expected, rtol=1e-6)
    for name, value in plain.state_dict().items():
        assert torch.equal(network.state_dict()[name], value), name


def test_a_fit_that_was_stopped_goes_on_to_the_same_weights(fit: Fit, tmp_path: Path,
                                                            monkeypatch: pytest.MonkeyPatch) -> None:
    network, objective, recipe, train, val = fit
    begin, settings = FitModule.on_train_epoch_start, replace(alone(SETTINGS), patience=9)
    given = copy.deepcopy(network)
    torch.manual_seed(7)
    whole = run_fit(network, objective, recipe, train, val, settings, tmp_path / "whole")

    def stopped(self: FitModule) -> None:
        if self.current_epoch == 3:
            raise KeyboardInterrupt
        begin(self)

    torch.manual_seed(7)
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(FitModule, "on_train_epoch_start", stopped)
        run_fit(copy.deepcopy(given), objective, recipe, train, val, settings, tmp_path / "cut")
    torch.manual_seed(99)  # chance goes on from the checkpoint, not from here
    assert run_fit(given, objective, recipe, train, val, settings, tmp_path / "cut") == whole
    for name, value in network.state_dict().items():
        assert torch.equal(given.state_dict()[name], value), name
    assert run_fit(given, objective, recipe, train, val, settings, tmp_path / "cut") == whole  # which has ended


def test_a_batch_that_says_nothing_takes_no_step(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    seen = examples["train"]
    blind = [replace(e, valid=np.zeros_like(e.valid)) for e in seen]
    network, objective = new_network(3 * DIMENSIONS), TrajectoryError(decoded, JOIN, torch.ones(DIMENSIONS))
    before = copy.deepcopy(network.state_dict())
    settings = replace(alone(SETTINGS), epochs=1)
    run_fit(network, objective, steady(settings), utterances(blind, 8, 0), utterances(seen[:1], 8), settings,
            tmp_path)
    for name, value in network.state_dict().items():
        assert torch.equal(before[name], value), name


def test_a_fit_by_itself_does_not_heed_the_cluster_that_it_runs_in(examples: dict[str, list[Example]], tmp_path: Path,
                                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    """As the second of two processes that Slurm has started for a fit which is shared."""
    told_by_slurm = {"NTASKS": 2, "NTASKS_PER_NODE": 2, "NNODES": 1, "PROCID": 1, "LOCALID": 1, "NODEID": 0,
                     "JOB_ID": 1, "JOB_NAME": "fit"}
    for name, value in told_by_slurm.items():
        monkeypatch.setenv(f"SLURM_{name}", str(value))
    network, settings = new_network(CLASSES + 1), replace(alone(SETTINGS), epochs=1)
    history = run_fit(network, FrameClassification(told), one_cycle(settings), frames(examples["train"], 0),
                      frames(examples["val"], None), settings, tmp_path)
    assert len(history) == 1 and (tmp_path / "checkpoints" / "best.ckpt").exists()


def test_refining_keeps_the_weights_that_were_given_where_no_pass_is_better(examples: dict[str, list[Example]],
                                                                           tmp_path: Path) -> None:
    settings = FitSettings(epochs=2, batch_size=32, progress=False, figure_every=0, accelerator="cpu", refine=2,
                           refine_rate=0.5)
    model = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(of_layers(16), settings))
    model.fit(examples["train"], examples["val"], tmp_path)
    before = model.predict(examples["test"][0]).mean
    model.refine(examples["train"], examples["val"], JOIN, tmp_path / "refined")
    np.testing.assert_array_equal(model.predict(examples["test"][0]).mean, before)
