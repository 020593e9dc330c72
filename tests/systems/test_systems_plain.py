"""A fitted network in NumPy says what it says in torch."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import CLOCK, TABLE, make_example

from dnnvss.systems.base import Example
from dnnvss.systems.feedforward import FeedForward
from dnnvss.systems.layers import FeedForwardSettings, Layers
from dnnvss.systems.network import NetworkModel, NetworkSettings
from dnnvss.systems.plain_network import PlainNetwork
from dnnvss.training.arrays import load_arrays, save_arrays
from dnnvss.training.settings import FitSettings

CASES = {"one": {}, "two members": {"members": 2}, "variances": {"variances": True},
         "two of them": {"members": 2, "variances": True}}


def test_layers_by_hand() -> None:
    """Columns 0 and 2 of three, one number: tanh(1 + 4 + .5 * 2 - 6) = 0, times 3 plus 1."""
    layers = Layers(np.array([[1], [2], [4], [0]], np.float32), np.array([[2]], np.float32),
                    np.array([-6], np.float32), ((np.array([[3]], np.float32), np.array([1], np.float32)),), "tanh")
    assert layers(np.array([[0, 2]]), np.array([[0.5]], np.float32)) == np.array([[1.0]], np.float32)


@pytest.mark.parametrize("activation", ["tanh", "sigmoid", "relu"])
@pytest.mark.parametrize("frames", [1, 31, 32, 33, 200])
def test_layers_are_those_of_torch(activation: str, frames: int) -> None:
    rng = np.random.default_rng(frames)
    active = rng.integers(0, 51, (frames, 8)).astype(np.int32)
    for t in range(1, frames):  # most columns stay from one frame to the next
        stay = rng.random(8) < 0.9
        active[t, stay] = active[t - 1, stay]
    numeric = rng.normal(size=(frames, 3)).astype(np.float32)
    torch.manual_seed(0)
    network = FeedForward(50, 3, 8, 7, (24, 16), activation).eval()
    weights = {name: w.numpy() for name, w in network.state_dict().items()}
    layers = Layers.of(weights, FeedForwardSettings((24, 16), activation), 50, 3, 7)
    assert layers is not None
    with torch.no_grad():
        wanted = network(torch.from_numpy(active), torch.from_numpy(numeric)).numpy()
    np.testing.assert_allclose(layers(active, numeric), wanted, atol=2e-6)
    assert Layers.of(weights, FeedForwardSettings((24, 17), activation), 50, 3, 7) is None


@pytest.mark.parametrize("case", CASES)
def test_a_fitted_network_says_the_same(case: str, examples: dict[str, list[Example]], tmp_path: Path) -> None:
    given = {"network": {"kind": "feedforward", "hidden": [16, 16]}, **CASES[case]}
    fit = FitSettings(epochs=2, progress=False, figure_every=0, accelerator="cpu")
    model = NetworkModel(TABLE, CLOCK, NetworkSettings(fit=fit, **given))
    model.fit(examples["train"], examples["val"], tmp_path)
    state = load_arrays(save_arrays(tmp_path / "model.npz", model.state()))
    settings = {"name": "mine", "system": "network", **given}
    assert PlainNetwork.serves(settings)
    plain = PlainNetwork.of(settings, TABLE, CLOCK, state)
    assert plain is not None
    other = make_example("other", np.random.default_rng(7))
    for example in (examples["test"][0], replace(other, alternatives=(other.codes, other.codes))):
        ours, theirs = plain.predict(example), model.predict(example)
        np.testing.assert_allclose(ours.mean, theirs.mean, atol=1e-5 * model.deviation_.max())
        np.testing.assert_allclose(np.broadcast_to(ours.variance, ours.mean.shape), theirs.variance, rtol=1e-5)
    around, codes = slice(10, 25), other.codes
    mean, _ = plain.predictor(other)(around)
    np.testing.assert_allclose(mean, plain.predict(other).mean[around], atol=1e-6)
    stream, at = plain.stream(), np.arange(len(codes))
    told = [stream.push(codes.active(part), codes.numeric(part)).mean for part in np.split(at, [1, 9, 9])]
    np.testing.assert_allclose(np.concatenate([*told, stream.finish().mean]), plain.predict(other).mean, atol=1e-6)


def test_what_is_no_such_network_is_left_to_torch() -> None:
    assert not PlainNetwork.serves({"name": "kernel"})
    assert not PlainNetwork.serves({"system": "network", "network": {"kind": "recurrent"}})
    assert not PlainNetwork.serves({"system": "network", "network": "feedforward"})
