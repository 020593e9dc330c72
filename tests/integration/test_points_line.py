"""The whole row on landmarks in space without video: prepare, train, evaluate, speak, bundle; and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from conftest import composed
from omegaconf import DictConfig

from data_prep.folder import prepare_folder
from dnnvss import files
from dnnvss.commands.speak import synthesise
from dnnvss.commands.train import train
from dnnvss.corpus import Corpus
from dnnvss.corpus.talker import LANDMARK_GROUPS, RATE, perform_take, script
from dnnvss.errors import DnnvssError
from dnnvss.face.points import PointsFace
from dnnvss.formats import Landmarks, write_alignment, write_openface
from dnnvss.media import read_video
from dnnvss.runs.bundling import write_bundle
from dnnvss.runs.run import Run

pytestmark = pytest.mark.slow

SAYS = "Skin, teeth, tongue and light are not shown"


def configure(name: str, *overrides: str) -> DictConfig:
    return composed(name, *overrides)


def write_recordings(raw: Path) -> None:
    """The built-in talker as a tracker of points in space sees it, half a metre away; one recording has no sound."""
    for name, text in script(6, 0).items():
        take = perform_take(name, text, 0)
        flat = take.landmarks(160)
        depth = 0.004 * ((flat - flat.mean(axis=(0, 1))) ** 2).sum(axis=-1, keepdims=True)
        points = np.concatenate([flat - 80, depth + 500], axis=-1)
        clip = Landmarks(points.astype(np.float32), np.ones(len(points), bool), np.arange(len(points)) / RATE)
        write_openface(raw / f"{name}.csv", clip)
        files.write_text(raw / f"{name}.txt", text)
        write_alignment(raw / f"{name}.TextGrid", take.alignment)
    files.write_json(raw / "landmarks.json", {"groups": LANDMARK_GROUPS})


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A corpus of landmarks alone, and a run with a face of points."""
    home = tmp_path_factory.mktemp("points")
    write_recordings(home / "raw")
    prepare_folder(home / "raw", home / "corpus", name="markers", dim=3, val=0.17, test=0.17, jobs=1)
    train(configure("train", *train_settings(home), "face=points", "face.modes=6"))
    return home


def train_settings(home: Path) -> list[str]:
    return ["corpus=folder", "corpus.name=markers", f"corpus.out={home}/corpus", "aam=demo", "visemes=demo",
            f"run={home}/run", "model=feedforward", "folds=0", "trainer.epochs=2",
            "trainer.progress=false", "trainer.figure_every=0",
            "trainer.accelerator=cpu", "model.network.hidden=[32]", "jobs=1"]


def test_the_run_is_evaluated_and_says_what_its_face_cannot_show(home: Path) -> None:
    corpus, run = Corpus.open(home / "corpus"), Run.open(home / "run")
    assert (corpus.info.dimensions, corpus.info.unit, corpus.info.size) == (3, "mm", (0, 0))
    assert all(u.video is None and u.audio is None for u in corpus.utterances.values())
    assert isinstance(run.face, PointsFace) and run.face.dimensions == 3 and run.face.size == 6
    metrics = files.read_json(home / "run" / "metrics.json")
    truth = metrics["liveliness"]["truth"]
    assert truth["closure_recall"] in (None, 1.0) and truth["landmarks"] < 0.5
    page = (home / "run" / "metrics.md").read_text()
    assert "landmarks (mm)" in page and "aperture on p b m (mm)" in page and SAYS in page
    picture = read_video(home / "run" / "sample.mp4")[0]
    assert picture.shape[:2] == run.pictures().size[::-1]
    shown = sorted((home / "run" / "videos").iterdir())
    assert shown and read_video(shown[0]).shape[2] == 3 * picture.shape[1]


def speak(home: Path, run: str, *overrides: str) -> Path:
    synthesise(configure("synth", f"run={home}/{run}", f"out={home}/hello.mp4", "speech=formant", "text=we saw him",
                         *overrides))
    return home / "hello.mp4"


def test_it_speaks_and_exports_its_curves(home: Path) -> None:
    out = speak(home, "run", f"export_curves={home}/curves.csv", "render=face+mesh", "scale=0.5")
    curves = np.genfromtxt(home / "curves.csv", delimiter=",", names=True)
    assert read_video(out).shape[2] == 2 * Run.open(home / "run").pictures(0.5).size[0]
    movement = np.load(home / "hello.npz")
    face = Run.open(home / "run").face
    assert curves.dtype.names is not None and set(face.names) | set(face.gauges) < set(curves.dtype.names)
    row = np.array([curves[name][3] for name in face.names])
    assert curves["aperture"][3] == pytest.approx(face.gauges["aperture"](row), abs=1e-3)
    assert SAYS in files.read_json(home / "hello.json")["face"] and movement.files


def test_a_bundle_speaks_as_the_run_does(home: Path) -> None:
    own = read_video(speak(home, "run"))
    write_bundle(Run.open(home / "run"), home / "bundle")
    assert not (home / "bundle" / "neutral.npz").exists()
    other = read_video(speak(home, "bundle"))
    assert np.abs(own.astype(int) - other).mean() < 0.5


@pytest.mark.parametrize(("overrides", "said"), [
    (["render=patch"], "no view 'patch'"), (["render=reference"], "needs footage"),
    (["into=demo_001"], "has no texture"), (["into=demo_001", "render=reference+face"], "has no texture")])
def test_what_it_cannot_show_is_refused_by_name(home: Path, overrides: list[str], said: str) -> None:
    with pytest.raises(DnnvssError, match=said):
        speak(home, "run", *overrides)


def test_an_appearance_model_is_refused(home: Path) -> None:
    with pytest.raises(DnnvssError, match=r"landmarks have 3 coordinates.*face=points"):
        train(configure("train", *train_settings(home), f"run={home}/aam"))
