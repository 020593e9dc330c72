"""The steps of a training of one talker or several: what is gathered, what is kept and printed at the end."""

from collections.abc import Callable, Sequence
from pathlib import Path

from dnnvss import files
from dnnvss.corpus import Corpus
from dnnvss.evaluation.choice import Choice
from dnnvss.evaluation.optional import attempted
from dnnvss.evaluation.run import evaluate_fitted
from dnnvss.evaluation.videos import write_samples
from dnnvss.runs.files import RunFiles
from dnnvss.runs.fitting import Material, encode, gather, keep
from dnnvss.runs.headlines import read_headlines
from dnnvss.runs.run import Run
from dnnvss.runs.settings import RunSettings
from dnnvss.systems import VisualModel


def gathered(settings: RunSettings, corpus: Corpus, folder: Path) -> Material:
    """What a run is fitted on; prints what was left out of it."""
    encoded = encode(settings, corpus)
    for utterance, reason in encoded.dropped.items():
        print(f"left out: utterance {utterance}: {reason}")
    for line in encoded.told:
        print(line)
    return gather(settings, corpus, encoded, scratch=folder)


def finished(folder: Path, material: Material, model: VisualModel, choice: Choice | None = None,
             others: Sequence[Material] = (), without: Callable[[int], VisualModel] | None = None) -> float:
    """Keep and evaluate a fitted system, print what it is worth and return its headline.

    Args:
        folder: of the run.
        material: that the system was fitted on.
        model: fitted.
        choice: why it was chosen, where it was not named.
        others: talkers heard in the same training.
        without: see :func:`dnnvss.evaluation.run.evaluate_fitted`.
    """
    settings, corpus, places = material.settings, material.corpus, RunFiles(folder)
    generator = keep(material, model, folder, others)
    for setting, reason in generator.talker.unknown.items():
        print(f"{reason}: style.{setting} will have no effect")
    found = evaluate_fitted(folder, material, generator, without)
    print(f"\n{found.text}")
    judged = found.verdict
    if judged is not None:
        judged.write(places.verdict, f"Verdict: {folder.name}", choice.text if choice else "")
        print(f"\n{judged.text}")
    if settings.sample:
        ids = [e.id for e in material.examples["val" if material.folds else "test"]]
        attempted("samples", lambda: write_samples(Run.open(folder), corpus, ids, found.report))
    found.finish(folder)
    written = (places.verdict, places.page, places.metrics, places.predictions, places.model)
    kept = ", ".join(path.name for path in written)
    print(f"\nwrote {folder}: {kept}")
    return found.headline


def told(places: RunFiles) -> float:
    """Print what a finished run was worth and return its headline."""
    print(f"{places.folder} is finished; overwrite=true trains it anew\n")
    print(files.read_text(places.page, "Train the run anew: overwrite=true"))
    return read_headlines(places.metrics).test
