"""A run is made in steps: begun, the face encoded, examples gathered, the system fitted and kept."""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

from dnnvss import files
from dnnvss.corpus import SPLITS, Corpus
from dnnvss.curves import mlpg
from dnnvss.errors import DnnvssError
from dnnvss.face.encoding import FACE, EncodedCorpus, encode_corpus
from dnnvss.processes import parallel
from dnnvss.render.living import kept_life
from dnnvss.render.pictures import keep_ground
from dnnvss.runs.corpus_visemes import CorpusUnits, corpus_units
from dnnvss.runs.files import RunFiles
from dnnvss.runs.folds import Examples, fewest_folds, fold_count
from dnnvss.runs.heard import Heard
from dnnvss.runs.knowledge import source_files
from dnnvss.runs.naming import check_begun, delete_run
from dnnvss.runs.run import Run, make_model, provenance
from dnnvss.runs.settings import RunSettings
from dnnvss.runs.voice import Voice
from dnnvss.speech.durations import DurationModel
from dnnvss.style.generator import Generator, learn_talker
from dnnvss.systems import Example, VisualModel
from dnnvss.systems.examples import make_examples, split_examples, with_altered
from dnnvss.systems.network import NetworkModel
from dnnvss.systems.viseme_plan import UnitPlan


@dataclass(frozen=True)
class Material:
    """What a run is fitted on.

    Args:
        settings: of the run.
        corpus: prepared.
        encoded: its recordings as parameters of a face.
        examples: of each split. Where ``folds`` is not 0, those of the test split train too, and ``test`` is every one.
        plan: how dynamic visemes are learnt and used, None where the labels have none.
        units: those that were learnt, likewise.
        folds: in how many parts the sentences are left out in turn to be tested on; 0 where there is a test split.
    """

    settings: RunSettings
    corpus: Corpus
    encoded: EncodedCorpus
    examples: dict[str, list[Example]]
    plan: UnitPlan | None = None
    units: CorpusUnits | None = None
    folds: int = 0

    def other_tests(self) -> dict[str, list[Example]]:
        """The test examples with dynamic visemes from the source that the run does not use, by its name."""
        if self.plan is None or self.units is None:
            return {}
        source, tiers = self.units.other_source(self.plan)
        test = self.corpus.split("test", self.settings.split)
        return {source: list(make_examples(self.settings.task, self.corpus, test, self.encoded, tiers))}


def begin(folder: Path, settings: RunSettings, corpus: Corpus, first: bool = True) -> bool:
    """Take a folder for a run, or go on with it; return whether the run in it is finished already.

    Args:
        folder: of the run; with ``overwrite`` an older run there is deleted.
        settings: of the run.
        corpus: that it is trained on.
        first: of the processes that share the fit, the one that deletes and writes.

    Raises:
        DnnvssError: the folder holds another run, or something that is no run and is not deleted.
    """
    places = RunFiles(folder)
    if not settings.overwrite:
        if first:
            check_begun(folder, settings, corpus.fingerprint)
        if places.finished:
            return True
    elif first:
        delete_run(folder)
    files.make_folder(folder)
    if first:
        files.write_json(places.provenance, asdict(provenance(settings, corpus.fingerprint)))
        settings.write(folder)
    return False


def new_model(settings: RunSettings) -> VisualModel:
    """The untrained system of a run.

    Raises:
        DnnvssError: a setting that the system refuses.
    """
    model = make_model(settings, settings.task)
    if settings.trainer["refine"] and not isinstance(model, NetworkModel):
        raise DnnvssError(f"trainer.refine does not work with model={settings.model_name}",
                          remedy="Use model=feedforward or model=gaussian, or trainer.refine=0")
    return model


def encode(settings: RunSettings, corpus: Corpus) -> EncodedCorpus:
    """The corpus as parameters of a face, which is fitted on the training split alone and kept for later runs."""
    ids = {name: [u.id for u in corpus.split(name, settings.split)] for name in SPLITS}
    with parallel(settings.jobs):
        return encode_corpus(corpus, ids, settings.face_settings, corpus.root / "face")


def gather(settings: RunSettings, corpus: Corpus, encoded: EncodedCorpus, scratch: Path | None = None) -> Material:
    """The examples of a run, with dynamic visemes where its labels have some.

    Args:
        settings: of the run.
        corpus, encoded: utterances and their parameters.
        scratch: the run's folder, from which targets are mapped, so that many hours do not fill the memory, and in
            which fits that are killed leave what they need to go on; neither if None.

    Raises:
        DnnvssError: a split with nothing to learn from.
    """
    task = settings.task
    if "visemes" not in task.table.sources:
        examples = split_examples(task, corpus, encoded, settings.split, None, scratch)
        folds = _folds(settings, examples)
        examples = altered(settings, corpus, examples, SPLITS if folds else ("train",))
        return Material(settings, corpus, encoded, _pooled(examples) if folds else examples, folds=folds)
    if settings.folds:
        raise DnnvssError("folds cannot leave sentences out that dynamic visemes were learnt from",
                          remedy="Train with labels of phones alone (labels=ph), or leave folds out")
    plan = UnitPlan.from_config(settings.visemes)
    units = corpus_units(corpus, encoded, settings.split, task.clock, plan, scratch)
    tiers = units.tiers(plan, encoded.splits["train"])
    examples = split_examples(task, corpus, encoded, settings.split, tiers, scratch)
    return Material(settings, corpus, encoded, altered(settings, corpus, examples), plan, units)


def altered(settings: RunSettings, corpus: Corpus, examples: Examples, splits: Sequence[str] = ("train",)) -> Examples:
    """Examples of which some splits are learnt from under altered sounds too, where the settings ask for it."""
    copies, others = settings.trainer.get("altered", 0), corpus.split("train", settings.split)
    return examples | {name: list(with_altered(settings.task, corpus, examples[name], copies, others))
                       for name in splits}


def _folds(settings: RunSettings, examples: Examples) -> int:
    """In how many parts the sentences are left out in turn.

    Raises:
        DnnvssError: in so few parts that nothing is left to train on, or in more than there are sentences.
    """
    if settings.folds is None:
        return fold_count(examples)
    most = sum(map(len, examples.values()))
    fewest = fewest_folds(most)
    if settings.folds and not fewest <= settings.folds <= most:
        given = f"Give folds={fewest} to {most}, or folds=0" if fewest <= most else "Give folds=0"
        raise DnnvssError(f"folds={settings.folds} leaves nothing to train or to test on",
                          remedy=f"{given} for the test split")
    return settings.folds


def _pooled(examples: Examples) -> Examples:
    """Examples of which those of the test split train as well: they are tested on in parts that leave them out."""
    everything = [*examples["train"], *examples["test"], *examples["val"]]
    return {"train": [*examples["train"], *examples["test"]], "val": examples["val"], "test": everything}


def keep(material: Material, model: VisualModel, folder: Path, others: Sequence[Material] = ()) -> Generator:
    """Keep a fitted system with all that synthesis needs beside it; return what generates its trajectories.

    A network is refined first, where the settings ask for it.

    Args:
        material: that it was fitted on.
        model: fitted.
        folder: of the run.
        others: talkers heard in the same training, from whom phones and their durations are borrowed.
    """
    settings, examples, places = material.settings, material.examples, RunFiles(folder)
    refined(settings, model, examples, folder)
    Run.save(folder, settings.task, model)
    if material.units:
        material.units.model.save(places.units)
    _keep_talker(material, places, others)
    if heard := Heard.of((e.codes for e in examples["train"]), settings.task.clock):
        heard.save(places.heard)
    talker = learn_talker(settings.task, model, examples, material.encoded.face)
    talker.save(places.talker)
    return Generator(settings.task, model, talker)


def refined(settings: RunSettings, model: VisualModel, examples: Mapping[str, Sequence[Example]], folder: Path) -> None:
    """Train a fitted network on its generated trajectories, where the settings ask for it.

    Args:
        settings: of the run.
        model: fitted.
        examples: ``train`` and ``val``, which it was fitted on.
        folder: of the fit.
    """
    if settings.trainer["refine"] and isinstance(model, NetworkModel):
        model.refine(examples["train"], examples["val"], partial(mlpg, windows=settings.task.windows),
                     folder / "refined")


def _keep_talker(material: Material, places: RunFiles, others: Sequence[Material]) -> None:
    """Write the face and its picture, durations and the talker's phones."""
    corpus, encoded = material.corpus, material.encoded
    with files.replacing(places.face) as temporary:
        shutil.copyfile(encoded.folder / FACE, temporary)
    keep_ground(corpus, encoded, places.picture)
    if life := kept_life(corpus, encoded):
        with files.replacing(places.life) as temporary:
            shutil.copyfile(life, temporary)
    durations, voice = _spoken(material)
    sources = source_files(material.settings)
    known = [(DurationModel.load(other.durations), Voice.load(other.voice)) for other in sources]
    for lasting, said in (*known, *map(_spoken, others)):
        durations, voice = durations.borrowing(lasting), voice.borrowing(said)
    durations.save(places.durations)
    voice.save(places.voice)


def _spoken(material: Material) -> tuple[DurationModel, Voice]:
    """How long a talker's phones last, and which they are."""
    train = [material.corpus.utterances[e.id] for e in material.examples["train"]]
    return DurationModel.fit(train), Voice.of(train, material.corpus.info)
