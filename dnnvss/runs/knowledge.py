"""What runs of other talkers know, as settings of a system that learns from it."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.runs.bundle import BundleIndex, is_bundle
from dnnvss.runs.files import RunFiles
from dnnvss.runs.settings import RunSettings
from dnnvss.settings import at_home

ADAPTED = "adapted"
"""The system that learns from sources."""


def with_knowledge(settings: RunSettings) -> RunSettings:
    """The settings of a run whose system, or whose candidates, know what the runs of other talkers have learnt.

    Where no run is named, candidates that learn from others are left out.

    Raises:
        DnnvssError: a run that cannot be learnt from, or a system that learns from nobody.
    """
    model, sources = settings.model, find_sources(settings)
    candidates = model.get("candidates")
    if isinstance(candidates, Mapping):
        known = {name: _told(own, sources) for name, own in candidates.items() if sources or not _learns(own)}
        return replace(settings, model={**model, "candidates": known})
    if sources and not _learns(model):
        raise DnnvssError(f"model={settings.model_name} learns nothing from other talkers",
                          remedy="Use model=auto or model=adapted, or leave knowledge= out")
    return replace(settings, model=_told(model, sources)) if sources else settings


def find_sources(settings: RunSettings) -> dict[str, dict[str, Any]]:
    """The runs that ``knowledge`` names as the setting ``sources`` of a system, by the names of their corpora.

    Raises:
        DnnvssError: a folder that is no finished run, one without weights, or one with other labels or another clock.
    """
    given = settings.knowledge or ()
    found: dict[str, dict[str, Any]] = {}
    for folder in (Path(at_home(name)) for name in ((given,) if isinstance(given, str) else given)):
        source = RunSettings.load(folder)
        _check_same(settings, source, folder)
        name = str(source.corpus["name"])
        name = name if name not in found else f"{name}-{len(found) + 1}"
        path = learnt(folder)
        found[name] = {"checkpoint": str(path.resolve()), "digest": files.digest(path), "model": dict(source.model)}
    return found


def source_files(settings: RunSettings) -> list[RunFiles]:
    """Where everything lies of the runs that the system of a run learns from."""
    return [RunFiles(Path(own["checkpoint"]).parent) for own in settings.model.get("sources", {}).values()]


def learnt(folder: Path) -> Path:
    """The file of what the system of a run or a bundle learnt, as weights.

    Raises:
        DnnvssError: there is none.
    """
    if not is_bundle(folder):
        path = RunFiles(folder).model
        if not path.is_file():
            raise DnnvssError("holds a run that has not ended", file=folder, remedy="Train it to its end first")
        return path
    path = BundleIndex.load(folder).check(folder)
    if path.suffix == ".onnx":
        raise DnnvssError("is a bundle without weights", file=folder,
                          remedy="Name the run that it came from, or export that with --network npz")
    return path


def _check_same(settings: RunSettings, source: RunSettings, folder: Path) -> None:
    """Hold the labels and the clock of a source to those of a run.

    Raises:
        DnnvssError: they differ.
    """
    if source.task.table.describe() != settings.task.table.describe():
        raise DnnvssError(f"was trained with labels={source.labels_name}, and this run is to have "
                          f"labels={settings.labels_name}", file=folder, remedy=f"Use labels={source.labels_name}")
    if source.task.clock != settings.task.clock:
        raise DnnvssError(f"has a clock of {source.trajectory.rate} frames a second, and this run is to have "
                          f"{settings.trajectory.rate}", file=folder,
                          remedy=f"Use trajectory.rate={source.trajectory.rate}")


def _told(model: Mapping[str, Any], sources: Mapping[str, Any]) -> dict[str, Any]:
    return {**model, "sources": dict(sources)} if _learns(model) else dict(model)


def _learns(model: Mapping[str, Any]) -> bool:
    return model.get("system", model.get("name")) == ADAPTED
