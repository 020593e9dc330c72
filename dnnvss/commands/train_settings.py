"""The typed root of ``conf/train.yaml``: all its settings with their types.

The command reads it before it does anything, so that a mistake in any setting is told at once.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from omegaconf import DictConfig

from dnnvss.commands.arguments import SettingsCommand
from dnnvss.commands.composed import plain_settings, typed_settings
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
        if named.system == AUTO:
            return cls(named.name, AutoSettings.read(value))
        return cls(named.name, read_system(named.name, value, where, f"{where}.fit")[1])

    @staticmethod
    def alternatives() -> tuple[Any, ...]:
        """The types of the settings of all systems."""
        return (Named, AutoSettings, *(system.Settings for system in systems().values()))


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
