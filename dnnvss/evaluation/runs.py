"""From run folders to what the harness measures: predictions, references, phones, and the face of the run."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.corpus import Corpus, Utterance
from dnnvss.curves import resample
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.measures import Bench, Sentence
from dnnvss.face.aam import ActiveAppearanceModel, ClipCode
from dnnvss.face.aam.pose import to_reference
from dnnvss.runs.files import RunFiles
from dnnvss.runs.settings import RunSettings
from dnnvss.timing import FrameClock, fill_invalid

Arrays = dict[str, np.ndarray]
_KINDS = ("predicted", "reference", "speech", "valid")


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
    places = RunFiles(Path(folder))
    remedy = "Name the folder of a finished run: python train.py writes one"
    arrays = {kind: files.read_arrays(places.prediction(kind), remedy) for kind in _KINDS}
    styled = {name: files.read_arrays(path, remedy) for name, path in places.styled().items()}
    return RunData(places.folder, RunSettings.load(places.folder), arrays, styled)


def make_bench(runs: list[RunData], first: int = 5) -> Bench:
    """Return the bench of the first run, after a check that all runs were tested on the same sentences.

    Landmarks are the tracked ones where the corpus's cache holds the codes of the run's appearance model.

    Raises:
        DnnvssError: runs of other sentences, another appearance model or another rate; no such corpus; or more leading
            coefficients than there are.
    """
    lead = runs[0]
    size = next(iter(lead.arrays["reference"].values())).shape[1]
    if not 1 <= first <= size:
        raise DnnvssError(f"averages over the first {first} coefficients were asked for, and there are {size}",
                          file=lead.folder, remedy=f"Give --first 1 to {size}")
    for run in runs[1:]:
        own, references = run.arrays["reference"], lead.arrays["reference"]
        same = run.clock == lead.clock and own.keys() == references.keys() and all(
            np.array_equal(own[i], references[i]) for i in references)
        if not same:
            raise DnnvssError(f"was tested on other sentences, another face or another rate than {lead.folder}",
                              file=run.folder, remedy="Compare runs of one corpus, split, face and rate")
    corpus = _same_corpus(lead)
    model = ActiveAppearanceModel.load(RunFiles(lead.folder).face)
    codes = _codes(lead)
    sentences = []
    for i, reference in lead.arrays["reference"].items():
        if i not in corpus.utterances:
            raise DnnvssError(f"is not in the corpus {corpus.root}", utterance=i, file=lead.folder,
                              remedy="Prepare the corpus that the run was trained on")
        utterance = corpus.utterances[i]
        landmarks = _tracked(corpus, utterance, model, codes, lead.clock, len(reference)) if codes else None
        speech, valid = (lead.arrays[kind][i].astype(bool) for kind in ("speech", "valid"))
        tier = utterance.alignment["phones"]
        sentences.append(Sentence(i, reference.astype(float), tier, speech, valid, landmarks))
    return Bench(tuple(sentences), lead.clock, model, first)


def _same_corpus(run: RunData) -> Corpus:
    """Return the corpus of a run, whose phones are only right while it is the one that the run was tested on."""
    corpus = Corpus.open(run.corpus)
    trained_on = files.read_json(RunFiles(run.folder).provenance).get("corpus")
    if trained_on != corpus.fingerprint:
        raise DnnvssError(f"was trained on the corpus {trained_on}, and {corpus.root} now holds {corpus.fingerprint}",
                          file=run.folder, remedy="Prepare that corpus again, or train the run anew")
    return corpus


def _codes(run: RunData) -> Path | None:
    """Return the folder of clip codes made with the run's own appearance model, or None."""
    own = RunFiles(run.folder).face.read_bytes()
    for candidate in sorted(run.corpus.glob("aam/*/aam.npz")):
        if candidate.stat().st_size == len(own) and candidate.read_bytes() == own:
            return candidate.parent / "codes"
    return None


def _tracked(
    corpus: Corpus, utterance: Utterance, model: ActiveAppearanceModel, codes: Path, clock: FrameClock, frames: int
) -> np.ndarray:
    """Return the tracked landmarks (T, P, 2) in the reference frame, the clip's own mean shape replaced by the
    model's."""
    code = ClipCode.load(codes / f"{utterance.id}.npz")
    points, _ = corpus.landmarks(utterance)
    own = points[:, model.layout.rows].astype(float)
    still = to_reference(own, code.pose, model.reference.pivot) - code.shape_offset
    return resample(fill_invalid(still, code.valid), utterance.clock, clock, count=frames)
