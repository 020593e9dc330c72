"""Every kind of file that commands leave behind and read again, made by the commands: a small corpus and its runs."""

import contextlib
import io
import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import kills
import kills_made
import numpy as np
from conftest import composed, make_example, run_command
from fuzz.inputs import Input

from data_prep.folder import prepare_folder
from data_prep.splits import read_splits
from data_prep.sync import Sync, kept_sync
from dnnvss import files
from dnnvss.commands import prepare, speak, train
from dnnvss.commands.composed import run_command as run_settings_command
from dnnvss.commands.composed import typed_settings
from dnnvss.commands.train_settings import run_settings
from dnnvss.corpus import Corpus
from dnnvss.evaluation.finished import compare_runs
from dnnvss.evaluation.runs import read_run
from dnnvss.export.exported import ExportedModel
from dnnvss.face.aam import tracking
from dnnvss.face.aam.labelling.sheet import Sheet
from dnnvss.face.aam.search.model import SearchModel
from dnnvss.face.aam.search.track import track
from dnnvss.face.encoding import newest_encoding
from dnnvss.media import read_audio, read_video, video_frames, video_info
from dnnvss.runs.files import RunFiles
from dnnvss.runs.run import Run, _trained, _tried, make_model
from dnnvss.speech.align_adapt import Voice as Heard
from dnnvss.speech.align_adapt import learn
from dnnvss.studio.bodies import read_body
from dnnvss.synthesis.request import SpeakRequest
from dnnvss.training.resume import resume_point

HEAVY = 10
"""By how much fewer damages are tried of files whose reading takes a second."""


@dataclass(frozen=True)
class Made(Input):
    """A kind of file, with how many times fewer of its damages are tried.

    Args:
        share: 1, or :data:`HEAVY`.
    """

    share: int = 1


def quiet(function: Callable[..., Any], *words: object) -> Any:
    """Call a function and keep what it prints to itself; an exit of a command becomes its status."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        return function(*words)


def all_made(folder: Path) -> dict[str, Made]:
    """Every kind by name, with its right file in ``folder``."""
    home = folder / "home"
    kills.fresh(home, None, ())
    words = [kills.COMMANDS["prepare"].words(home),
             (*kills.ALONE, f"corpus.out={home}/data", f"runs={home}/runs", f"run={home}/runs/v")]
    words[0] = tuple("corpus.sentences=8" if "sentences" in str(w) else w for w in words[0])
    for each in words:
        assert quiet(run_command, *each) == 0
    kills_made.recorded(home)
    kills_made.labelled(home)
    return {**_corpus(home), **_prepared(home), **_spoken(home), **_network(home), **_compared(home),
            **_systems(folder / "systems"), **_tracked(home), **_media(home), **_conf(folder / "conf"),
            **_typed(folder)}


def _corpus(home: Path) -> dict[str, Made]:
    """Splits of every name, and the face that is kept with a corpus."""
    folder = home / "data"

    def used(_: Path) -> Any:
        corpus = Corpus.open(folder)
        return [corpus.split(name) for name in ("train", "val", "test")]

    splits = {path.stem: Made(path, used) for path in sorted((folder / "splits").glob("*.txt"))}
    own = files.write_text(home / "splits" / "val.txt", "a\nb\n")
    files.write_text(home / "splits" / "test.txt", "c\n")

    def encoded(_: Path) -> Any:
        corpus = Corpus.open(folder)
        kept = newest_encoding(corpus)
        return [kept.tracked(corpus, name) for name in corpus.utterances if name not in kept.dropped], kept.report

    kept = newest_encoding(Corpus.open(folder)).folder
    code = next((kept / "codes").glob("*.npz"))
    return {**{f"split {name}": made for name, made in splits.items()},
            "own split": Made(own, lambda p: read_splits(p.parent)),
            "kept face": Made(kept / "face.npz", encoded), "kept code": Made(code, encoded),
            "kept report": Made(kept / "report.json", encoded)}


def _prepared(home: Path) -> dict[str, Made]:
    """What every stage of a preparation keeps, and what the next call does with it."""
    raw, out = home / "raw", home / "prepared"
    for path in list(raw.glob("*.TextGrid"))[:2]:
        path.unlink()  # these are heard

    def again(_: Path) -> Any:
        return quiet(lambda: prepare_folder(raw, out, jobs=1))

    again(out)
    kept = sorted((out / ".stages").glob("*"))
    found = {f"stage {path.name}{each.suffix}": Made(each, again, HEAVY)
             for path in kept for each in sorted(path.glob("*"))}
    own = files.write_json(home / "sync.json", Sync({"a": 0.1}, ["b"], 0.01, 0.002).__dict__)
    rng = np.random.default_rng(0)
    states = [rng.integers(0, 6, 60) for _ in range(2)]
    voice = learn([rng.normal(size=(60, 39)).astype(np.float32) for _ in range(2)], states, ("AA", "sil"), 1)
    voice.write(home / "heard.npz")
    return {**found, "sync": Made(own, kept_sync), "heard voice": Made(home / "heard.npz", Heard.read)}


def _spoken(home: Path) -> dict[str, Made]:
    """All files of a run that synthesis reads."""
    from dnnvss.synthesis.speak import speak as said

    folder = home / "runs" / "v"

    def used(_: Path) -> Any:
        spoken = said(Run.open(folder), SpeakRequest("hello a boy", engine="none"))
        return spoken.remarks, spoken.curves(), next(spoken.frames())

    places = RunFiles(folder)
    names = [path for path in (*places.members, places.units, places.model) if path.is_file()]
    assert {path.name for path in names} >= {"config.yaml", "face.npz", "talker.npz", "units.pt", "model.npz"}
    return {f"run {path.name}": Made(path, used, HEAVY) for path in names}


def _network(home: Path) -> dict[str, Made]:
    """A network as ONNX, and the checkpoint from which a fit goes on."""
    run = Run.open(home / "runs" / "v")
    exported = home / "model.onnx"
    assert quiet(run_command, "export", run.folder, "--out", exported) == 0
    utterance = next(iter(Corpus.open(home / "data").utterances.values()))
    example = run.example(utterance)
    broken = home / "runs" / "broken"
    shutil.copytree(run.folder, broken)
    words = (*kills.ALONE, f"corpus.out={home}/data", f"runs={home}/runs", f"run={broken}")

    def goes_on(path: Path) -> Any:
        for each in (broken / "model.npz", broken / "metrics.json"):
            each.unlink(missing_ok=True)
        (broken / "checkpoints" / "best.ckpt").unlink(missing_ok=True)
        return _status(quiet(run_command, *words), path)

    checkpoint = broken / "checkpoints" / "last.ckpt"
    return {"onnx": Made(exported, lambda p: ExportedModel.open(p).predict(example)),
            "checkpoint": Made(checkpoint, lambda p: resume_point(p.parent)),
            "checkpoint gone on with": Made(checkpoint, goes_on, 5 * HEAVY)}


def _status(status: int, path: Path) -> int:
    """The status of a command, which is an error of ours that was told where it is 1 or 2."""
    assert status in (0, 1, 2), path
    return status


def _compared(home: Path) -> dict[str, Made]:
    """The predictions of a run, and the notes of a sweep."""
    folder = home / "runs" / "v"
    paths = sorted((folder / "predictions").glob("*.npz"))

    def compared(_: Path) -> Any:
        return quiet(lambda: compare_runs([folder], home / "table", first=1))

    made = {f"prediction {path.stem}": Made(path, lambda _: read_run(folder)) for path in paths}
    heavy = {f"prediction {path.stem} compared": Made(path, compared, HEAVY) for path in paths[:2]}
    return {**made, **heavy}


def _systems(folder: Path) -> dict[str, Made]:
    """What every system learns, but for ``hsmm_visemes``, which needs dynamic visemes and keeps what ``hsmm`` keeps."""
    found = {}
    rng = np.random.default_rng(0)
    examples, kernel = [make_example(f"e{i}", rng) for i in range(5)], dict[str, Any]()
    names = {path.stem for path in (kills.ROOT / "conf" / "model").glob("*.yaml")} - {"auto", "adapted", "hsmm_visemes"}
    for name in [*sorted(names), "adapted"]:  # which learns from another
        given = [f"model={name}", "corpus.out=data", "labels.blocks=[centre_phone,phone_context,phone_span]",
                 *(q for q in kills.QUICK if q.startswith("trainer")), "trainer.batch_size=32"]
        settings = run_settings(composed("train", *given))
        if name == "adapted":
            source = RunFiles(folder / "kernel").model
            known = {"checkpoint": str(source), "digest": files.digest(source), "model": kernel}
            settings = replace(settings, model={**settings.model, "sources": {"another": known}})
        kernel = dict(settings.model) if name == "kernel" else kernel
        model = make_model(settings, settings.task)
        quiet(model.fit, examples[:3], examples[3:], folder / name)
        Run.save(folder / name, settings.task, model)
        found[f"system {name}"] = Made(
            RunFiles(folder / name).model, lambda p, s=settings: _tried(p, _trained(p, s), s))  # type: ignore[misc]
    return found


def _tracked(home: Path) -> dict[str, Made]:
    """What the tracking of videos keeps."""
    words = kills.COMMANDS["track"].words(home)
    words = tuple("1" if str(w) == "2" else w for w in words)
    for path in list((home / "raw").glob("*.mp4"))[1:]:
        path.unlink()
    assert quiet(run_command, *words) == 0
    tracked = next((home / "tracked").glob("*.npz"))
    folder = home / "tracked" / "tracking"
    frame = next(iter(video_frames(next((home / "raw").glob("*.mp4")))))

    def again(path: Path) -> Any:
        return _status(quiet(run_command, *words), path)

    def searched(path: Path) -> Any:
        model = SearchModel.load(path)
        return track(model, [frame], None)

    return {"tracked": Made(tracked, again, 5 * HEAVY), "tracked, read": Made(tracked, tracking._read),
            "search": Made(folder / "search.npz", searched, HEAVY),
            "own search": Made(folder / "search_own.npz", again, 5 * HEAVY),
            "label picture": Made(next((home / "labels").glob("*.png")), lambda _: [
                Sheet.open(home / "labels").picture(label) for label in Sheet.open(home / "labels").labels])}


def _media(home: Path) -> dict[str, Made]:
    """Recordings."""
    video = next((home / "raw").glob("*.mp4"))
    sound = next((home / "raw").glob("*.wav"))
    return {"video": Made(video, lambda p: (video_info(p), read_video(p)), HEAVY),
            "sound": Made(sound, read_audio)}


def _conf(folder: Path) -> dict[str, Made]:
    """A user's own files of ``conf/``, composed by hydra, and files of settings that commands are given."""
    made = {}
    for group, source in (("labels", "ph_d"), ("model", "feedforward"), ("trainer", "default"), ("corpus", "folder"),
                          ("experiment", "table5"), ("visemes", "default"), ("face", "points"), ("style", "plain")):
        path = files.write_text(folder / group / "own.yaml",
                                (kills.ROOT / "conf" / group / f"{source}.yaml").read_text())
        more = ("corpus.raw=x", "corpus.out=y", "aam=folder", "visemes=folder") if group == "corpus" else ()
        words = ("--config-dir", str(folder), f"{group}=own", *more)

        def composed(_: Path, words: tuple[str, ...] = words) -> Any:
            return quiet(lambda: run_settings_command(train.COMMAND, words, run_settings, always_hydra=True))

        made[f"conf {group}"] = Made(path, composed, HEAVY)
    labels = files.write_text(folder / "labels.yaml", (kills.ROOT / "conf/labels/ph_d.yaml").read_text())
    made["features"] = Made(labels, lambda p: _status(quiet(run_command, "features", p), p))
    return made


def _typed(folder: Path) -> dict[str, Made]:
    """Words of a command line, a line each, and what a browser sends."""
    commands = {
        "speak": (speak.COMMAND, ("text=hello", "rate=25", "total=3", "speed=1.5", "style.articulation=0.5", "out=a")),
        "prepare": (prepare.COMMAND, ("corpus=folder", "corpus.raw=x", "corpus.importer.val=0.1", "jobs=2")),
        "train": (train.COMMAND, ("model=feedforward", "model.network.hidden=[8,8]", "trainer.epochs=3", "seed=4",
                                  "run=a", "labels=ph_d"))}
    made = {}
    for name, (command, words) in commands.items():
        path = files.write_text(folder / f"{name}.words", "\n".join(words))

        def read(path: Path, command: Any = command) -> Any:
            given = path.read_bytes().decode("utf-8", "surrogateescape").split("\n")
            return quiet(lambda: run_settings_command(command, given, lambda c: typed_settings(command, c),
                                                      command is train.COMMAND))

        made[f"words of {name}"] = Made(path, read, HEAVY if name == "train" else 1)
    body = files.write_text(folder / "body.json", json.dumps({"points": [[1, 2], [3, 4]], "done": True}))
    return {**made, "body": Made(body, lambda p: read_body(p.read_bytes()))}
