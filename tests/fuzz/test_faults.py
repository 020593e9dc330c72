"""Faults that campaigns found in arrays, tensors and results of stages, each as the smallest file that has it."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from conftest import composed, make_example
from fuzz.inputs import Input, all_inputs
from fuzz.test_fuzz import tried

from data_prep.stages import FOLDER, Workshop, _digest, fingerprint
from dnnvss import files
from dnnvss.commands.train_settings import run_settings
from dnnvss.errors import DnnvssError
from dnnvss.runs.files import RunFiles
from dnnvss.runs.run import Run, _opened, _tried, make_model
from dnnvss.runs.settings import RunSettings
from dnnvss.training.arrays import save_arrays
from dnnvss.training.checkpoints import load_checkpoint

STRUCT = np.dtype([("f", "<f4")])


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Input]:
    return all_inputs(tmp_path_factory.mktemp("faults"))


def points(dtype: Any) -> dict[str, Any]:
    return {"points": np.zeros((12, 5, 2), dtype), "valid": np.ones(12, bool)}


ARRAYS: dict[str, tuple[str, dict[str, Any]]] = {
    "a reference without axes": ("reference", {"u1": np.array(1.0)}),
    "references of no sentence": ("reference", {}),
    "a reference in text": ("reference", {"u1": np.full((30, 3), "a"), "u2": np.full((30, 3), "a")}),
    "a mask of another length": ("speech", {"u1": np.ones(29, bool), "u2": np.ones(30, bool)}),
    "landmarks that are dates": ("landmarks npz", points("M8[s]")),
    "landmarks that are records": ("landmarks npz", points(STRUCT)),
    "landmarks in text": ("landmarks npz", {"points": np.full((12, 5, 2), "abc"), "valid": np.ones(12, bool)}),
    "durations of an older version": ("durations", {"columns": np.array(["a"]), "weights": np.zeros(1)}),
    "a talker without gauges": ("talker", {"natural": np.ones(3), "rest": np.zeros(3), "rest_deviation": np.ones(3)}),
}


@pytest.mark.parametrize("name", ARRAYS)
def test_arrays_that_mean_nothing_are_refused(name: str, inputs: dict[str, Input]) -> None:
    kind, arrays = ARRAYS[name]
    _refused(inputs[kind], lambda path: files.write_arrays(path, **arrays))


@pytest.mark.parametrize("name", ["natural", "rest", "gauges", "own"])
def test_a_part_of_a_talker_that_is_empty_or_records_is_refused(name: str, inputs: dict[str, Input]) -> None:
    with np.load(inputs["talker"].path) as archive:
        arrays = dict(archive)
    for odd in (np.zeros(0), np.zeros(arrays[name].shape, STRUCT), np.zeros(arrays[name].shape, "M8[s]")):
        _refused(inputs["talker"], lambda path, odd=odd: files.write_arrays(path, **{**arrays, name: odd}))


def _refused(kind: Input, write: Callable[[Path], Any]) -> None:
    right = kind.path.read_bytes()
    try:
        write(kind.path)
        with pytest.raises(DnnvssError) as told:
            kind.read(kind.path)
        assert told.value.remedy and told.value.file is not None
        tried(kind)
    finally:
        kind.path.write_bytes(right)


@pytest.fixture(scope="module")
def network(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, RunSettings, dict[str, Any]]:
    """A small network in a file, the settings of its run, and what the file holds."""
    folder = tmp_path_factory.mktemp("network")
    settings = run_settings(composed(
        "train", "model=feedforward", "model.network.hidden=[8]", "corpus.out=data", "trainer.epochs=1",
        "trainer.progress=false", "trainer.figure_every=0", "trainer.accelerator=cpu",
        "labels.blocks=[centre_phone,phone_context,phone_span]"))
    model = make_model(settings, settings.task)
    rng = np.random.default_rng(0)
    examples = [make_example(f"e{i}", rng) for i in range(4)]
    model.fit(examples[:3], examples[3:], folder)
    Run.save(folder, settings.task, model)
    path = RunFiles(folder).model
    assert _tried(path, _opened(path, settings), settings) == 3
    return path, settings, load_checkpoint(path)


STATES: dict[str, Callable[[dict[str, Any]], Any]] = {
    "no networks": lambda s: s.pop("networks"),
    "a list of no networks": lambda s: s.update(networks=[]),
    "a tensor for networks": lambda s: s.update(networks=torch.full((2, 2), float("nan"))),
    "weights of another size": lambda s: s["networks"][0].update(dict.fromkeys(s["networks"][0], torch.zeros(3))),
    "a mean of other streams": lambda s: s.update(mean=s["mean"][:1]),
    "a mean of no coefficient": lambda s: s.update(mean=s["mean"][:, :0]),
    "a mean that is no number": lambda s: s.update(mean=torch.full_like(s["mean"], float("nan"))),
    "a variance of nothing": lambda s: s.update(variance=torch.zeros_like(s["variance"])),
    "a scaler of other columns": lambda s: s.update(scaler={"mean": [0.0] * 7, "deviation": [1.0] * 7}),
    "another kind of state": lambda s: s.clear(),
}


@pytest.mark.parametrize("name", STATES)
def test_a_system_that_cannot_predict_is_no_run(
        name: str, network: tuple[Path, RunSettings, dict[str, Any]], tmp_path: Path) -> None:
    right, settings, _ = network
    kept = load_checkpoint(right)
    STATES[name](kept["state"])
    path = save_arrays(tmp_path / "model.npz", kept)
    with pytest.raises(DnnvssError, match="does not hold what feedforward learns") as told:
        _tried(path, _opened(path, settings), settings)
    assert told.value.file == path and told.value.remedy


def test_settings_of_a_giant_network_take_no_memory(network: tuple[Path, RunSettings, dict[str, Any]]) -> None:
    from dataclasses import replace

    path, settings, _ = network
    giant = replace(settings, model={**settings.model, "network": {**settings.model["network"], "hidden": [10**9]}})
    with pytest.raises(DnnvssError, match="are not those of the network that the settings describe"):
        _opened(path, giant)


TRIES: list[str] = []


def work(name: str, out: Path) -> dict[str, Any]:
    TRIES.append(name)
    files.write_arrays(out / FOLDER / "stage" / f"{name}.npz", a=np.arange(3))
    return {"made": [1, 2]}


def test_what_a_stage_kept_is_taken_only_as_it_was_written(tmp_path: Path) -> None:
    TRIES.clear()
    shop, path = Workshop(tmp_path, jobs=1), tmp_path / FOLDER / "stage" / "a.json"
    right = {"a": {"made": [1, 2]}}
    assert shop.run("stage", work, {"a": {}}) == shop.run("stage", work, {"a": {}}) == right and len(TRIES) == 1
    kept = json.loads(path.read_text())
    shortage = {"dropped": "a.mp4: cannot be read (BlockingIOError: [Errno 11] Resource temporarily unavailable)."}
    for count, odd in enumerate(({**kept, "result": {"made": []}}, {**kept, "result": shortage}, kept | {"digest": 3},
                                 {"key": kept["key"], "result": shortage}, [], {"a": {}}), start=2):
        path.write_text(json.dumps(odd))
        assert shop.run("stage", work, {"a": {}}) == right and len(TRIES) == count
    arrays = path.with_suffix(".npz")
    arrays.write_bytes(arrays.read_bytes()[:-5])
    assert shop.run("stage", work, {"a": {}}) == right and len(TRIES) == count + 1
    assert kept["digest"] == _digest(right["a"], path) and kept["key"] == fingerprint("stage", None, {})
