"""The dynamic visemes of a corpus: learnt on its training clips, predicted from text, kept beside its face's codes.

Training utterances get predicted units from predictors that have not seen them, so that a network can learn to live
with their errors.
"""

import contextlib
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dnnvss import files, staging
from dnnvss.corpus import SPLITS, Corpus
from dnnvss.errors import DnnvssError
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.features import FrameCodes, encode
from dnnvss.progress import counted
from dnnvss.systems.viseme_network import UnitNetwork, unit_sequence, unit_targets
from dnnvss.systems.viseme_plan import PredictorSettings, UnitPlan
from dnnvss.systems.viseme_predictor import UnitModel, VisemePredictor
from dnnvss.timing import Alignment, FrameClock, Tier
from dnnvss.training.devices import process_number
from dnnvss.visemes import Grammar, gesture_view, learn
from dnnvss.visemes.corpus import learnt_from, viseme_clips


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
        with staging.scratch() as folder:
            yield folder
        return
    place = scratch / f"visemes-{name}-{process_number()}"  # processes that share a run make units each
    yield place
    shutil.rmtree(place, ignore_errors=True)


def _kept(folder: Path) -> CorpusUnits:
    def tiers(path: Path) -> tuple[dict[str, Tier], dict[str, list[Tier]]]:
        kept = files.read_json(path)
        return ({i: _tier(t["oracle"]) for i, t in kept.items()},
                {i: [_tier(x) for x in t["predicted"]] for i, t in kept.items()})

    oracle, predicted = files.read(folder / "tiers.json", tiers, f"Delete {folder} and run the command again")
    return CorpusUnits(UnitModel.load(folder / "units.pt"), oracle, predicted)


def _learn(corpus: Corpus, encoded: EncodedCorpus, variant: str, clock: FrameClock, plan: UnitPlan,
           folder: Path) -> CorpusUnits:
    splits = {name: corpus.split(name, variant) for name in SPLITS}
    clips = [clip for _, clip in viseme_clips(learnt_from(splits["train"], encoded), encoded, clock)]
    visemes = learn(clips, clock, plan.learning, gesture_view(encoded.face, plan.learning.gestures))
    print(f"dynamic visemes: {len(visemes)} units from {len(clips)} utterances")
    del clips
    tiers = {name: {i: visemes.tier(clip) for i, clip in viseme_clips(part, encoded, clock)}
             for name, part in splits.items()}
    oracle = {i: tier for part in tiers.values() for i, tier in part.items()}
    codes = {i: encode(corpus.utterances[i].alignment, corpus.utterances[i].text, plan.predictor.table, clock)
             for i in oracle}
    train, val = list(tiers["train"]), list(tiers["val"])
    if len(train) < plan.predictor.folds or not val:
        raise DnnvssError(f"{len(train)} training and {len(val)} validation utterances are too few to predict dynamic "
                          f"visemes in {plan.predictor.folds} folds", file=corpus.root,
                          remedy="Record more, lower visemes.predictor.folds, or train with labels of phones alone")
    predicted: dict[str, list[Tier]] = {}

    steps = counted(range(plan.predictor.folds + 1), "predicting dynamic visemes", unit="fits")
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


def _plain(tier: Tier) -> dict[str, Any]:
    """A tier as plain containers, its edges to the last bit: rounded ones can fall into other frames."""
    return {"edges": tier.edges.tolist(), "labels": list(tier.labels)}


def _tier(plain: Mapping[str, Any]) -> Tier:
    return Alignment.from_json({"visemes": dict(plain)})["visemes"]
