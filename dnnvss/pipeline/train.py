"""Trains a system, evaluates it, and leaves a run folder."""

import shutil
from pathlib import Path

import joblib
import numpy as np
from omegaconf import DictConfig, OmegaConf

from dnnvss import files
from dnnvss.aam import AAMConfig, EncodedCorpus, encode_corpus
from dnnvss.corpus import Corpus
from dnnvss.evaluation import Report, evaluate
from dnnvss.models import Example, PhoneMean, TrainingMean, VisualModel
from dnnvss.phones import SILENCES
from dnnvss.pipeline.data import SPLITS, Task, speech_frames, split_examples, word_frames
from dnnvss.pipeline.folder import Run, make_model, make_task, provenance, run_name
from dnnvss.render import choose_neutral
from dnnvss.render.plots import plot_trajectories
from dnnvss.speech.durations import DurationModel
from dnnvss.trajectory import mlpg


def train(config: DictConfig) -> float:
    """Train what ``config`` describes and return the correlation over speech on the test split.

    A run that was killed goes on where it stopped; one that is finished is only reported, unless ``overwrite=true``.
    """
    corpus = Corpus.open(config.corpus.out)
    folder = Path(config.run or Path(config.runs) / run_name(config, corpus.fingerprint))
    if config.overwrite and folder.exists():
        shutil.rmtree(folder)
    if (folder / "metrics.json").is_file():
        print(f"{folder} is finished; overwrite=true trains it anew\n")
        print((folder / "metrics.md").read_text(encoding="utf-8"))
        return float(files.read_json(folder / "metrics.json")["headline"])
    folder.mkdir(parents=True, exist_ok=True)
    files.write_text(folder / "config.yaml", OmegaConf.to_yaml(config, resolve=True))
    files.write_json(folder / "run.json", provenance(corpus.fingerprint))

    with joblib.parallel_config(backend="loky", n_jobs=config.jobs):
        encoded = encode_with_aam(corpus, config)
    task = make_task(config)
    examples = split_examples(task, corpus, encoded, config.corpus.split)
    model = make_model(config, task)
    print(f"training {config.model.name} on {len(examples['train'])} utterances; TensorBoard: {folder}/tensorboard")
    model.fit(examples["train"], examples["val"], folder)
    Run.save(folder, task, model)
    save_voice(folder, corpus, encoded, config)
    report = evaluate_run(folder, corpus, task, model, examples)
    if config.sample:
        _render_sample(folder, corpus, examples["test"][0].id)
    headline = report.headline("model")
    files.write_json(folder / "metrics.json", {"headline": headline, **report.to_json()})
    print(f"\nwrote {folder}: metrics.md, metrics.json, figures/, predictions/, model.pt")
    return headline


def encode_with_aam(corpus: Corpus, config: DictConfig) -> EncodedCorpus:
    """Return the corpus as AAM parameters; the model is fitted on the training split alone, and kept for later runs."""
    settings = AAMConfig.from_dict(OmegaConf.to_container(config.aam, resolve=True))  # type: ignore[arg-type]
    ids = {name: [u.id for u in corpus.split(name, config.corpus.split)] for name in SPLITS}
    encoded = encode_corpus(corpus, ids, settings, corpus.root / "aam")
    for utterance, reason in encoded.dropped.items():
        print(f"left out: utterance {utterance}: {reason}")
    return encoded


def trajectories(task: Task, model: VisualModel, examples: list[Example]) -> dict[str, np.ndarray]:
    """Return the generated static trajectory (T, D) of each example by id."""
    out = {}
    for example in examples:
        prediction = model.predict(example)
        out[example.id] = np.asarray(mlpg(prediction.mean, prediction.variance, task.windows))
    return out


def evaluate_run(folder: Path, corpus: Corpus, task: Task, model: VisualModel,
                 examples: dict[str, list[Example]]) -> Report:
    """Return the table of the model and the null models on the test split; writes predictions, tables and figures."""
    systems: dict[str, VisualModel] = {"model": model}
    for name, null in (("training mean", TrainingMean), ("phone mean", PhoneMean)):
        systems[name] = null(task.table, task.clock)
        systems[name].fit(examples["train"], examples["val"], folder)
    test = examples["test"]
    predicted = {name: trajectories(task, system, test) for name, system in systems.items()}
    references = {e.id: e.targets[:, 0] for e in test if e.targets is not None}
    speech = {e.id: speech_frames(e.alignment, task.clock) for e in test}
    valid = {e.id: e.valid for e in test if e.valid is not None}
    outputs = {"predicted": predicted["model"], "reference": references, "speech": speech, "valid": valid}
    for name, arrays in outputs.items():
        files.write_arrays(folder / "predictions" / f"{name}.npz", **arrays)
    report = evaluate(predicted, references, speech=speech, valid=valid)
    title = f"{corpus.info.name}, {len(test)} test sentences, phone times from the recordings"
    pages = [title, report.markdown()]
    print(f"\n{title}\n\n{report.table()}")
    known = {w for e in examples["train"] for w in e.alignment["words"].labels}
    unseen = {e.id: frames for e in test if (frames := word_frames(e.alignment, task.clock, known)).sum() > 1}
    if unseen:
        chosen = {name: {i: p[i] for i in unseen} for name, p in predicted.items()}
        measured = {i: references[i] for i in unseen}
        inside = evaluate(chosen, measured, speech=unseen, valid={i: valid[i] for i in unseen})
        title = f"Inside words that never occur in training ({len(unseen)} sentences)"
        pages += [f"## {title}", "`speech` stands for the frames of these words.", inside.markdown()]
        files.write_json(folder / "metrics_unseen_words.json", inside.to_json())
        print(f"\n{title}: correlation " + ", ".join(f"{n} {inside.headline(n):.3f}" for n in chosen))
    files.write_text(folder / "metrics.md", "\n\n".join([*pages, corpus.info.credit]) + "\n")
    _figures(folder, task, test[0], {name: p[test[0].id] for name, p in predicted.items()})
    return report


def save_voice(folder: Path, corpus: Corpus, encoded: EncodedCorpus, config: DictConfig) -> None:
    """Write what synthesis needs beside the model: the AAM, the face, durations and the talker's phones."""
    train = [u for u in corpus.split("train", config.corpus.split) if u.id not in encoded.dropped]
    with files.replacing(folder / "aam.npz") as temporary:
        shutil.copyfile(encoded.folder / "aam.npz", temporary)
    choose_neutral(corpus, encoded).save(folder / "face.npz")
    DurationModel.fit(train).save(folder / "durations.npz")
    spoken = sorted({p for u in train for p in u.alignment["phones"].labels} - set(SILENCES))
    voice = {"phones": spoken, "variant": corpus.info.variant, "rate": corpus.info.rate, "credit": corpus.info.credit}
    files.write_json(folder / "voice.json", voice)


def _figures(folder: Path, task: Task, example: Example, predicted: dict[str, np.ndarray]) -> None:
    assert example.targets is not None
    for d in range(min(5, example.targets.shape[2])):
        series = {"reference": example.targets[:, 0, d], **{name: p[:, d] for name, p in predicted.items()}}
        plot_trajectories(folder / "figures" / f"coefficient_{d + 1}.png", series, task.clock.rate,
                          example.alignment["phones"], f"AAM coefficient {d + 1}, utterance {example.id}")


def _render_sample(folder: Path, corpus: Corpus, utterance: str) -> None:
    from dnnvss.pipeline.synthesise import render_utterance

    render_utterance(Run.open(folder), corpus, corpus.utterances[utterance], folder / "sample.mp4")


