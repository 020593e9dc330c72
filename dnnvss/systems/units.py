"""Dynamic visemes of a run: learnt on its training clips, predicted from text, kept with the corpus and in the run.

Units that are cut from an utterance's own video are *oracle* units: nobody has them at synthesis. Units that come from
text and phone times alone are *predicted*. Training utterances get predicted units from predictors that have not seen
them, so that a network can learn to live with their errors.
"""

import contextlib
import hashlib
import json
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import torch
from tqdm import tqdm

from dnnvss import files
from dnnvss.corpus import Corpus, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.features import FeatureTable, FrameCodes, encode
from dnnvss.settings import check_settings, read_settings, setting
from dnnvss.systems.base import Example
from dnnvss.systems.examples import SPLITS
from dnnvss.systems.unit_network import HEEDED, UnitNetwork, VisemePredictor, unit_sequence, unit_targets
from dnnvss.timing import Alignment, FrameClock, Tier
from dnnvss.training import FitSettings
from dnnvss.training.checkpoints import load_checkpoint, save_checkpoint
from dnnvss.training.devices import process_number
from dnnvss.training.settings import SHARING
from dnnvss.visemes import DecodingSettings, Grammar, Visemes, VisemeSettings, gesture_view, learn, unit_scores
from dnnvss.visemes.corpus import viseme_clips

_ALGORITHM = 2
"""Raised when the code changes what it computes, so that old caches are not taken for new."""
SOURCES = {"predicted": "dynamic visemes predicted from text",
           "oracle": "dynamic visemes cut from the test video (oracle)"}
TRAINING = ("oracle", "predicted", "mixed")


@dataclass(frozen=True)
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
    decoding: DecodingSettings = setting()
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


@dataclass(frozen=True)
class UnitModel:
    """The units of a talker and their predictor.

    Args:
        visemes: the units.
        predictor: text to units.
        samples: see :class:`UnitPlan`.
    """

    visemes: Visemes
    predictor: VisemePredictor
    samples: int

    def tiers(self, utterance: Utterance, codes: FrameCodes | None = None) -> list[Tier]:
        """Return the predicted tiers of an utterance: the most likely one, and as many more as ``samples`` says."""
        alignment = utterance.alignment
        if codes is None:
            codes = encode(alignment, utterance.text, self.predictor.network.table, self.predictor.clock)
        drawn = self.predictor.samples(codes, alignment, self.samples) if self.samples else []
        return [self.predictor.tier(codes, alignment), *drawn]

    def save(self, path: Path) -> None:
        """Write tensors and plain containers."""
        p = self.predictor
        save_checkpoint(path, _tensors({
            "visemes": self.visemes.describe(), "network": p.network.state(), "grammar": p.grammar.describe(),
            "decoding": asdict(p.decoding), "clock": str(p.clock), "samples": self.samples}))

    @classmethod
    def load(cls, path: Path) -> "UnitModel":
        """Return what :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing or damaged.
        """
        s = load_checkpoint(path)
        predictor = VisemePredictor(UnitNetwork.from_state(s["network"]), Grammar.from_description(s["grammar"]),
                                    DecodingSettings(**s["decoding"]), FrameClock(s["clock"]))
        return cls(Visemes.from_description(s["visemes"]), predictor, s["samples"])


@dataclass(frozen=True)
class CorpusUnits:
    """The dynamic visemes of a corpus.

    Args:
        model: units and predictor, from the training utterances.
        oracle: the tier cut from the video, of each utterance by id.
        predicted: those predicted from text; of training utterances the most likely one alone.
    """

    model: UnitModel
    oracle: dict[str, Tier]
    predicted: dict[str, list[Tier]]

    def tiers(self, plan: UnitPlan, train: Iterable[str]) -> dict[str, list[Tier]]:
        """Return the tiers that each utterance has under a plan; ``train`` are the training utterances."""
        learning = set(train)
        return {i: self._tiers(i, plan.training if i in learning else plan.source) for i in self.oracle}

    def other_source(self, plan: UnitPlan) -> tuple[str, dict[str, list[Tier]]]:
        """Return the source that the plan does not use, one of :data:`SOURCES`, and the tiers that it gives."""
        other = "oracle" if plan.source == "predicted" else "predicted"
        return other, {i: self._tiers(i, other) for i in self.oracle}

    def _tiers(self, utterance: str, source: str) -> list[Tier]:
        oracle, predicted = [self.oracle[utterance]], self.predicted[utterance]
        return {"oracle": oracle, "predicted": predicted, "mixed": oracle + predicted}[source]


def corpus_units(corpus: Corpus, encoded: EncodedCorpus, variant: str, clock: FrameClock, plan: UnitPlan,
                 scratch: Path | None = None) -> CorpusUnits:
    """Return the dynamic visemes of a corpus; they are kept beside its encoding for later runs.

    Args:
        corpus: with phone times.
        encoded: its parameters of a face.
        variant: of the splits; units and predictor are learnt on the training split alone.
        clock: of the trajectories.
        plan: see :class:`UnitPlan`; ``source`` and ``training`` do not matter here.
        scratch: folder of this run alone, in which fits that are killed leave what they need to go on.
    """
    folder = corpus.root / "visemes" / f"{encoded.key}-{plan.key}-{str(clock).replace('/', '_')}"
    if not (folder / "tiers.json").is_file():
        with _place_of_fits(scratch, folder.name) as fits:
            made = _learn(corpus, encoded, variant, clock, plan, fits)
        made.model.save(folder / "units.pt")
        files.write_json(folder / "tiers.json", {i: {"oracle": _plain(made.oracle[i]),
                                                     "predicted": [_plain(t) for t in made.predicted[i]]}
                                                 for i in made.oracle})
    return _kept(folder)  # also where they are new, so that a run that goes on from here has the same ones


@contextlib.contextmanager
def _place_of_fits(scratch: Path | None, name: str) -> Iterator[Path]:
    """A folder for the fits of this process, deleted once all of them have ended."""
    if scratch is None:
        with tempfile.TemporaryDirectory() as temporary:
            yield Path(temporary)
        return
    place = scratch / f"visemes-{name}-{process_number()}"  # processes that share a run make units each
    yield place
    shutil.rmtree(place, ignore_errors=True)


def _kept(folder: Path) -> CorpusUnits:
    kept = files.read_json(folder / "tiers.json")
    return CorpusUnits(UnitModel.load(folder / "units.pt"), {i: _tier(t["oracle"]) for i, t in kept.items()},
                       {i: [_tier(x) for x in t["predicted"]] for i, t in kept.items()})


def _learn(corpus: Corpus, encoded: EncodedCorpus, variant: str, clock: FrameClock, plan: UnitPlan,
           folder: Path) -> CorpusUnits:
    clips = {name: viseme_clips(corpus.split(name, variant), encoded, clock) for name in SPLITS}
    visemes = learn(list(clips["train"].values()), clock, plan.learning,
                    gesture_view(encoded.face, plan.learning.gestures))
    print(f"dynamic visemes: {len(visemes)} units from {len(clips['train'])} utterances")
    oracle = {i: visemes.tier(clip) for part in clips.values() for i, clip in part.items()}
    codes = {i: encode(corpus.utterances[i].alignment, corpus.utterances[i].text, plan.predictor.table, clock)
             for i in oracle}
    train, val = list(clips["train"]), list(clips["val"])
    if len(train) < plan.predictor.folds or not val:
        raise DnnvssError(f"{len(train)} training and {len(val)} validation utterances are too few to predict dynamic "
                          f"visemes in {plan.predictor.folds} folds", file=corpus.root,
                          remedy="Record more, lower visemes.predictor.folds, or train with labels of phones alone")
    predicted: dict[str, list[Tier]] = {}

    steps = tqdm(range(plan.predictor.folds + 1), "predicting dynamic visemes", unit=" fits", leave=False)
    for fold in steps:
        held = set(train[fold :: plan.predictor.folds]) if fold < plan.predictor.folds else set()
        seen = [i for i in train if i not in held]
        predictor = _fit_predictor(seen, val, codes, oracle, len(visemes), clock, plan.predictor,
                                   folder / f"fold_{fold + 1}")
        predicted |= {i: [predictor.tier(codes[i], corpus.utterances[i].alignment)] for i in held}
    model = UnitModel(visemes, predictor, plan.samples)
    predicted |= {i: model.tiers(corpus.utterances[i], codes[i]) for i in oracle if i not in predicted}
    return CorpusUnits(model, oracle, predicted)


def _fit_predictor(train: Sequence[str], val: Sequence[str], codes: Mapping[str, FrameCodes],
                   oracle: Mapping[str, Tier], units: int, clock: FrameClock,
                   settings: PredictorSettings, folder: Path) -> VisemePredictor:
    seen, held = ([(codes[i], unit_targets(oracle[i], clock)) for i in ids] for ids in (train, val))
    network = UnitNetwork.fit(seen, held, units, settings.hidden, settings.dropout, settings.fit, folder)
    grammar = Grammar.of([unit_sequence(oracle[i], clock) for i in train], units)
    return VisemePredictor(network, grammar, settings.decoding, clock)


def unit_notes(units: CorpusUnits, plan: UnitPlan, test: Sequence[Example]) -> tuple[list[str], dict[str, Any]]:
    """Return what the page of results has to say about units, and the numbers in it.

    The first note tells whence the units are that the sentences were tested with. The second tells how well those that
    are predicted from text agree with those cut from the video, whichever were used.
    """
    clock, predictor = units.model.predictor.clock, units.model.predictor
    pairs = [(predictor.tier(e.codes, e.alignment), units.oracle[e.id]) for e in test]
    s = unit_scores(pairs, clock)
    agreement = {"frames": s.frames, "moving": s.moving, "sequence": s.sequence, "error": s.error,
                 "f1": {str(n): value for n, value in s.f1.items()}}
    numbers = {"source": plan.source, "training": plan.training, "samples": plan.samples,
               "units": len(units.model.visemes), "predicted": agreement}
    f1 = ", ".join(f"{value:.3f} within {n} frames" for n, value in s.f1.items())
    text = (f"{len(units.model.visemes)} dynamic visemes, learnt from {plan.training} units. Those predicted from "
            f"text, against those cut from the test video: right in {s.frames:.3f} of all frames and {s.moving:.3f} of "
            f"those in which the face moves, sequence accuracy {s.sequence:.3f}, boundary F1 {f1} of {clock} a second, "
            f"boundary error {s.error:.1f} ms.")
    return [SOURCES[plan.source], text], numbers


def _plain(tier: Tier) -> dict[str, Any]:
    """A tier as plain containers, its edges to the last bit: rounded ones can fall into other frames."""
    return {"edges": tier.edges.tolist(), "labels": list(tier.labels)}


def _tier(plain: Mapping[str, Any]) -> Tier:
    return Alignment.from_json({"visemes": dict(plain)})["visemes"]


def _tensors(value: Any) -> Any:
    """Return nested containers with their arrays as tensors."""
    if isinstance(value, dict):
        return {key: _tensors(v) for key, v in value.items()}
    return torch.from_numpy(value) if isinstance(value, np.ndarray) else value
