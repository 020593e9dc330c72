"""Which of several runs speaks where none is named: the one that measured best with what is given."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.runs.files import RunFiles
from dnnvss.runs.headlines import Headlines, read_headlines
from dnnvss.runs.settings import RunSettings
from dnnvss.runs.talkers import run_folders
from dnnvss.systems import VisualModel
from dnnvss.systems.plain_network import PlainNetwork
from dnnvss.systems.registry import found

_REMEDY = "Train one first: dnnvss train corpus=demo"
SPOKEN = frozenset({"phones", "words", "visemes"})
"""What a text brings: words, their phones and times, and the gestures that these suggest."""
HEARD = frozenset({"sound"})
"""What a voice brings."""
_ALIKE = 0.005
"""Of correlation: less than what fifty sentences tell apart."""


@dataclass(frozen=True)
class Candidate:
    """A finished run as far as a choice needs it.

    Args:
        folder: of the run.
        settings: that it was trained with.
        headlines: what it was worth.
        corpus: the fingerprint of what it was trained on.
    """

    folder: Path
    settings: RunSettings
    headlines: Headlines
    corpus: str

    @property
    def needs(self) -> frozenset[str]:
        """What an utterance must have."""
        model = self.settings.model
        if PlainNetwork.serves(model):
            return self.settings.task.table.needs | PlainNetwork.looks_up
        system = found(VisualModel, "system", str(model.get("system", self.settings.model_name)))
        own = frozenset[str]() if system is None else system.looks_up
        return self.settings.task.table.needs | own

    @property
    def worth(self) -> float:
        """What it is chosen by."""
        return self.headlines.validation

    @property
    def measured(self) -> tuple[Any, ...]:
        """What was measured on: headlines of runs that agree in it can be compared."""
        face = self.settings.face, self.settings.aam if self.settings.face["kind"] == "aam" else None
        return self.corpus, self.settings.split, face, self.headlines.sentences

    @property
    def noise_alters_it(self) -> bool:
        """Whether the run listens and has heard its recordings only as they are; what is no network never does else."""
        hardened = self.settings.trainer.get("altered", 0) and "fit" in self.settings.model
        return "sound" in self.needs and not hardened

    @property
    def title(self) -> str:
        """Labels and system, as messages name them."""
        return f"labels={self.settings.labels_name} model={self.settings.model_name}"


def best_run(runs: Path, given: frozenset[str], talker: str | None = None) -> tuple[Path, str]:
    """The run with the highest correlation on the validation split among those that can be compared.

    These are the runs of the corpus, split, face and validation sentences of the run that ended last, as far as they
    need no more than is given; what they were worth on the test split chooses nothing. Runs that keep no such
    correlation are not compared: where the last one is of these, it speaks. Of runs that differ by no more than .005
    those come first that noise alters little: they were trained in it (``trainer.altered``), or do not listen.

    Args:
        runs: a folder of run folders.
        given: what there is of an utterance, some of ``phones``, ``words``, ``visemes`` and
            ``sound``.
        talker: the corpus whose face is to speak; that of the run that ended last where None.

    Returns:
        Its folder, and why it was chosen.

    Raises:
        DnnvssError: no run has ended, none is of the talker, or none of them does with what is given.
    """
    found = _of(talker, finished_runs(runs), runs)
    able = [candidate for candidate in found if candidate.needs <= given]
    if not able:
        missing = " and ".join(sorted(found[0].needs - given - {"words"}))
        what = "a voice alone" if given == HEARD else "what is given"
        raise DnnvssError(f"no finished run here can follow {what}: {found[0].title} needs {missing}", file=runs,
                          remedy='Add text="...", or train a run that listens: dnnvss train labels=mel'
                          if given == HEARD else "Name a run with run=")
    same = [candidate for candidate in able if candidate.measured == able[0].measured]
    ranked = [candidate for candidate in same if not math.isnan(candidate.worth)]
    if len(found) == 1:
        return able[0].folder, ""
    if not ranked:
        return able[0].folder, (f"{able[0].title}, the last run; it keeps no correlation on the validation split to "
                                "compare it by, overwrite=true trains it anew")
    most = max(candidate.worth for candidate in ranked)
    alike = [candidate for candidate in ranked if candidate.worth >= most - _ALIKE]
    best = max(alike, key=lambda candidate: (not candidate.noise_alters_it, candidate.worth))
    noise = ", trained in noise too" if "sound" in best.needs and not best.noise_alters_it else ""
    return best.folder, f"{best.title}, correlation {best.worth:.3f} in validation{noise}: {_among(ranked, given)}"


def _of(talker: str | None, found: list[Candidate], runs: Path) -> list[Candidate]:
    """The runs of a talker.

    Raises:
        DnnvssError: there is none.
    """
    names = [str(candidate.settings.corpus["name"]) for candidate in found]
    if talker is not None and talker not in names:
        raise DnnvssError(f"no finished run here is of talker={talker}", file=runs,
                          remedy=f"Use one of {', '.join(sorted(set(names)))}, or train one: corpus.name={talker}")
    return [candidate for candidate, name in zip(found, names, strict=True) if talker in (None, name)]


def _among(same: list[Candidate], given: frozenset[str]) -> str:
    alone = given == HEARD
    if len(same) > 1:
        return f"the best of {len(same)} runs{' that need no text' if alone else ''} on its corpus"
    return "the last run that needs no text" if alone else "the last run"


def finished_runs(runs: Path) -> list[Candidate]:
    """The finished runs, those of trainings of several talkers among them, the last one first.

    Those that this version cannot read are left out.

    Raises:
        DnnvssError: there is none; where none can be read, what is wrong with the last one.
    """
    folders = [folder for folder in run_folders(runs) if RunFiles(folder).finished]
    folders.sort(key=lambda folder: RunFiles(folder).metrics.stat().st_mtime, reverse=True)
    read = [_tried(folder) for folder in folders]
    known = [candidate for candidate in read if isinstance(candidate, Candidate)]
    if known:
        return known
    if read and isinstance(read[0], DnnvssError):
        raise read[0]
    raise DnnvssError("no finished run here", file=runs, remedy=_REMEDY)


def _candidate(folder: Path) -> Candidate:
    places = RunFiles(folder)
    settings = RunSettings.load(folder)
    settings.task.table  # noqa: B018  (labels that this version does not know are told here)
    return Candidate(folder, settings, read_headlines(places.metrics), places.written().corpus)


def _tried(folder: Path) -> Candidate | DnnvssError:
    try:
        return _candidate(folder)
    except DnnvssError as error:
        return error
