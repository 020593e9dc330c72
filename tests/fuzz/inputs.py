"""Every kind of file that the program reads: a right one, and what reads it as the program does."""

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from conftest import composed, make_example
from face.aam_cases import CONFIG, GROUPS
from face.aam_cases import clip as toy_clip
from face.points_cases import GROUPS as POINT_GROUPS
from face.points_cases import SETTINGS, clips
from fuzz.inputs_motion import motion

from dnnvss import __version__, files
from dnnvss.commands.train_settings import run_settings
from dnnvss.corpus import Corpus, CorpusInfo, Utterance
from dnnvss.curves.windows import STATIC
from dnnvss.evaluation.runs import read_run
from dnnvss.face.aam import encode_clip, fit_aam
from dnnvss.face.aam.code import ClipCode
from dnnvss.face.aam.labelling.imports import read_tool
from dnnvss.face.aam.labelling.sheet import Label, Sheet
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.face.kinds import face_kind, load_face
from dnnvss.face.points.code import PointsCode
from dnnvss.features import CodeStore, FeatureTable, encode
from dnnvss.formats import (
    Landmarks,
    read_alignment,
    read_landmarks,
    read_marks,
    spanning,
    write_alignment,
    write_npz,
    write_openface,
    write_pts,
)
from dnnvss.render.neutral import Neutral
from dnnvss.runs.bundle import BundleIndex
from dnnvss.runs.files import RunFiles
from dnnvss.runs.headlines import read_headlines
from dnnvss.runs.run import Run, _opened, _tried, make_model
from dnnvss.runs.settings import RunSettings
from dnnvss.runs.voice import Voice
from dnnvss.speech.durations import DurationModel
from dnnvss.style import Key, Talker, read_keys, write_keys
from dnnvss.style.keys import coefficients, key_constraints
from dnnvss.text.overrides import read_overrides
from dnnvss.text.sentence import parse
from dnnvss.text.tree import linguistic_tree
from dnnvss.timing import Alignment, FrameClock, Tier

CLOCK = FrameClock(25)
TABLE = FeatureTable(("centre_phone", "phone_context", "phone_span"))
SPOKEN = Alignment(
    [
        Tier(
            "phones",
            [
                (0, 0.2, "sil"),
                (0.2, 0.3, "N"),
                (0.3, 0.5, "AW"),
                (0.5, 0.6, "sp"),
                (0.6, 0.7, "AY"),
                (0.7, 1, "sil"),
            ],
        ),
        Tier("words", [(0, 0.2, ""), (0.2, 0.5, "now"), (0.5, 0.6, ""), (0.6, 0.7, "I"), (0.7, 1, "")]),
    ]
)


@dataclass(frozen=True)
class Input:
    """A kind of file.

    Args:
        path: of the right file.
        read: reads the file there, and does with it what the program does first.
    """

    path: Path
    read: Callable[[Path], Any]


def all_inputs(folder: Path) -> dict[str, Input]:
    """Every kind by name, with its right file in ``folder``."""
    return {
        **_alignments(folder),
        **_landmarks(folder),
        **_corpus(folder / "corpus"),
        **_talker(folder),
        **_faces(folder),
        **_run(folder / "run"),
        **_labels(folder / "labels"),
        **_own(folder),
        **{name: Input(*given) for name, given in motion(folder).items()},
    }


def _alignments(folder: Path) -> dict[str, Input]:
    def used(path: Path) -> Any:
        alignment = spanning(read_alignment(path, "a"), 1.0)
        if "phones" in alignment and "words" in alignment:
            linguistic_tree(alignment, "now, I")
            encode(alignment, "now, I", TABLE, CLOCK)
        return alignment

    words = Alignment([SPOKEN["words"]])
    return {
        suffix: Input(
            write_alignment(folder / f"a.{suffix}", words if suffix in ("csv", "align") else SPOKEN), used
        )
        for suffix in ("TextGrid", "lab", "mlf", "csv", "align")
    }


def _landmarks(folder: Path) -> dict[str, Input]:
    rng = np.random.default_rng(0)
    flat, space = (rng.normal(50, 9, (12, 5, d)).astype(np.float32) for d in (2, 3))
    known = np.arange(12) != 3
    return {
        "openface": Input(write_openface(folder / "of2.csv", Landmarks(flat, known)), read_landmarks),
        "openface 3": Input(
            write_openface(folder / "of3.csv", Landmarks(space, known)), lambda p: read_landmarks(p, 3)
        ),
        "pts": Input(write_pts(folder / "v_000001.pts", flat[0]), read_landmarks),
        "landmarks npz": Input(
            write_npz(folder / "l.npz", Landmarks(flat, known, np.arange(12) / 25)), read_landmarks
        ),
        "landmarks json": Input(
            files.write_json(
                folder / "landmarks.json",
                {"groups": {"lips": [0, 3], "jaw": [3, 5]}, "scale": 2.0, "rate": 25, "size": [64, 48]},
            ),
            read_marks,
        ),
    }


def _corpus(folder: Path) -> dict[str, Input]:
    rng = np.random.default_rng(0)
    utterances = [
        Utterance(f"u{i}", "Now, I", SPOKEN, None, None, f"landmarks/u{i}.npz", frames=25) for i in range(4)
    ]
    for u in utterances:
        write_npz(
            folder / "landmarks" / f"{u.id}.npz",
            Landmarks(rng.normal(size=(25, 19, 2)).astype(np.float32), np.ones(25, bool)),
        )
    Corpus.write(
        folder,
        CorpusInfo("fuzz", (96, 80), "25", GROUPS),
        utterances,
        {"train": ["u0", "u1"], "val": ["u2"], "test": ["u3"]},
    )

    def used(_: Path) -> Any:
        corpus = Corpus.open(folder)
        for name in ("train", "val", "test"):
            for utterance in corpus.split(name):
                linguistic_tree(utterance.alignment, utterance.text)
                corpus.landmarks(utterance)
        return corpus.fingerprint

    encoding = folder / "face" / "key"
    report = files.write_json(
        encoding / "report.json", {"face": "aam", "dropped": {"u0": "dark"}, "reconstruction": {}}
    )
    return {
        "corpus json": Input(folder / "corpus.json", used),
        "utterances": Input(folder / "utterances.jsonl", used),
        "split": Input(folder / "splits" / "train.txt", used),
        "corpus landmarks": Input(folder / "landmarks" / "u1.npz", used),
        "encoding report": Input(report, lambda _: EncodedCorpus.open(encoding).dropped),
    }


def _talker(folder: Path) -> dict[str, Input]:
    utterances = [Utterance(f"u{i}", "Now, I", SPOKEN) for i in range(3)]
    sentence = parse("Now I see, a bee.")
    talker = Talker(np.ones(3), np.zeros(3), np.ones(3), {}, {}, np.ones(3))
    voice = Voice(("AA", "M"), ("sil",), "en_us", "25", "nobody", frozenset({"AA-M+sil"}))
    return {
        "durations": Input(
            DurationModel.fit(utterances).save(folder / "durations.npz"),
            lambda p: DurationModel.load(p).predict(sentence),
        ),
        "talker": Input(talker.save(folder / "talker.npz"), lambda p: Talker.load(p).unknown),
        "voice": Input(voice.save(folder / "voice.json"), Voice.load),
    }


def _faces(folder: Path) -> dict[str, Input]:
    points = face_kind("points").fit(clips(2), POINT_GROUPS, SETTINGS, progress=False)
    aam = fit_aam([toy_clip(i) for i in range(3)], GROUPS, CONFIG, progress=False)
    code = face_kind("points").encode(points, clips(2)[0]).code
    own = toy_clip(1)
    pictured = encode_clip(aam, own.images(), *own.landmarks(), 25.0)
    neutral = Neutral(
        own.images()[0],
        own.landmarks()[0][0, :15],
        pictured.pose[0],
        pictured.shape_offset,
        pictured.texture_offset,
        "u:0",
    )

    def used(path: Path) -> Any:
        face = load_face(path)
        return face.points(np.zeros((2, len(face.names)))), face.gauges, face.groups

    return {
        "points face": Input(points.save(folder / "points.npz"), used),
        "aam face": Input(aam.save(folder / "aam.npz"), used),
        "points code": Input(code.save(folder / "points_code.npz"), PointsCode.load),
        "clip code": Input(pictured.save(folder / "clip_code.npz"), ClipCode.load),
        "neutral": Input(neutral.save(folder / "neutral.npz"), Neutral.load),
    }


def _run(folder: Path) -> dict[str, Input]:
    settings = run_settings(composed("train", "model=phone_mean", "labels=ph_d", "corpus.out=data/demo"))
    settings.write(folder)
    places = RunFiles(folder)
    rng = np.random.default_rng(0)
    model = make_model(settings, settings.task)
    examples = [make_example(f"e{i}", rng) for i in range(4)]
    model.fit(examples[:3], examples[3:], folder)
    Run.save(folder, settings.task, model)
    files.write_json(places.provenance, {"dnnvss": __version__, "corpus": "abc"})
    files.write_json(places.metrics, {"headline": 0.8, "validation": {"headline": 0.7, "sentences": ["u0"]}})
    reference = rng.normal(size=(30, 3))
    for kind, rows in (
        ("reference", reference),
        ("predicted", reference),
        ("speech", np.ones(30, bool)),
        ("valid", np.ones(30, bool)),
    ):
        files.write_arrays(places.prediction(kind), u1=rows, u2=rows)
    bundle = folder.parent / "bundle"
    BundleIndex("model.npz", "demo", __version__, {}).save(bundle)
    shutil.copyfile(places.model, arrays := bundle / "model.npz")
    assert STATIC.taps

    def opened(_: Path) -> Any:
        own = RunSettings.load(folder)
        return own.task.table.hash, own.face_settings, own.corpus_folder, own.split

    return {
        "config": Input(places.config, opened),
        "run json": Input(places.provenance, lambda _: (places.written(), RunSettings.load(folder))),
        "model": Input(places.model, lambda p: _tried(p, _opened(p, settings), settings)),
        "model as arrays": Input(arrays, lambda p: _tried(p, _opened(p, settings), settings)),
        "metrics": Input(places.metrics, read_headlines),
        "reference": Input(places.prediction("reference"), lambda _: read_run(folder)),
        "speech": Input(places.prediction("speech"), lambda _: read_run(folder)),
        "bundle json": Input(RunFiles(bundle).index, lambda _: BundleIndex.load(bundle).check(bundle)),
    }


def _labels(folder: Path) -> dict[str, Input]:
    groups = {"lips": (0, 4), "jaw": (4, 6)}
    sheet = Sheet(
        folder,
        groups,
        tuple(Label("a.mp4", i, f"a_{i}.png", f"a_{i}.pts") for i in range(2)),
        frozenset(),
        "own",
        "v",
    )
    sheet.save()
    for label in sheet.labels:
        write_pts(folder / label.points, np.arange(12.0).reshape(6, 2))
    points = [[float(i), 2.0] for i in range(6)]
    tools = {
        "labelme": {
            "imagePath": "a_0.png",
            "shapes": [{"label": str(i), "points": [p], "shape_type": "point"} for i, p in enumerate(points)],
        },
        "coco": {
            "images": [{"id": 0, "file_name": "a_0.png"}],
            "annotations": [{"id": 0, "image_id": 0, "keypoints": [v for p in points for v in (*p, 2)]}],
        },
        "via": {
            "k": {
                "filename": "a_0.png",
                "regions": [
                    {
                        "shape_attributes": {"name": "point", "cx": x, "cy": y},
                        "region_attributes": {"l": str(i)},
                    }
                    for i, (x, y) in enumerate(points)
                ],
            }
        },
    }

    def opened(_: Path) -> Any:
        own = Sheet.open(folder)
        return [own.read(label) for label in own.labels], own.closed

    def imported(path: Path) -> Any:
        return {name: sheet.checked(found, path) for name, found in read_tool(path, sheet).items()}

    made = {
        name: Input(files.write_json(folder.parent / f"{name}.json", value), imported)
        for name, value in tools.items()
    }
    return {
        "labels": Input(folder / "labels.json", opened),
        "label points": Input(folder / "a_1.pts", opened),
        **made,
    }


def _own(folder: Path) -> dict[str, Input]:
    keys = [Key(0.1, "aam01", 1.0, 2.0, 0.3, 0.1, "N", 1, 0.5), Key(0.2, "aam02", 3.0, np.inf)]
    gauges = coefficients(("aam01", "aam02"))
    store = CodeStore.join({"a": encode(SPOKEN, "now I", TABLE, CLOCK)}).save(folder / "store")
    words = files.write_text(folder / "own.dict", "# mine\nGRID  G R IH1 D\nnow\tN AW1\nlead 0.99 L EH D\n")

    def held(path: Path) -> Any:
        return key_constraints(read_keys(path), gauges, CLOCK, 25, SPOKEN["phones"])

    return {
        "keys csv": Input(write_keys(folder / "keys.csv", keys), held),
        "keys json": Input(write_keys(folder / "keys.json", keys), held),
        "overrides": Input(words, lambda p: parse("GRID now lead", overrides=read_overrides(p))),
        "code store": Input(store / "codes.json", lambda _: CodeStore.open(store)),
    }
