"""Regression from what other talkers' systems say: against its equation, and for a talker who is another's mirror."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import CLOCK, TABLE
from scipy.spatial.distance import cdist

from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable
from dnnvss.files import digest
from dnnvss.systems import Example
from dnnvss.systems.adapted import AdaptedRegression, AdaptedSettings
from dnnvss.systems.kernel import KernelRegression, KernelSettings
from dnnvss.training.arrays import save_arrays

Split = dict[str, list[Example]]


@pytest.fixture(scope="module")
def source(examples: Split, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """A talker of whom eight sentences are known."""
    model = KernelRegression(TABLE, CLOCK, KernelSettings(noise=0.01))
    model.fit(examples["train"], examples["val"], folder := tmp_path_factory.mktemp("source"))
    path = save_arrays(folder / "model.npz", {"state": model.state()})
    return {"checkpoint": str(path), "digest": digest(path), "model": {"system": "kernel", "noise": 0.01}}


def adapted(source: dict[str, Any], **more: Any) -> AdaptedRegression:
    return AdaptedRegression(TABLE, CLOCK, AdaptedSettings(sources={"another": source}, **more))


def correlation(model: KernelRegression, examples: list[Example]) -> float:
    said = np.concatenate([model.predict(e).mean[:, 0] for e in examples])
    measured = np.concatenate([e.measured[0][:, 0] for e in examples])
    return float(np.mean([np.corrcoef(a, b)[0, 1] for a, b in zip(said.T, measured.T, strict=True)]))


def mirrored(examples: list[Example]) -> list[Example]:
    """Other parameters for the same movement: mixed, moved and of another size."""
    mix = np.array([[0.0, -3.0, 1.0], [2.0, 0.0, 0.0], [0.0, 1.0, 5.0]], np.float32)
    shift = np.array([[[7.0, -1.0, 0.0]], [[0, 0, 0]], [[0, 0, 0]]], np.float32).transpose(1, 0, 2)
    return [replace(e, targets=e.measured[0] @ mix + shift) for e in examples]


def test_the_prediction_is_that_of_the_equation(examples: Split, source: dict[str, Any], tmp_path: Path) -> None:
    model = adapted(source, rate=100, share=0.25, noise=0.5, whitening=1, around=(0.0,))
    model.fit(examples["val"], [], tmp_path)
    seen = np.concatenate([model.seen(e) for e in examples["val"]])
    phones = KernelRegression(TABLE, CLOCK).seen(examples["val"][0]).shape[1]
    said = np.concatenate([e.measured[0][:, 0] for e in examples["val"]]).astype(float)
    deviation = seen[:, phones:].std(axis=0)
    parts = (seen[:, :phones], 0.7), (seen[:, phones:] / deviation, 1.5)
    widths = [w * np.median(cdist(a, a)[np.triu_indices(len(a), 1)]) for a, w in parts]

    def kernel(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        own, other = a[:, :phones] - b[:phones], (a[:, phones:] - b[phones:]) / deviation
        return 0.75 * np.exp(-(own**2).sum(1) / (2 * widths[0] ** 2)) + 0.25 * np.exp(
            -(other**2).sum(1) / (2 * widths[1] ** 2))

    full = np.stack([kernel(seen, row) for row in seen], axis=1)
    weights = np.linalg.inv(full + 0.5 * np.eye(len(seen))) @ (said - said.mean(0))
    new = model.seen(examples["test"][0])
    expected = said.mean(0) + np.stack([kernel(new, row) for row in seen], axis=1) @ weights
    np.testing.assert_allclose(model.predict(examples["test"][0]).mean[:, 0], expected, atol=2e-4)


def test_one_sentence_is_enough_of_a_talker_who_moves_as_another(examples: Split, source: dict[str, Any],
                                                                 tmp_path: Path) -> None:
    few, many = mirrored(examples["val"][:1]), mirrored([*examples["train"][:3], *examples["test"]])
    alone = KernelRegression(TABLE, CLOCK)
    alone.fit(few, [], tmp_path)
    model = adapted(source, share=1.0, noise=0.01)
    model.fit(few, [], tmp_path)
    assert correlation(model, many) > correlation(alone, many) + 0.1


def test_a_fit_needs_its_sources_as_they_were_and_what_it_learnt_does_not(
        examples: Split, source: dict[str, Any], tmp_path: Path) -> None:
    own = Path(source["checkpoint"])
    copied = tmp_path / "model.npz"
    copied.write_bytes(own.read_bytes())
    model = adapted({**source, "checkpoint": str(copied)})
    model.fit(examples["val"], [], tmp_path)
    before, state = model.predict(examples["test"][0]).mean, model.state()
    copied.unlink()
    again = adapted({**source, "checkpoint": str(copied)})
    again.load_state(state)
    np.testing.assert_array_equal(again.predict(examples["test"][0]).mean, before)
    with pytest.raises(DnnvssError, match="is not what it was"):
        again.fit(examples["val"], [], tmp_path)
    with pytest.raises(DnnvssError, match="nobody to learn from"):
        AdaptedRegression(TABLE, CLOCK).fit(examples["val"], [], tmp_path)


def test_a_voice_alone_is_seen_by_the_sources_alone(source: dict[str, Any]) -> None:
    heard = {"checkpoint": "", "digest": "", "model": {"system": "network"}}
    table = FeatureTable(("logmel",))
    model = AdaptedRegression(table, CLOCK, AdaptedSettings(sources={"a": heard}))
    assert model.share == 1 and not model.looks_up
    with pytest.raises(DnnvssError, match=r"model\.sources\.a\.noise=-1 "):
        AdaptedSettings(sources={"a": {**source, "model": {"system": "kernel", "noise": -1}}})  # type: ignore[dict-item]
