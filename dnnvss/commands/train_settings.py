"""The typed root of ``conf/train.yaml``: all its settings with their types.

The command reads it before it does anything, so that a mistake in any setting is told at once.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from omegaconf import DictConfig

from dnnvss.commands.arguments import SettingsCommand
from dnnvss.commands.composed import plain_settings, typed_settings
from dnnvss.commands.conf import choices, conf_folder, read_file
from dnnvss.commands.prepare_settings import CorpusSettings
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.choice import AUTO, AutoSettings
from dnnvss.face.aam import AAMConfig
from dnnvss.face.kinds import FACES, read_face_settings
from dnnvss.features import FeatureTable
from dnnvss.runs.settings import RunOptions, RunSettings
from dnnvss.settings import read_settings, shown
from dnnvss.systems.registry import Named, read_system, systems
from dnnvss.systems.viseme_plan import UnitPlan
from dnnvss.training import FitSettings


@dataclass(frozen=True)
class FaceGroup:
    """The group ``face``: the kind of a face, and settings of that kind."""

    settings: Any

    @classmethod
    def from_setting(cls, value: Any, where: str) -> "FaceGroup":
        """The settings of the kind that a group names.

        Raises:
            DnnvssError: an unknown kind, or a setting that it refuses.
        """
        if not isinstance(value, Mapping):
            raise DnnvssError(f"{where}={shown(value)} is no table of names and values",
                              remedy=f"Give {where}.kind=...")
        kind = value.get("kind")
        if not isinstance(kind, str) or kind not in FACES:
            raise DnnvssError(f"{where}.kind={shown(kind)} is unknown", remedy=f"Use one of {', '.join(FACES)}")
        return cls(read_face_settings(kind, {k: v for k, v in value.items() if k != "kind"}))

    @staticmethod
    def alternatives() -> tuple[Any, ...]:
        """Any settings: they depend on the kind."""
        return (Mapping[str, Any],)


@dataclass(frozen=True)
class SystemSettings:
    """The group ``model``: a system by name, and what it lets one set."""

    name: str
    settings: Any

    @classmethod
    def from_setting(cls, value: Any, where: str) -> "SystemSettings":
        """The settings of the system that a group names.

        Raises:
            DnnvssError: an unknown system, or a setting that it refuses.
        """
        if not isinstance(value, Mapping):
            raise DnnvssError(f"{where}={shown(value)} is no table of names and values",
                              remedy=f"Give {where}.system=...")
        named = Named.of(value, where)
        try:
            if named.system == AUTO:
                return cls(named.name, AutoSettings.read(value))
            return cls(named.name, read_system(named.name, value, where, f"{where}.fit")[1])
        except DnnvssError:
            _refuse_of_another(named.name, value, where)
            raise

    @staticmethod
    def alternatives() -> tuple[Any, ...]:
        """The types of the settings of all systems."""
        return (Named, AutoSettings, *(system.Settings for system in systems().values()))


def _refuse_of_another(name: str, given: Mapping[str, Any], where: str) -> None:
    """Refuse the first setting that other systems have and this one has not.

    Args:
        name: of the system, that of a file of ``conf/model``.
        given: its settings.
        where: the group.
    """
    kinds: dict[str, Any] = {AUTO: AutoSettings, **{kind: system.Settings for kind, system in systems().items()}}
    known = {choice: [f.name for f in fields(kinds[_kind(choice)]) if f.init]
             for choice in choices([conf_folder()], "model")}
    for key in (key for key in given if key not in ("name", "system", *known.get(name, given))):
        if others := [choice for choice, settings in known.items() if key in settings]:
            own = ", ".join(f"{where}.{own}" for own in known[name])
            raise DnnvssError(f"{where}.{key} is no setting of {where}={name}, which has {own or 'none'}",
                              remedy=f"Leave it out, or take one of {where}={', '.join(others)}")


def _kind(choice: str) -> str:
    """The system that a file of ``conf/model`` names, or that which it builds on."""
    own = read_file(conf_folder() / "model" / f"{choice}.yaml")
    above = [entry for entry in own.get("defaults", []) if "@" not in entry and entry != "_self_"]
    return str(own.get("system") or (_kind(above[0]) if above else choice))


@dataclass(frozen=True, kw_only=True)
class TrainSettings(RunOptions):
    """``conf/train.yaml``: each group with the types of the room that it belongs to."""

    corpus: CorpusSettings
    face: FaceGroup
    aam: AAMConfig
    labels: FeatureTable
    visemes: UnitPlan
    trainer: FitSettings
    model: SystemSettings


COMMAND = SettingsCommand("train", "train", TrainSettings, bare="run")


def run_settings(config: DictConfig) -> RunSettings:
    """The settings of a run that composed settings describe.

    Raises:
        UsageError: a name, type, range or choice that is wrong, in whichever group.
    """
    typed_settings(COMMAND, config)
    return read_settings(RunSettings, plain_settings(config), "")
