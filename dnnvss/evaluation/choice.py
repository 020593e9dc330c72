"""Which system suits the footage: ``model=auto``, by minutes of speech and by cross-validation."""

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.corpus import Corpus
from dnnvss.curves import mlpg
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.bench import leading
from dnnvss.evaluation.cells import number
from dnnvss.evaluation.report import evaluate
from dnnvss.face.base import Face, moving
from dnnvss.formats.tables import aligned
from dnnvss.phones.contexts import spoken_seconds
from dnnvss.records import read_record
from dnnvss.runs.fitting import Material, encode, gather
from dnnvss.runs.folds import fewest_folds, folded, speech
from dnnvss.runs.knowledge import with_knowledge
from dnnvss.runs.naming import system_that_counts, what_counts
from dnnvss.runs.settings import RunSettings
from dnnvss.settings import check_settings, read_settings, setting
from dnnvss.staging import scratch
from dnnvss.systems import Example, VisualModel
from dnnvss.systems.examples import Task, speech_frames
from dnnvss.systems.registry import check_systems, make_system

AUTO = "auto"
_SIMPLER = 0.002
"""Of correlation: what is not better by this much than a candidate before it is not chosen over that."""
_REMEDY = "Delete it and run the command again"


@dataclass(frozen=True)
class AutoSettings:
    """Which systems are tried, and when.

    Args:
        candidates: name to the settings of a system, as in its file of ``conf/model``; the simplest first.
        large: the candidate that is taken without a trial where there is much to learn from.
        enough: minutes of speech that are much.
        networks: minutes of speech from which networks are tried: with less they learn no more than the means of
            phones, and take longest.
        steps: optimisation steps that a network takes at least where it is tried, see :class:`FitSettings`.
        folds: parts of the training sentences, each predicted by systems that were fitted without it.
    """

    candidates: Mapping[str, Mapping[str, Any]] = setting()
    large: str = "feedforward"
    enough: float = setting(4.0, least=0)
    networks: float = setting(2.0, least=0)
    steps: int = setting(2000, least=0)
    folds: int = setting(5, least=2)

    def __post_init__(self) -> None:
        check_settings(self, "model")
        check_systems(self.candidates, "model.candidates")
        if self.large not in self.candidates:
            raise DnnvssError(f"model.large={self.large} is none of the candidates",
                              remedy=f"Use one of {', '.join(self.candidates)}")

    @classmethod
    def read(cls, mapping: Mapping[str, Any]) -> "AutoSettings":
        """The settings in a file of ``conf/model``, where ``system`` is ``auto``."""
        return read_settings(cls, {k: v for k, v in mapping.items() if k not in ("name", "system")}, "model")


@dataclass(frozen=True)
class Trial:
    """What a candidate was worth: mean correlation and RMSE over the sentences, and the seconds that it took."""

    correlation: float
    rmse: float
    seconds: float


@dataclass(frozen=True)
class Choice:
    """Which system was chosen, and why.

    Args:
        system: its name among the candidates.
        reason: in words.
        minutes: of speech in the training sentences.
        sentences: training sentences.
        trials: what each candidate that was tried was worth; empty where nothing was tried.
    """

    system: str
    reason: str
    minutes: float
    sentences: int
    trials: Mapping[str, Trial]

    @property
    def text(self) -> str:
        """The table of the trials, and the reason."""
        rows = [[name, number(t.correlation), number(t.rmse), f"{t.seconds:.1f}"] for name, t in self.trials.items()]
        table = aligned(["tried on the training sentences", "correlation", "RMSE", "seconds"], rows) if rows else ""
        return "\n".join(filter(None, [table, f"model=auto takes {self.system}: {self.reason}"]))

    def save(self, path: Path) -> Path:
        """Write the choice as JSON and return the path."""
        return files.write_json(path, asdict(self))


def settled(settings: RunSettings, corpus: Corpus) -> tuple[RunSettings, Choice | None]:
    """The settings of a run with the system that it is to have, and how that was chosen where it was to be.

    What other talkers' runs know is filled in first.

    The choice is kept beside the encoding of the corpus, and so is each trial as it ends: the next command finds them.

    Raises:
        DnnvssError: no candidate reads the labels.
    """
    settings = with_knowledge(settings)
    if settings.model.get("system") != AUTO:
        return settings, None
    auto = AutoSettings.read(settings.model)
    choice = choose(settings, auto, corpus)
    mapping = auto.candidates[choice.system]
    return replace(settings, model=_fitting(mapping, auto) if choice.trials else mapping), choice


def largest(settings: RunSettings) -> RunSettings:
    """The settings of a run with the candidate that is taken where there is much to learn from, where it was to be
    chosen: several talkers share a network, however little each of them has said.

    It is fitted by steps, as where it is tried.
    """
    if settings.model.get("system") != AUTO:
        return settings
    auto = AutoSettings.read(settings.model)
    return replace(settings, model=_fitting(auto.candidates[auto.large], auto))


def choose(settings: RunSettings, auto: AutoSettings, corpus: Corpus) -> Choice:
    """The system that suits the training sentences of a corpus."""
    sentences = corpus.split("train", settings.split)
    minutes = spoken_seconds(u.alignment for u in sentences) / 60
    able = _able(settings.task, auto.candidates)
    if auto.large in able and minutes >= auto.enough:
        reason = (f"{minutes:.0f} minutes of speech are enough for a network; from {auto.enough:g} on nothing else is "
                  "tried")
        return Choice(auto.large, reason, minutes, len(sentences), {})
    if len(able) == 1:
        return Choice(able[0], "no other candidate reads these labels", minutes, len(sentences), {})
    encoded = encode(settings, corpus)
    return tried(gather(settings, corpus, encoded), auto, able, encoded.folder / "choices")


def tried(material: Material, auto: AutoSettings, able: Sequence[str], folder: Path) -> Choice:
    """The best of some candidates in a cross-validation; each trial is kept in ``folder`` as it ends."""
    settings, train = material.settings, material.examples["train"]
    minutes = speech(train) / 60
    tries = [name for name in able if minutes >= auto.networks or not _networks(auto.candidates[name])] or list(able)
    if len(train) < 3:
        name = tries[0]
        return Choice(name, f"{len(train)} training sentences are too few to try others", minutes, len(train), {})
    path = folder / f"{_key(material, auto)}.json"
    kept = dict(read_record(_Kept, path, _REMEDY).trials) if path.is_file() else {}
    for name in tries:
        if name not in kept:
            print(f"model=auto tries {name}", flush=True)
            mapping, folds = _fitting(auto.candidates[name], auto), _folds(auto, minutes, len(train))
            kept[name] = trial(settings.task, mapping, name, train, folds, material.encoded.face)
            files.write_json(path, asdict(_Kept(kept)))
    return _best({name: kept[name] for name in tries}, minutes, len(train), auto)


@dataclass(frozen=True)
class _Kept:
    """What the file of trials holds."""

    trials: Mapping[str, Trial]


def trial(task: Task, mapping: Mapping[str, Any], name: str, train: Sequence[Example], folds: int, face: Face) -> Trial:
    """What a candidate is worth on sentences that it did not learn from."""
    def made() -> VisualModel:
        model = make_system(name, mapping, task.table, task.clock)
        model.take_face(face)
        return model

    start = time.monotonic()
    said = cross_predicted(made, task, train, folds)
    speech = {e.id: speech_frames(e.alignment, task.clock) for e in train}
    valid = {e.id: e.measured[1] for e in train}
    references = {e.id: moving(face, e.measured[0][:, 0], speech[e.id] & valid[e.id]) for e in train}
    report = evaluate({name: said}, references, speech=speech, valid=valid, first=leading(face))
    correlation, rmse = (round(float(np.nan_to_num(report.summary(name, metric)[0])), 6)
                         for metric in ("correlation", "rmse"))
    return Trial(correlation, rmse, round(time.monotonic() - start, 1))


def cross_predicted(make: Callable[[], VisualModel], task: Task, examples: Sequence[Example],
                    folds: int) -> dict[str, np.ndarray]:
    """The trajectory (T, D) of every example by a system that was fitted without it, by id."""
    said = {}
    for part in folded(examples, folds):
        model = make()
        with scratch() as folder:
            model.fit(part["train"], part["val"], folder)
        for e in part["test"]:
            predicted = model.predict(e)
            said[e.id] = np.asarray(mlpg(predicted.mean, predicted.variance, task.windows))
    return said


def _best(trials: Mapping[str, Trial], minutes: float, sentences: int, auto: AutoSettings) -> Choice:
    """The candidate of the greatest correlation; of those that are as good, the first."""
    most = max(t.correlation for t in trials.values())
    name = next(name for name, t in trials.items() if t.correlation >= most - _SIMPLER)
    others = {n: t for n, t in trials.items() if n != name}
    second = max(others, key=lambda n: others[n].correlation) if others else name
    amount = f"{60 * minutes:.0f} seconds" if minutes < 2 else f"{minutes:.1f} minutes"
    reason = (f"of {len(trials)} systems it says sentences that it did not learn from best, correlation "
              f"{trials[name].correlation:.3f} (next {second}, {trials[second].correlation:.3f}), by {sentences} "
              f"sentences with {amount} of speech")
    if sources := auto.candidates[name].get("sources"):
        reason += f"; it learnt from runs of {', '.join(sources)} too"
    if minutes < auto.networks:
        reason += f"; networks are tried from {auto.networks:g} minutes on"
    return Choice(name, reason, minutes, sentences, dict(trials))


def _folds(auto: AutoSettings, minutes: float, sentences: int) -> int:
    wanted = auto.folds if minutes < auto.networks else min(3, auto.folds)
    return min(sentences, max(wanted, fewest_folds(sentences)))


def _able(task: Task, candidates: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """The candidates that read the labels.

    Raises:
        DnnvssError: none of them does; what the last one refuses.
    """
    able, refusal = [], None
    for name, mapping in candidates.items():
        try:
            make_system(name, mapping, task.table, task.clock)
            able.append(name)
        except DnnvssError as error:
            refusal = error
    if not able and refusal is not None:
        raise refusal
    return able


def _fitting(mapping: Mapping[str, Any], auto: AutoSettings) -> Mapping[str, Any]:
    """The settings of a candidate for little speech: networks are fitted by steps, not by passes."""
    if not _networks(mapping):
        return mapping
    fit = mapping["fit"]
    return {**mapping, "fit": {**fit, "steps": max(auto.steps, int(fit.get("steps", 0)))}}


def _networks(mapping: Mapping[str, Any]) -> bool:
    """Whether a candidate fits networks: its settings have those of a fit."""
    return "fit" in mapping


def _key(material: Material, auto: AutoSettings) -> str:
    """A hash of what the trials depend on."""
    counts = what_counts(material.settings, material.corpus.fingerprint)
    counts["model"] = {name: system_that_counts(mapping) for name, mapping in auto.candidates.items()}
    train = material.examples["train"]
    parts = [counts, _folds(auto, speech(train) / 60, len(train)), auto.steps, [e.id for e in train]]
    if (first := leading(material.encoded.face)) != leading(None):
        parts.append(first)
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=dict).encode()).hexdigest()[:16]
