"""On a GPU: codes expanded there, steps recorded and replayed, and fits that end where those of the processor do."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import CLOCK, TABLE, of_layers

from dnnvss.errors import DnnvssError
from dnnvss.systems import Example
from dnnvss.systems.network import NetworkModel
from dnnvss.training import FitSettings
from dnnvss.training.code_sum import code_sum

pytestmark = pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
SETTINGS = FitSettings(epochs=4, batch_size=16, share=1.0, progress=False, figure_every=0, accelerator="gpu")
Splits = dict[str, list[Example]]


def fitted(examples: Splits, folder: Path, settings: FitSettings, dropout: float = 0.2) -> NetworkModel:
    network = of_layers(16, 16, dropout=dropout, input_dropout=dropout)
    model = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(network, settings))
    model.fit(examples["train"], examples["val"], folder)
    return model


def weights(model: NetworkModel) -> np.ndarray:
    return np.concatenate([v.ravel() for v in model.state()["networks"][0].values()])


@pytest.mark.parametrize("wanted", [{}, {"optimizer": "sgd", "learning_rate": 0.1}, {"average": 0.9},
                                    {"precision": "bf16-mixed"}])
def test_a_recorded_step_is_the_step(wanted: dict, examples: Splits, tmp_path: Path) -> None:
    """Cosine schedule, dropout and clipping included: a replay takes the rate and the seed of its own step."""
    settings = replace(SETTINGS, **wanted)
    recorded = fitted(examples, tmp_path / "recorded", settings)
    plain = fitted(examples, tmp_path / "plain", replace(settings, graph=False))
    np.testing.assert_allclose(weights(recorded), weights(plain), atol=1e-4)


def test_a_resumed_fit_ends_as_an_uninterrupted_one(examples: Splits, tmp_path: Path) -> None:
    constant = replace(SETTINGS, schedule="constant")
    whole = fitted(examples, tmp_path / "whole", constant)
    fitted(examples, tmp_path / "cut", replace(constant, epochs=2))
    np.testing.assert_allclose(weights(fitted(examples, tmp_path / "cut", constant)), weights(whole), atol=1e-5)


def test_the_fit_is_that_of_the_processor(examples: Splits, tmp_path: Path) -> None:
    ours = fitted(examples, tmp_path / "gpu", SETTINGS, dropout=0.0)
    theirs = fitted(examples, tmp_path / "cpu", replace(SETTINGS, accelerator="cpu"), dropout=0.0)
    np.testing.assert_allclose(weights(ours), weights(theirs), atol=2e-3)


def test_divergence_names_the_batch_though_nothing_waits_for_it(examples: Splits, tmp_path: Path) -> None:
    wild = replace(SETTINGS, optimizer="sgd", learning_rate=1e30, reduction="sum", clip=1e30)
    with pytest.raises(DnnvssError, match=r"loss of batch \d+ in epoch 0"):
        fitted(examples, tmp_path, wild)


def test_expanded_codes_give_sum_and_gradient_of_the_processor() -> None:
    active = torch.randint(0, 51, (40, 7), dtype=torch.int32)
    sums, gradients = [], []
    for device in ("cpu", "cuda"):
        weight = torch.linspace(-1, 1, 51 * 8).reshape(51, 8).to(device)
        weight[-1] = 0
        columns = torch.where(torch.arange(7) % 3 == 0, 50, active % 7 + 7 * torch.arange(7)).int().to(device)
        total = code_sum(columns, weight.requires_grad_())
        total.square().sum().backward()
        sums.append(total.detach().cpu()), gradients.append(weight.grad.cpu())
    torch.testing.assert_close(*sums, rtol=1e-5, atol=1e-5)
    torch.testing.assert_close(*gradients, rtol=1e-5, atol=1e-4)
