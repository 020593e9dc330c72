"""The importers by name, with the settings of each: what ``corpus.importer`` of ``conf/corpus`` may hold.

A new importer is a module with ``prepare_NAME(raw, out, ...)``, a settings dataclass here, and a file of
``conf/corpus``.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from dnnvss.corpus import UNITS
from dnnvss.errors import DnnvssError
from dnnvss.settings import read_settings, setting, shown
from dnnvss.text.variants import VARIANTS


@dataclass(frozen=True, kw_only=True)
class FolderSettings:
    """Of :func:`data_prep.folder.prepare_folder`."""

    kind: str
    name: str
    variant: str = setting("en_us", choices=VARIANTS)
    lexicon: Mapping[str, str] = setting({})
    credit: str = ""
    val: float = setting(0.05, least=0, below=1)
    test: float = setting(0.05, least=0, below=1)
    dim: int = setting(2, choices=UNITS)
    rate: int | float | str | None = None
    sync: bool = False
    landmarker: str | None = None


@dataclass(frozen=True, kw_only=True)
class GridSettings:
    """Of :func:`data_prep.grid.prepare_grid`."""

    kind: str
    name: str
    variant: str = setting("en_gb", choices=VARIANTS)
    lexicon: Mapping[str, str] = setting({})
    sound_delay: Mapping[str, float] = setting({})
    word_slack: float = setting(0.25, least=0)
    sync: bool = True
    landmarker: str | None = None


@dataclass(frozen=True, kw_only=True)
class DemoSettings:
    """Of :func:`data_prep.demo.prepare_demo`, which has no recordings to import."""

    sentences: int = setting(160, least=3, most=1000)
    seed: int = setting(0, least=0)
    size: int = setting(320, least=64, most=640)


IMPORTERS: dict[str, tuple[str, type]] = {
    "folder": ("data_prep.folder.prepare_folder", FolderSettings),
    "grid": ("data_prep.grid.prepare_grid", GridSettings),
}
"""The function of each importer and the type of its settings."""
DEMO = "data_prep.demo.prepare_demo"
"""What makes the corpus of the built-in talker."""


@dataclass(frozen=True)
class Importer:
    """An importer and its settings: what the group ``corpus.importer`` holds.

    Args:
        function: ``module.function``.
        settings: its keyword arguments.
    """

    function: str
    settings: Mapping[str, Any]

    @classmethod
    def from_setting(cls, value: Any, where: str) -> "Importer":
        """The importer that a group of settings names by ``kind``.

        A name with dots is a function of the user's own, ``module.function``, which takes the other settings as they
        are.

        Raises:
            DnnvssError: an unknown importer, or a setting that it does not have.
        """
        if not isinstance(value, Mapping):
            raise DnnvssError(f"{where}={shown(value)} is no table of names and values",
                              remedy=f"Give {where}.kind=...")
        kind = value.get("kind")
        if isinstance(kind, str) and "." in kind:
            return cls(kind, {k: v for k, v in value.items() if k != "kind"})
        if "_target_" in value:
            raise DnnvssError(f"{where}._target_ is no setting", remedy=f"Did you mean {where}.kind?")
        if not isinstance(kind, str) or kind not in IMPORTERS:
            raise DnnvssError(f"{where}.kind={shown(kind)} is unknown",
                              remedy=f"Use {', '.join(IMPORTERS)} or your own importer's MODULE.FUNCTION")
        function, settings = IMPORTERS[kind]
        read = vars(read_settings(settings, value, where))
        return cls(function, {k: v for k, v in read.items() if k != "kind"})

    @staticmethod
    def alternatives() -> tuple[type, ...]:
        """The types of the settings."""
        return tuple(settings for _, settings in IMPORTERS.values())

    def load(self) -> Callable[..., Any]:
        """The function.

        Raises:
            DnnvssError: there is no such module or function.
        """
        module, name = self.function.rsplit(".", 1)
        try:
            found: Callable[..., Any] = getattr(import_module(module), name)
        except (ImportError, AttributeError) as error:
            raise DnnvssError(f"corpus.importer.kind={self.function} cannot be imported ({error})",
                              remedy="Give MODULE.FUNCTION of a module that Python finds") from error
        return found
