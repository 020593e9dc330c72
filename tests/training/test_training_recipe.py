"""How weights move: a step changes what a unit says as much however many inputs it has; when a fit has diverged."""

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any, cast

import pytest
import torch
from conftest import TABLE, composed
from torch import nn

from dnnvss.commands.train_settings import run_settings
from dnnvss.errors import DnnvssError
from dnnvss.runs.naming import run_name
from dnnvss.systems.feedforward import FeedForward
from dnnvss.systems.stacked import StackedNetworks
from dnnvss.training import FitSettings
from dnnvss.training.callbacks import Watch
from dnnvss.training.recipe import descent
from dnnvss.training.regression import FrameRegression

RATE = 3e-3


def rates(network: nn.Module, **settings: object) -> dict[str, float]:
    """The rate of each weight by its name."""
    optimizer = descent(FitSettings(learning_rate=RATE, **settings)).optimizer(network)  # type: ignore[arg-type]
    of = {id(p): group["lr"] for group in optimizer.param_groups for p in group["params"]}
    assert len(of) == len(list(network.parameters()))
    return {name: of[id(p)] for name, p in network.named_parameters()}


def network(*hidden: int) -> FeedForward:
    return FeedForward(TABLE.binary_width, TABLE.numeric_width, TABLE.active_width, 9, hidden)


def test_the_rate_of_a_layer_falls_with_its_inputs_beyond_512() -> None:
    found = rates(network(1024, 512, 2048))
    assert found.pop("rest.2.weight") == RATE / 2 and found.pop("rest.8.weight") == RATE / 4
    assert set(found.values()) == {RATE} and "rest.5.weight" in found and "first.weight" in found


@pytest.mark.parametrize("settings", [{"base_width": 0}, {"optimizer": "sgd"}, {"base_width": 4096}])
def test_one_rate_where_none_is_to_fall(settings: dict[str, object]) -> None:
    assert set(rates(network(1024, 1024), **settings).values()) == {RATE}


def test_networks_that_are_stacked_have_the_rates_of_each() -> None:
    one = network(64, 96)
    alone, together = rates(one, base_width=80), rates(StackedNetworks([one, one]), base_width=80)
    assert {name.removeprefix("stacks.").replace("/", "."): rate for name, rate in together.items()} == alone
    assert alone["rest.5.weight"] == RATE * 80 / 96 and alone["rest.2.weight"] == RATE


@pytest.mark.parametrize("width", [256, 512, 2048])
def test_a_step_moves_units_as_far_however_wide_the_layer_is(width: int) -> None:
    layer = nn.Linear(width, 1, bias=False)
    optimizer = descent(FitSettings(learning_rate=RATE)).optimizer(layer)
    inputs = torch.ones(width)
    before = layer(inputs).item()
    layer(inputs).sum().backward()
    optimizer.step()
    assert before - layer(inputs).item() == pytest.approx(RATE * min(width, 512), rel=1e-3)


def test_a_name_tells_what_wide_layers_were_fitted_with_and_that_of_narrow_ones_stays() -> None:
    def named(*given: str) -> str:
        return run_name(run_settings(composed("train", "model=feedforward", *given)), "abc")

    off, wide = "trainer.base_width=0", "model.network.hidden=[512,1024]"
    assert named() == named(off) and named(wide) != named(wide, off)
    assert named(wide, "trainer.optimizer=sgd") == named(wide, off, "trainer.optimizer=sgd")
    assert named("model=ensemble") == named("model=ensemble", off)
    assert named("model=convolutional", "model.network.width=300") == named(
        "model=convolutional", "model.network.width=300", off)


@pytest.mark.parametrize(("error", "null", "ends"), [(150.0, 1.0, True), (99.0, 0.2, False), (150.0, 2.0, False),
                                                     (float("nan"), 2.0, True)])
def test_a_fit_has_diverged_beyond_a_hundred_times_what_the_mean_costs(error: float, null: float, ends: bool) -> None:
    """Curves that hardly moved in training cost the mean thousands where they move."""
    trainer: Any = SimpleNamespace(callback_metrics={"val/static": error, "val/null": null}, current_epoch=0)
    watch, module = Watch(FrameRegression(FitSettings(), 3, 3)), cast(Any, None)
    with pytest.raises(DnnvssError, match="diverged") if ends else nullcontext():
        watch.on_validation_end(trainer, module)
    assert watch.history == ([] if ends else [error])
