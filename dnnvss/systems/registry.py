"""Systems by name: every class of this package that declares one, built from plain settings.

A new system is a class in a module of this package, with ``system``, ``reads`` and ``Settings``, and a file of
``conf/model``. No list names it.
"""

import importlib
import pkgutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from functools import cache
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable
from dnnvss.settings import read_settings, unknown_setting
from dnnvss.systems.base import VisualModel
from dnnvss.timing import FrameClock
from dnnvss.training.settings import FitSettings

_WORDS = {"visemes": "dynamic visemes", "sound": "sound"}
"""Inputs that cost something to have; phones and words are there in every utterance."""


@dataclass(frozen=True)
class Named:
    """What every file of ``conf/model`` says: what the user calls a system, and which one it is."""

    name: str
    system: str | None = None

    @classmethod
    def of(cls, mapping: Mapping[str, Any], where: str) -> "Named":
        """The names in the settings of a system; other settings are left to that.

        Raises:
            DnnvssError: one of them is no text, or there is no name.
        """
        return read_settings(cls, {k: v for k, v in mapping.items() if k in ("name", "system")}, where)


def systems() -> dict[str, type[VisualModel]]:
    """Every system by its name in YAML."""
    return declared(VisualModel, "system")


def make_system(name: str, mapping: Mapping[str, Any], table: FeatureTable, clock: FrameClock) -> VisualModel:
    """The untrained system that settings describe.

    Args:
        name: what the user calls it, the name of a file of ``conf/model``.
        mapping: the settings in that file. ``system`` is the name of the class, which is ``name`` if left out.
        table: the feature table of the labels.
        clock: the trajectory clock.

    Raises:
        DnnvssError: no such system, a setting that it refuses, or labels with inputs that it does not read.
    """
    cls, settings = read_system(name, mapping)
    check_inputs(name, cls, table)
    return cls(table, clock, settings)


def read_system(name: str, mapping: Mapping[str, Any], where: str = "model",
                fit: str = "trainer") -> tuple[type[VisualModel], Any]:
    """The class of a system and its settings, read.

    Args:
        name, mapping: as for :func:`make_system`.
        where, fit: under which names a user gives them, and those of the fit among them.

    Raises:
        DnnvssError: no such system, or a setting that it refuses.
    """
    kind = str(mapping.get("system", name))
    cls = found(VisualModel, "system", kind)
    if cls is None:
        raise unknown_setting(f"{where}.system={kind}", [f"{where}.system={other}" for other in systems()])
    own = {k: v for k, v in mapping.items() if k not in ("name", "system")}
    if isinstance(own.get("fit"), Mapping) and "fit" in {f.name for f in fields(cls.Settings)}:
        own["fit"] = read_settings(FitSettings, own["fit"], fit)
    return cls, read_settings(cls.Settings, own, where)


def check_systems(given: Mapping[str, Mapping[str, Any]], where: str) -> None:
    """Hold the settings of several systems to what each of them takes.

    Args:
        given: name to the settings of a system, as in its file of ``conf/model``.
        where: under which name a user gives them.

    Raises:
        DnnvssError: a system that does not exist, or that refuses a setting.
    """
    for name, mapping in given.items():
        place = f"{where}.{name}"
        read_system(Named.of({"name": name, **mapping}, place).name, mapping, place, f"{place}.fit")


def check_inputs(name: str, cls: type[VisualModel], table: FeatureTable) -> None:
    """Refuse labels with inputs that a system does not read.

    Raises:
        DnnvssError: there are some.
    """
    for unread in sorted((table.needs & _WORDS.keys()) - cls.reads):
        raise DnnvssError(f"model={name} does not look at the {_WORDS[unread]} of the labels",
                          remedy="Train it with labels of phones (labels=ph_d), or take a network (model=feedforward)")


INPUTS = ("text", "voice", "voice and text", "nothing")
"""What may drive a system, in the order of tables."""


def driven_by(cls: type[VisualModel], table: FeatureTable) -> str:
    """Which of :data:`INPUTS` a system goes by with the labels of a table.

    Phones, words and dynamic visemes are text, also where their times come from a recording.
    """
    seen = (table.needs & cls.reads) | cls.looks_up
    parts = (["voice"] if "sound" in seen else []) + (["text"] if seen - {"sound"} else [])
    return " and ".join(parts) or "nothing"


def null_systems(table: FeatureTable, clock: FrameClock) -> dict[str, VisualModel]:
    """The untrained null models by title, which look at none of the columns of the table."""
    return {name.replace("_", " "): cls(table, clock) for name, cls in systems().items() if cls.null}


def found(base: type, name: str, value: str) -> type[Any] | None:
    """The subclass of ``base`` whose class variable ``name`` is ``value``, None where there is none.

    The module of that name is looked into first: most have one, and then no other is imported.
    """
    package = importlib.import_module(__package__)
    if value in _modules(tuple(package.__path__)):
        own = vars(importlib.import_module(f"{package.__name__}.{value}")).values()
        for cls in own:
            if isinstance(cls, type) and issubclass(cls, base) and vars(cls).get(name) == value:
                return cls
    return declared(base, name).get(value)


def declared(base: type, name: str) -> dict[str, type[Any]]:
    """The subclasses of ``base`` that declare the class variable ``name``, by its value, in order of definition.

    All modules of this package are imported first.
    """
    package = importlib.import_module(__package__)
    _import_all(package.__name__, tuple(package.__path__))
    return {vars(cls)[name]: cls for cls in _subclasses(base) if name in vars(cls)}


@cache
def _modules(folders: tuple[str, ...]) -> frozenset[str]:
    """The names of the modules in the folders of a package: listed once, as the settings of a run name many systems."""
    return frozenset(module.name for module in pkgutil.iter_modules(folders))


@cache
def _import_all(package: str, folders: tuple[str, ...]) -> None:
    """Import all modules of a package, once: to look for them takes longer than to read the settings of a system."""
    for module in pkgutil.walk_packages(folders, f"{package}."):
        importlib.import_module(module.name)


def _subclasses(base: type) -> Iterator[type[Any]]:
    cls: type[Any]
    for cls in base.__subclasses__():
        yield cls
        yield from _subclasses(cls)
