"""The typed root of ``conf/prepare.yaml``, and the group ``corpus``, which training reads too."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from data_prep.importers import DEMO, DemoSettings, Importer
from dnnvss.errors import DnnvssError
from dnnvss.settings import read_settings, setting


@dataclass(frozen=True, kw_only=True)
class CorpusPlace:
    """A file of ``conf/corpus`` but for how it is made.

    Args:
        name: of the corpus.
        raw: the recordings.
        out: the folder of the prepared corpus.
        split: which split files are read; empty for the usual ones.
    """

    name: str
    raw: Path | None = None
    out: Path
    split: str = ""


@dataclass(frozen=True, kw_only=True)
class DemoCorpus(CorpusPlace, DemoSettings):
    """The built-in talker."""


@dataclass(frozen=True, kw_only=True)
class RecordedCorpus(CorpusPlace):
    """A corpus of recordings.

    Args:
        importer: how they are read.
    """

    importer: Importer


@dataclass(frozen=True)
class CorpusSettings:
    """The group ``corpus``: what it says in common, and the function that makes the corpus with its arguments."""

    common: CorpusPlace
    make: Importer

    @property
    def recorded(self) -> bool:
        """Whether the corpus is made of recordings."""
        return isinstance(self.common, RecordedCorpus)

    @classmethod
    def from_setting(cls, value: Any, where: str) -> "CorpusSettings":
        """The settings of either kind of corpus.

        Raises:
            DnnvssError: a wrong setting, or several corpora where one is meant.
        """
        if isinstance(value, Mapping) and "talkers" in value:
            raise DnnvssError(f"{where}=several is no corpus: it names some for one training",
                              remedy="Prepare each of them by itself, then dnnvss train corpus=[a,b]")
        if isinstance(value, Mapping) and value.get("importer") is not None:
            own = [f.name for f in fields(DemoSettings)]
            if set(own) <= set(value):
                raise DnnvssError(f"{where}.importer is no setting of the built-in talker, which has no recordings",
                                  remedy=f"Choose among {', '.join(f'{where}.{name}' for name in own)}")
            recorded = read_settings(RecordedCorpus, value, where)
            return cls(recorded, recorded.importer)
        demo = read_settings(DemoCorpus, {k: v for k, v in value.items() if k != "importer"}
                             if isinstance(value, Mapping) else value, where)
        if demo.name != "demo":
            raise DnnvssError(f"{where}.name={demo.name} names no importer",
                              remedy=f"Use corpus=folder corpus.name={demo.name}")
        return cls(demo, Importer(DEMO, {f.name: getattr(demo, f.name) for f in fields(DemoSettings)}))

    @staticmethod
    def alternatives() -> tuple[type, ...]:
        """The types of the settings."""
        return DemoCorpus, RecordedCorpus


@dataclass(frozen=True)
class PrepareSettings:
    """``conf/prepare.yaml``."""

    corpus: CorpusSettings
    jobs: int = setting(-1, least=-1, nonzero=True)
    backend: str = setting("loky", choices=("loky", "multiprocessing", "threading", "dask", "ray"))
    strict: bool = False
    look: bool = False
