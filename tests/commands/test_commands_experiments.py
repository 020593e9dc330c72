"""Every experiment composes, and the ends of what it sweeps over can be built."""

from itertools import product
from pathlib import Path

import pytest
from conftest import ROOT, composed
from omegaconf import OmegaConf

from dnnvss.commands.train_settings import run_settings
from dnnvss.errors import DnnvssError
from dnnvss.runs.run import make_model
from dnnvss.runs.settings import RunSettings
from dnnvss.systems.registry import driven_by, read_system

CONF = ROOT / "conf"
EXPERIMENTS = sorted(p.stem for p in (CONF / "experiment").glob("*.yaml"))
MODELS = sorted(p.stem for p in (CONF / "model").glob("*.yaml") if p.stem != "auto")


def _swept(path: Path) -> dict[str, list[str]]:
    """Return what an experiment sweeps over: a setting to its first and last value."""
    params = OmegaConf.select(OmegaConf.load(path), "hydra.sweeper.params") or {}
    return {str(key): _split(str(values))[:: max(len(_split(str(values))) - 1, 1)] for key, values in params.items()}


def _split(values: str) -> list[str]:
    """Return values parted by the commas outside brackets."""
    parts, depth = [""], 0
    for letter in values:
        depth += (letter == "[") - (letter == "]")
        if letter == "," and not depth:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def chosen(*given: str) -> RunSettings:
    return run_settings(composed("train", *given))


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_the_runs_of_an_experiment_can_be_built(name: str) -> None:
    swept = _swept(CONF / "experiment" / f"{name}.yaml")
    for values in product(*swept.values()):
        own = [f"{key}={value}" for key, value in zip(swept, values, strict=True)]
        settings = chosen(f"experiment={name}", *own)
        assert make_model(settings, settings.task).table is settings.task.table


def given_by(name: str, key: str) -> list[RunSettings]:
    """The settings of each run of an experiment that sweeps over one setting."""
    values = OmegaConf.load(CONF / "experiment" / f"{name}.yaml").hydra.sweeper.params[key]
    return [chosen(f"experiment={name}", f"{key}={value}") for value in _split(str(values))]


def test_rates_keep_the_window_and_the_steps() -> None:
    runs = given_by("rates", "trajectory")
    assert [run.task.clock.rate for run in runs] == [30, 50, 100, 200]
    for run in runs:
        own = run.task.table.settings
        assert own.window_before == own.window_after == round(0.16 * float(run.task.clock.rate))
        assert (run.trainer["steps"], run.trainer["share"]) == (2700, 0.01)


def test_windows_and_segments_are_those_of_the_paper_and_around_it() -> None:
    def widths(runs: list[RunSettings], block: str, more: int) -> list[int]:
        tables = [run.task.table for run in runs]
        return [(t.slices[block].stop - t.slices[block].start) // 41 + more for t in tables]

    assert widths(given_by("windows", "labels.window_before"), "phone_window", 1) == [5, 9, 17, 25, 33, 49, 65]
    segments = given_by("segments", "labels.segment")
    assert widths(segments, "phone_context", 0) == [1, 3, 5, 7]
    assert segments[2].task.table.hash == chosen("labels=ph").task.table.hash


def test_units_are_chosen_by_models_of_the_units_themselves() -> None:
    for run in given_by("units_hsmm", "visemes.units"):
        assert run.task.table.settings.units == run.visemes["units"]
        assert (run.model_name, run.visemes["source"], run.visemes["training"]) == ("hsmm_visemes", "oracle", "oracle")


@pytest.mark.parametrize("name", sorted(p.stem for p in (CONF / "preset").glob("*.yaml")))
def test_a_preset_is_a_system_with_labels_that_it_reads(name: str) -> None:
    settings = chosen(f"preset={name}")
    assert make_model(settings, settings.task).reads >= settings.task.table.needs & {"sound", "visemes"}
    cls, _ = read_system(settings.model_name, settings.model)
    heard = name.startswith(("cca", "clusters", "segments", "voice"))
    assert driven_by(cls, settings.task.table) == ("voice and text" if name == "voice_text" else "voice" if heard else
                                                   "nothing" if name == "training_mean" else "text")


def test_systems_for_new_words_see_what_their_own_labels_tell() -> None:
    settings = chosen("preset=new_words")
    seen = {name: tuple(blocks) for name, blocks in settings.model["blocks"].items()}
    assert seen == {name: chosen(f"labels={labels}").task.table.names
                    for name, labels in (("network", "ph"), ("classes", "ph_class"))}


@pytest.mark.parametrize("wrong, message", [("trainer.share=2", "trainer.share=2 is too much"),
                                            ("model.members=0", "model.members=0 is too little")])
def test_a_setting_that_the_model_refuses_is_named_as_it_stands(wrong: str, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        chosen("model=feedforward", wrong)


@pytest.mark.parametrize("model", MODELS)
def test_a_model_that_does_not_look_at_dynamic_visemes_refuses_them(model: str) -> None:
    settings = chosen(f"model={model}", "labels=ph_dv")
    if "visemes" in read_system(model, settings.model)[0].reads:
        assert make_model(settings, settings.task).table is settings.task.table
    else:
        with pytest.raises(DnnvssError, match=f"model={model} does not look at the dynamic visemes.*labels=ph_d"):
            make_model(settings, settings.task)
