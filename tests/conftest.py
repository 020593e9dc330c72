"""Tiny synthetic data shared by all tests."""

import gc
import os
import shutil
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from slowest import (  # noqa: F401
    pytest_addoption,
    pytest_runtest_call,
    pytest_runtest_setup,
    pytest_terminal_summary,
)

os.environ.setdefault("OMP_NUM_THREADS", "1")

from dnnvss.curves import STATIC_DELTA_DELTA2, derivatives
from dnnvss.features import FeatureTable, encode
from dnnvss.phones import SPOKEN, phone_id
from dnnvss.systems import Example
from dnnvss.timing import Alignment, FrameClock, Tier

ROOT = Path(__file__).parents[1]
TABLE = FeatureTable(("centre_phone", "phone_context", "phone_span"))
CLOCK = FrameClock(100)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Any:
    """Nothing that is imported is garbage: looking through it was a seventh of collecting, and went on in the tests."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def run_command(*words: object) -> int:
    """Run a command of dnnvss as its entry does and return its status."""
    from dnnvss.commands.entry import main

    try:
        return main([str(word) for word in words])
    except SystemExit as ended:
        return int(ended.code or 0)


def composed(name: str, *given: str) -> Any:
    """The settings that hydra composes from ``conf/`` and what is given, as a configuration of its own.

    Hydra takes a tenth of a second for the groups; those are composed once, and values are laid over them as it does.
    """
    from hydra._internal.config_loader_impl import ConfigLoaderImpl
    from hydra.core.override_parser.overrides_parser import OverridesParser

    overrides = OverridesParser.create().parse_overrides(list(given))
    groups = [o.key_or_group.partition("@")[0] for o in overrides]
    chosen = [(ROOT / "conf" / group).is_dir() or group.startswith("hydra") for group in groups]
    config = deepcopy(_composed(name, tuple(t for t, is_group in zip(given, chosen, strict=True) if is_group)))
    values = [o for o, is_group in zip(overrides, chosen, strict=True) if not is_group]
    ConfigLoaderImpl._apply_overrides_to_config(values, config)
    return config


@cache
def _composed(name: str, groups: tuple[str, ...]) -> Any:
    from hydra import compose, initialize_config_dir

    with initialize_config_dir(str(ROOT / "conf"), version_base="1.3"):
        return compose(name, list(groups))


def of_layers(*hidden: int, **more: object) -> dict[str, object]:
    """Return the settings of a feed-forward network with layers of these widths."""
    return {"kind": "feedforward", "hidden": list(hidden), **more}


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small prepared corpus of the built-in talker, to be copied by whoever trains on it or changes it."""
    from data_prep.demo import prepare_demo

    folder = tmp_path_factory.mktemp("demo") / "corpus"
    prepare_demo(folder, sentences=8, size=96, jobs=1)
    return folder


@pytest.fixture(scope="session")
def encoded(demo: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same with its clips encoded by a face of ``aam.modes=8``, as a training finds it that is not the first."""
    from dnnvss.commands.train_settings import run_settings
    from dnnvss.corpus import Corpus
    from dnnvss.runs.fitting import encode

    folder = Path(shutil.copytree(demo, tmp_path_factory.mktemp("encoded") / "corpus"))
    encode(run_settings(composed("train", f"corpus.out={folder}", "aam.modes=8", "jobs=1")), Corpus.open(folder))
    return folder


@pytest.fixture(scope="session")
def grid_raw() -> Path:
    """The GRID s1 data, where DNNVSS_GRID says that it is."""
    folder = os.environ.get("DNNVSS_GRID", "")
    if not folder or not Path(folder, "splits").is_dir():
        pytest.skip("set DNNVSS_GRID to the folder of the GRID s1 data to run this test")
    return Path(folder)


def make_example(name: str, rng: np.random.Generator, dimensions: int = 3) -> Example:
    """Return an utterance of random phones whose parameters follow from phone, neighbour and a little noise."""
    phones = ["sil", *rng.choice(SPOKEN[:12], 8), "sil"]
    edges = np.cumsum([0, *rng.uniform(0.05, 0.2, len(phones))]).round(3)
    word = [(edges[0], edges[1], ""), (edges[1], edges[-2], "word"), (edges[-2], edges[-1], "")]
    tier = Tier("phones", zip(edges[:-1], edges[1:], phones, strict=True))
    alignment = Alignment([tier, Tier("words", word)])
    codes = encode(alignment, "word", TABLE, CLOCK)
    owner = tier.frame_index(CLOCK)
    ids = np.array([phone_id(p) for p in phones])[owner]
    basis = np.random.default_rng(0).normal(size=(41, dimensions))
    static = np.stack([np.convolve(np.pad(c, 3, "edge"), np.ones(7) / 7, "valid") for c in basis[ids].T], 1)
    static += rng.normal(scale=0.05, size=static.shape)
    targets = derivatives(static, STATIC_DELTA_DELTA2).astype(np.float32)
    return Example(name, alignment, codes, targets, np.ones(len(static), dtype=bool))


@pytest.fixture(scope="session")
def examples() -> dict[str, list[Example]]:
    """Examples of a talker with three parameters: eight to train on, two to validate, two to test."""
    rng = np.random.default_rng(1)
    return {name: [make_example(f"{name}{i}", rng) for i in range(count)]
            for name, count in (("train", 8), ("val", 2), ("test", 2))}
