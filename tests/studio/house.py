"""A working directory in which somebody has worked: a corpus, a first look, labels, runs, results, a viewing test."""

import json
import shutil
from pathlib import Path

import numpy as np
from conftest import run_command
from face.aam_cases import picture
from films import talker_folder
from viewing_cases import design, plain, sheet_of, simulated, write_test

from data_prep.folder import prepare_folder
from data_prep.look import first_look
from dnnvss.evaluation.viewing.analysis import analyse
from dnnvss.evaluation.viewing.answers import receive
from dnnvss.evaluation.viewing.report import write_report
from dnnvss.face.aam.labelling.sheet import Label, Sheet
from dnnvss.formats.landmarks import write_pts
from dnnvss.media.pictures import write_picture

POINTS = np.array([[30, 40], [40, 36], [50, 40], [40, 44], [28, 60], [52, 60]], dtype=float)


def furnish(house: Path, demo: Path) -> Path:
    """Fill a working directory, and return it.

    Args:
        house: the directory.
        demo: a prepared corpus.
    """
    shutil.copytree(demo, house / "data" / "demo")
    prepare_folder(talker_folder(house / "recordings", 3, 80), house / "data" / "look", then=first_look)
    _labels(house / "labels")
    _viewing(house / "viewing")
    assert run_command("train", "corpus=demo", f"corpus.out={house / 'data' / 'demo'}", "model=feedforward",
                       "trainer.epochs=2", "trainer.figure_every=1", "trainer.progress=false",
                       f"runs={house / 'runs'}") == 0
    assert run_command("compare", *map(str, (house / "runs").glob("demo-*"))) == 0
    return house


def _labels(folder: Path) -> None:
    """Three frames to label."""
    own = tuple(Label("a.mp4", i, f"a_{i}.png", f"a_{i}.pts") for i in range(3))
    for i, label in enumerate(own):
        write_picture(folder / label.image, picture(i))
        write_pts(folder / label.points, POINTS + i)
    Sheet(folder, {"lips_outer": (0, 4), "jaw": (4, 6)}, own, frozenset(), "own").save()


def _viewing(folder: Path) -> None:
    """A test that six viewers have answered, and its result."""
    sheet = sheet_of(design("preference"))
    write_test(folder, sheet)
    sent = {f"{n}.json": json.dumps(plain(simulated(sheet, n, {"good": 1.0, "bad": -1.0}))) for n in range(6)}
    (folder / "answers").mkdir()
    for name, text in sent.items():
        (folder / "answers" / name).write_text(text)
    write_report(analyse(sheet, receive(sheet, [(n, t.encode()) for n, t in sent.items()])), folder)
