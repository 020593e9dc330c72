"""What a file of ``conf/visemes`` asks for: how units are learnt and predicted, and where an utterance has them from.

Units that are cut from an utterance's own video are *oracle* units: nobody has them at synthesis. Units that come from
text and phone times alone are *predicted*.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable
from dnnvss.settings import check_settings, read_settings, setting
from dnnvss.systems.viseme_network import HEEDED
from dnnvss.training import FitSettings
from dnnvss.training.settings import SHARING
from dnnvss.visemes import DecodingSettings, VisemeSettings

_ALGORITHM = 2
"""Raised when the code changes what it computes, so that old caches are not taken for new."""
SOURCES = {"predicted": "dynamic visemes predicted from text",
           "oracle": "dynamic visemes cut from the test video (oracle)"}
TRAINING = ("oracle", "predicted", "mixed")


@dataclass(frozen=True, kw_only=True)
class PredictorFile:
    """The part ``predictor`` of a file of ``conf/visemes``; see :class:`PredictorSettings`."""

    folds: int = setting(least=2)
    hidden: tuple[int, ...] = setting(least=1)
    dropout: float = setting(least=0, below=1)
    fit: Mapping[str, Any] = setting(doc="some of HEEDED")
    decoding: DecodingSettings = setting()
    window_before: int = setting(least=0)
    window_after: int = setting(least=0)
    blocks: tuple[str, ...] = setting(doc="of phones")


@dataclass(frozen=True)
class PredictorSettings:
    """How dynamic visemes are predicted from phones.

    Args:
        table: the columns that the network reads.
        fit: how it is fitted.
        decoding: weights of the decoder.
        hidden: width of its layers.
        dropout: share of active columns left out in training.
        folds: training clips are predicted by as many networks, each fitted without them.
    """

    table: FeatureTable
    fit: FitSettings
    decoding: DecodingSettings
    hidden: tuple[int, ...]
    dropout: float
    folds: int

    @classmethod
    def of(cls, given: PredictorFile, where: str = "visemes.predictor") -> "PredictorSettings":
        """What a file asks for.

        Raises:
            DnnvssError: blocks of dynamic visemes among those that are to predict them, or a setting of the fit that
                would not be heeded.
        """
        for name in given.fit:
            if name not in HEEDED:
                raise DnnvssError(f"{where}.fit.{name} is no setting of this fit",
                                  remedy=f"Use some of {', '.join(HEEDED)}")
        window = {"window_before": given.window_before, "window_after": given.window_after}
        table = FeatureTable.from_config({**window, "blocks": list(given.blocks)})
        if table.needs - {"phones", "words"}:
            raise DnnvssError(f"{where}.blocks: dynamic visemes are predicted from phones",
                              remedy="Leave viseme blocks out")
        fit = read_settings(FitSettings, given.fit, f"{where}.fit")
        return cls(table, fit, given.decoding, given.hidden, given.dropout, given.folds)


@dataclass(frozen=True, kw_only=True)
class UnitFile(VisemeSettings):
    """A file of ``conf/visemes``: how units are learnt, and what :class:`UnitPlan` has beside that."""

    name: str
    source: str = setting(choices=SOURCES)
    training: str = setting(choices=TRAINING)
    samples: int = setting(least=0)
    predictor: PredictorFile


@dataclass(frozen=True)
class UnitPlan:
    """What ``conf/visemes`` asks for.

    Args:
        learning: how units are learnt.
        predictor: how they are predicted.
        source: whence an utterance has its units when it is tested or spoken: one of :data:`SOURCES`.
        training: whence in training: one of :data:`TRAINING`.
        samples: how many sequences are drawn beside the most likely one when an utterance is tested or spoken; the
            network averages over all of them.

    Raises:
        DnnvssError: a word that is not known, or fewer samples than none.
    """

    learning: VisemeSettings
    predictor: PredictorSettings
    source: str = setting(choices=SOURCES)
    training: str = setting(choices=TRAINING)
    samples: int = setting(least=0)

    def __post_init__(self) -> None:
        check_settings(self, "visemes")

    @classmethod
    def from_config(cls, config: Mapping[str, Any]) -> "UnitPlan":
        """The plan of a file of ``conf/visemes``."""
        return cls.from_setting(config, "visemes")

    @classmethod
    def from_setting(cls, value: Any, where: str) -> "UnitPlan":
        """The plan that a group of settings holds.

        Raises:
            DnnvssError: a setting that there is not, or a value of another type, range or choice.
        """
        given = read_settings(UnitFile, value, where)
        learning = VisemeSettings(**{f.name: getattr(given, f.name) for f in fields(VisemeSettings)})
        predictor = PredictorSettings.of(given.predictor, f"{where}.predictor")
        return cls(learning, predictor, given.source, given.training, given.samples)

    @staticmethod
    def alternatives() -> tuple[type, ...]:
        """The types of the settings."""
        return (UnitFile,)

    @property
    def key(self) -> str:
        """A hash of what the units and their prediction depend on."""
        p = self.predictor
        fit = {name: value for name, value in asdict(p.fit).items() if name not in SHARING}
        made = [_ALGORITHM, asdict(self.learning), p.table.hash, fit, asdict(p.decoding), p.hidden, p.dropout,
                p.folds, self.samples]
        return hashlib.sha256(json.dumps(made).encode()).hexdigest()[:12]
