"""What lies beside a small corpus and its runs before the trials of ``kills.py``: as users and other tools leave it."""

import contextlib
import json
import shutil
import sys
from pathlib import Path

import numpy as np


def write_all(home: Path) -> None:
    """Write recordings, labels, takes, and a viewing test with its answers, of the corpus in ``data``."""
    for write in (recorded, labelled, _taken, _viewed):
        write(home)


def recorded(home: Path) -> None:
    """Recordings as a user has them, in ``raw``: silent videos with sound, words, landmarks and phone times beside."""
    from dnnvss.corpus import Corpus
    from dnnvss.formats import write_alignment

    corpus, raw = Corpus.open(home / "data"), home / "raw"
    raw.mkdir()
    for u in list(corpus.utterances.values())[:4]:
        for kind, suffix in (("video", "mp4"), ("audio", "wav"), ("landmarks", "npz")):
            shutil.copyfile(corpus.path(u, kind), raw / f"{u.id}.{suffix}")
        (raw / f"{u.id}.txt").write_text(u.text)
        write_alignment(raw / f"{u.id}.TextGrid", u.alignment)
    (raw / "landmarks.json").write_text(json.dumps({"groups": corpus.info.landmark_groups}))


def labelled(home: Path) -> None:
    """Finished labels of the recordings in ``labels``, and the same as another tool writes them in ``coco.json``."""
    from dnnvss.corpus import Corpus
    from dnnvss.face.aam.labelling.sheet import Label, Sheet
    from dnnvss.formats.landmarks import write_pts
    from dnnvss.media import read_video
    from dnnvss.media.pictures import write_picture

    corpus, labels = Corpus.open(home / "data"), home / "labels"
    labels.mkdir()
    rows, images, annotations = [], [], []
    for u in list(corpus.utterances.values())[:2]:
        frames, points = read_video(corpus.path(u, "video")), corpus.landmarks(u)[0]
        for frame in range(0, len(frames), len(frames) // 6):
            stem = f"{u.id}_{frame}"
            write_picture(labels / f"{stem}.png", frames[frame])
            write_pts(labels / f"{stem}.pts", points[frame])
            rows.append(Label(f"{u.id}.mp4", frame, f"{stem}.png", f"{stem}.pts"))
            number = len(rows)
            images.append({"id": number, "file_name": f"{stem}.png"})
            moved = np.c_[points[frame] + 0.25, np.full(len(points[frame]), 2)]
            annotations.append({"id": number, "image_id": number, "keypoints": moved.ravel().tolist()})
    Sheet(labels, dict(corpus.info.landmark_groups), tuple(rows), frozenset(r.image for r in rows), "talker",
          str(home / "raw")).save()
    (home / "coco.json").write_text(json.dumps({"images": images, "annotations": annotations}))


def _taken(home: Path) -> None:
    """Takes of the curves of a rig in ``takes``, with their sound, words and phone times."""
    from dnnvss.corpus import Corpus
    from dnnvss.formats import Curves, write_alignment, write_curves

    corpus, takes = Corpus.open(home / "data"), home / "takes"
    takes.mkdir()
    for k, u in enumerate(list(corpus.utterances.values())[:3]):
        times = np.arange(round(30 * u.alignment.end)) / 30
        values = 0.5 + 0.4 * np.sin(2 * np.pi * (k + 1) * times[:, None] + np.arange(2))
        write_curves(takes / f"t{k}.csv", Curves(("jawOpen", "mouthClose"), values, times))
        shutil.copyfile(corpus.path(u, "audio"), takes / f"t{k}.wav")
        (takes / f"t{k}.txt").write_text(u.text)
        write_alignment(takes / f"t{k}.TextGrid", u.alignment)


def _viewed(home: Path) -> None:
    """The design of a viewing test, the test that was made by it, and simulated answers."""
    import yaml
    from viewing_cases import CONF, plain, simulated

    from dnnvss.commands.viewing import main
    from dnnvss.evaluation.viewing.sheet import Sheet

    design = yaml.safe_load((CONF / "preference.yaml").read_text())
    small = {"sentences": 1, "per_viewer": 1, "practice": 0, "checks": 0}
    (home / "design.yaml").write_text(yaml.safe_dump({**design, **small}))
    with contextlib.redirect_stdout(sys.stderr):
        main(["make", *(str(home / n) for n in ("design.yaml", "runs/a", "runs/v")), "--out", str(home / "test")])
    sheet = Sheet.open(home / "test")
    quality = {condition.name: float(k) for k, condition in enumerate(sheet.conditions)}
    (home / "test/answers").mkdir()
    for number in range(4):
        (home / f"test/answers/{number}.json").write_text(json.dumps(plain(simulated(sheet, number, quality))))
