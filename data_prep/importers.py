"""The importers by name, with the settings of each: what ``corpus.importer`` of ``conf/corpus`` may hold.

A new importer is a module with ``prepare_NAME(raw, out, ...)``, a settings dataclass here, and a file of
``conf/corpus``.
"""

import traceback
from collections.abc import Callable, Mapping
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass
from importlib import import_module
from inspect import Signature, signature
from pathlib import Path
from typing import Any, NoReturn

from dnnvss.errors import DnnvssError
from dnnvss.settings import read_settings, setting, shown
from dnnvss.shortages import shortage_of
from dnnvss.text.variants import VARIANTS


@dataclass(frozen=True, kw_only=True)
class OwnSettings:
    """Of recordings of one's own, of whatever kind."""

    kind: str
    name: str
    variant: str = setting("en_us", choices=VARIANTS)
    lexicon: Mapping[str, str] = setting({})
    credit: str = ""
    val: float = setting(0.05, least=0, below=1)
    test: float = setting(0.05, least=0, below=1)
    rate: int | float | str | None = None


@dataclass(frozen=True, kw_only=True)
class FolderSettings(OwnSettings):
    """Of :func:`data_prep.folder.prepare_folder`."""

    dim: int = setting(2, choices=(2, 3))
    sync: bool = False
    landmarker: str | None = None
    transcribe: bool = False


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
class MotionSettings(OwnSettings):
    """Of :func:`data_prep.motion.prepare_motion`."""

    jig: str | tuple[str, ...] = "jig"
    groups: Mapping[str, tuple[str, ...]] = setting({})


@dataclass(frozen=True, kw_only=True)
class SessionSettings:
    """Of :func:`data_prep.session.prepare_session`."""

    kind: str
    name: str
    form: str = setting("markers", choices=("markers", "curves"))
    sentences: int = setting(55, least=3, most=1000)
    held_out: int = setting(12, least=1, most=1000)
    seed: int = setting(0, least=0)


@dataclass(frozen=True, kw_only=True)
class FacegoodSettings:
    """Of :func:`data_prep.facegood.prepare_facegood`."""

    kind: str
    name: str


@dataclass(frozen=True, kw_only=True)
class DemoSettings:
    """Of :func:`data_prep.demo.prepare_demo`, which has no recordings to import."""

    sentences: int = setting(160, least=3, most=1000)
    seed: int = setting(0, least=0)
    size: int = setting(320, least=64, most=640)


IMPORTERS: dict[str, tuple[str, type]] = {
    "folder": ("data_prep.folder.prepare_folder", FolderSettings),
    "grid": ("data_prep.grid.prepare_grid", GridSettings),
    "motion": ("data_prep.motion.prepare_motion", MotionSettings),
    "session": ("data_prep.session.prepare_session", SessionSettings),
    "facegood": ("data_prep.facegood.prepare_facegood", FacegoodSettings),
}
"""The function of each importer and the type of its settings."""
DEMO = "data_prep.demo.prepare_demo"
"""What makes the corpus of the built-in talker."""
_OURS = (DEMO, *(function for function, _ in IMPORTERS.values()))


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
            DnnvssError: there is no such module or function, or the module cannot be run.
        """
        module, name = self.function.rsplit(".", 1)
        try:
            found: Callable[..., Any] = getattr(import_module(module), name)
        except Exception as error:  # a module of the user's may fail in any way
            raise DnnvssError(f"{self._named} cannot be imported ({_said(error)})",
                              remedy="Give MODULE.FUNCTION of a module that Python finds") from error
        if not callable(found):
            raise DnnvssError(f"{self._named} is no function", remedy="Give MODULE.FUNCTION")
        return found

    @property
    def looks(self) -> bool:
        """Whether the function can take a first look: it takes what is done ``then`` with what it found."""
        return "then" in signature(self.load()).parameters

    def call(self, out: Path, common: Mapping[str, Any]) -> None:
        """Let the function make the corpus.

        Args:
            out: the folder of the prepared corpus.
            common: arguments that it is given where it takes them.

        Raises:
            DnnvssError: what the function raises; of one of the user's own, that it takes other arguments, or what else
                goes wrong in it and where.
        """
        function = self.load()
        if self.function in _OURS:
            function(**self._arguments(signature(function), out, common))
            return
        try:
            known = signature(function)
            known.bind(**(given := self._arguments(known, out, common)))
        except (TypeError, ValueError) as error:
            raise DnnvssError(f"{self._named} does not take what it is given ({error})",
                              remedy="Let it take `out` and the settings of corpus.importer by name; raw, jobs, "
                              "backend and strict are given where it takes them") from error
        try:
            function(**given)
        except Exception as error:
            self._tell(error)

    def _arguments(self, known: Signature, out: Path, common: Mapping[str, Any]) -> dict[str, Any]:
        taken = {name: value for name, value in common.items() if name in known.parameters}
        return {"out": out, **taken, **self.settings}

    def _tell(self, error: Exception) -> NoReturn:
        """Raise what went wrong in a user's own importer, in words."""
        if isinstance(error, DnnvssError | BrokenExecutor):
            raise error
        if (short := shortage_of(error)) is not None:
            raise short from error
        last = traceback.extract_tb(error.__traceback__)[-1]
        raise DnnvssError(f"{self._named} failed in {last.filename}, line {last.lineno} ({_said(error)})",
                          remedy="Mend it; what was finished is kept") from error

    @property
    def _named(self) -> str:
        return f"corpus.importer.kind={self.function}"


def _said(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:300]
