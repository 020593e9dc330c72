"""From run folders to what the harness measures: predictions, references, phones, and the face of the run."""

import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, check_arrays, read_arrays
from dnnvss.corpus import Corpus
from dnnvss.curves import resample
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.bench import Bench, Sentence, leading
from dnnvss.face.base import moving
from dnnvss.face.encoding import EncodedCorpus, find_encoding
from dnnvss.face.kinds import load_face
from dnnvss.runs.files import RunFiles
from dnnvss.runs.settings import RunSettings
from dnnvss.timing import FrameClock

Arrays = dict[str, np.ndarray]
_SENTENCE = {"reference": Held(("T", "D")), "predicted": Held(("T", "D")), "speech": Held(("T",), "bui"),
             "valid": Held(("T",), "bui")}
_KINDS = tuple(_SENTENCE)


@dataclass(frozen=True)
class RunData:
    """What a run folder says about its test sentences.

    Args:
        folder: of the run.
        settings: that it was trained with.
        arrays: ``predicted``, ``reference`` (T, D), ``speech``, ``valid`` (T,), each by sentence id.
        styled: style, or another source of dynamic visemes, to trajectories by sentence id, where the run was evaluated
            with more than what its headline says.
    """

    folder: Path
    settings: RunSettings
    arrays: dict[str, Arrays]
    styled: dict[str, Arrays] = field(default_factory=dict)

    @property
    def clock(self) -> FrameClock:
        """The clock of the trajectories."""
        return self.settings.task.clock

    @property
    def corpus(self) -> Path:
        """The folder of the prepared corpus."""
        return self.settings.corpus_folder


def read_run(folder: str | Path) -> RunData:
    """Return the predictions of a finished run.

    Raises:
        DnnvssError: the folder is not one of a finished run.
    """
    places, settings = RunFiles(Path(folder)), RunSettings.load(Path(folder))
    remedy = "Name the folder of a finished run: dnnvss train writes one"
    arrays = {kind: read_arrays(places.prediction(kind), remedy) for kind in _KINDS}
    _check_sentences(arrays, places, remedy)
    styled = {name: read_arrays(path, remedy) for name, path in places.styled().items()}
    for name, path in places.styled().items():
        _check_sentences({**arrays, "predicted": styled[name]}, places, remedy, path)
    return RunData(places.folder, settings, arrays, styled)


def _check_sentences(arrays: Mapping[str, Arrays], places: RunFiles, remedy: str, file: Path | None = None) -> None:
    """Refuse predictions of other sentences, lengths or coefficients than those of the references."""
    references = arrays["reference"]
    if not references:
        raise DnnvssError("holds no sentence", file=places.prediction("reference"), remedy=remedy)
    width = next(iter(references.values())).shape[-1:]
    for i, reference in references.items():
        letters = dict(zip(("D", "T"), (*width, *reference.shape[:1]), strict=False))
        for kind, held in _SENTENCE.items():
            path = file if file and kind == "predicted" else places.prediction(kind)
            check_arrays(arrays[kind], {i: held}, path, remedy, letters)


def on_one_clock(runs: Mapping[str, RunData]) -> dict[str, RunData]:
    """Runs of several frame rates as they are on the finest clock among theirs; others as they stand.

    What was predicted is brought to that clock by the cubic spline that brings recordings to a clock
    (:func:`dnnvss.curves.resample`); what was measured, and which frames count, is that of the runs of that clock.

    Raises:
        DnnvssError: no run of that clock has the face of one of another clock, or its sentences.
    """
    finest = max((run.clock for run in runs.values()), key=lambda clock: clock.rate)
    leads = [run for run in runs.values() if run.clock == finest]
    if len(leads) == len(runs):
        return dict(runs)
    faces = {_face_digest(lead): lead for lead in reversed(leads)}
    return {name: run if run.clock == finest else _resampled(run, faces.get(_face_digest(run)))
            for name, run in runs.items()}


def _face_digest(run: RunData) -> str:
    return files.digest(RunFiles(run.folder).face)


def _resampled(run: RunData, lead: RunData | None) -> RunData:
    """A run as it is on the clock of another one of the same face and sentences."""
    if lead is None or run.arrays["reference"].keys() != lead.arrays["reference"].keys():
        raise DnnvssError(f"has {run.clock} frames a second, and no run of the finest rate has its face and sentences",
                          file=run.folder, remedy="Compare runs of one corpus, split and face")
    counts = _lengths(lead)

    def told(trajectories: Arrays) -> Arrays:
        return {i: resample(x, run.clock, lead.clock, count=counts[i]) for i, x in trajectories.items()}

    arrays = {**lead.arrays, "predicted": told(run.arrays["predicted"])}
    styled = {name: told(own) for name, own in run.styled.items()}
    settings = replace(run.settings, trajectory=lead.settings.trajectory)
    return replace(run, settings=settings, arrays=arrays, styled=styled)


def by_face(runs: Mapping[str, RunData]) -> dict[str, dict[str, RunData]]:
    """Runs that were tested on the same sentences, by their faces: kind of face to name to run.

    A second face of one kind is called ``aam 2``.

    Raises:
        DnnvssError: runs of other sentences, another corpus or another rate.
    """
    lead = next(iter(runs.values()))
    found: dict[str, dict[str, RunData]] = {}
    for name, run in runs.items():
        same = run.clock == lead.clock and _lengths(run) == _lengths(lead)
        if not same:
            raise DnnvssError(f"was tested on other sentences or at another rate than {lead.folder}", file=run.folder,
                              remedy="Compare runs of one corpus, split and rate, all with folds=0 or none")
        own = next((group for group in found.values() if _one_face(run, next(iter(group.values())))), None)
        if own is None:
            kind = str(run.settings.face["kind"])
            again = sum(face.split(" ")[0] == kind for face in found)
            own = found.setdefault(kind if not again else f"{kind} {again + 1}", {})
        own[name] = run
    return found


def _lengths(run: RunData) -> dict[str, int]:
    return {i: len(reference) for i, reference in run.arrays["reference"].items()}


def _one_face(run: RunData, other: RunData) -> bool:
    own, references = run.arrays["reference"], other.arrays["reference"]
    return all(np.array_equal(own[i], references[i]) for i in references)


def not_learnt(tested: Iterable[str], corpus: Corpus, split: str) -> list[str]:
    """Those of the sentences of a run's evaluation that the run itself has not learnt from.

    Where sentences are left out in turn each is measured by a system of its own, and what speaks has learnt from all
    but those of the validation split.

    Args:
        tested: ids.
        corpus: that the run was trained on.
        split: the variant of its splits.
    """
    learnt, held = ({u.id for u in corpus.split(name, split)} for name in ("train", "val"))
    ids = list(tested)
    return ids if learnt.isdisjoint(ids) else [i for i in ids if i in held]


def make_bench(runs: list[RunData], first: int = 5) -> Bench:
    """Return the bench of the first run, after a check that all runs were tested on the same sentences.

    Landmarks are the tracked ones where the corpus's cache holds the codes of the run's face.

    Raises:
        DnnvssError: runs of other sentences, another face or another rate; no such corpus; or more leading
            coefficients than there are.
    """
    lead = runs[0]
    size = next(iter(lead.arrays["reference"].values())).shape[1]
    face = load_face(RunFiles(lead.folder).face)
    if not 1 <= leading(face, first) <= size:
        raise DnnvssError(f"averages over the first {first} coefficients were asked for, and there are {size}",
                          file=lead.folder, remedy=f"Give --first 1 to {size}")
    for run in runs[1:]:
        own, references = run.arrays["reference"], lead.arrays["reference"]
        same = run.clock == lead.clock and own.keys() == references.keys() and all(
            np.array_equal(own[i], references[i]) for i in references)
        if not same:
            raise DnnvssError(f"was tested on other sentences, another face or another rate than {lead.folder}",
                              file=run.folder, remedy="Compare runs of one corpus, split, face and rate")
    corpus = open_corpus(lead.folder, lead.corpus)
    encoded = find_encoding(corpus, RunFiles(lead.folder).face)
    sentences = []
    for i, reference in lead.arrays["reference"].items():
        if i not in corpus.utterances:
            raise DnnvssError(f"is not in the corpus {corpus.root}", utterance=i, file=lead.folder,
                              remedy="Prepare the corpus that the run was trained on")
        landmarks = tracked_landmarks(encoded, corpus, i, lead.clock, len(reference)) if encoded else None
        speech, valid = (lead.arrays[kind][i].astype(bool) for kind in ("speech", "valid"))
        tier = corpus.utterances[i].alignment["phones"]
        seen = moving(face, reference.astype(float), speech & valid)
        sentences.append(Sentence(i, seen, tier, speech, valid, landmarks))
    return Bench(tuple(sentences), lead.clock, face, leading(face, first))


def tracked_landmarks(encoded: EncodedCorpus, corpus: Corpus, utterance: str, clock: FrameClock,
                      frames: int) -> np.ndarray | None:
    """The tracked points (T, P, 2 or 3) of an utterance on a clock of trajectories; None where it has none."""
    tracked = encoded.tracked(corpus, utterance)
    return None if tracked is None else resample(tracked, corpus.utterances[utterance].clock, clock, count=frames)


def _where(folder: Path, corpus_folder: Path) -> Path:
    """Where the corpus of a run is, if it was moved with the run."""
    near = (corpus_folder, folder.resolve().parent.parent / "data" / corpus_folder.name,
            Path("data") / corpus_folder.name)
    found = next((path for path in near if (path / "corpus.json").is_file()), None)
    if found is None:
        raise DnnvssError(f"was trained on the corpus in {corpus_folder}, which is not there", file=folder,
                          remedy=f"Prepare it there again, or link it: ln -s WHERE {shlex.quote(str(corpus_folder))}")
    return found


def open_corpus(folder: Path, corpus_folder: Path) -> Corpus:
    """The corpus of a run, whose phones are only right while it is the one that the run was tested on.

    Where it is no longer where it was, it is looked for beside the folder of runs, and in the working directory.

    Args:
        folder: of the run.
        corpus_folder: where the run's settings say that the corpus is.

    Raises:
        DnnvssError: it was moved, or holds something else now.
    """
    trained_on = RunFiles(folder).written().corpus
    corpus = Corpus.open(_where(folder, corpus_folder))
    if trained_on != corpus.fingerprint:
        raise DnnvssError(f"was trained on the corpus {trained_on}, and {corpus.root} now holds {corpus.fingerprint}",
                          file=folder, remedy="Prepare that corpus again, or train the run anew")
    return corpus
