"""Figures of a face model: what they measure, on the toy talker."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from conftest import run_command
from face import aam_cases
from face.aam_cases import CONFIG, SIZE

from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.evaluation import face_figures
from dnnvss.face import clips as clips_module
from dnnvss.face.encoding import encode_corpus
from dnnvss.face.points.settings import PointsSettings
from dnnvss.media import read_video
from dnnvss.render import seen as seen_module
from dnnvss.render.seen import points_figures, residuals, see


@pytest.fixture(scope="module")
def encoded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An encoding of the toy corpus, as the pipeline keeps it."""
    root = tmp_path_factory.mktemp("toy")
    toy = aam_cases.corpus(root, 4)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(clips_module, "video_frames", np.load)
        splits = {"train": ["toy0", "toy1", "toy2"], "test": ["toy3"]}
        return encode_corpus(toy, splits, CONFIG, root / "face", progress=False).folder


def test_figures_of_an_encoding(encoded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(seen_module, "read_video", np.load)
    assert run_command("face-figures", str(encoded), "--utterance", "toy3", "--modes", "2", "--out", str(tmp_path)) == 0
    rows = cv2.imread(str(tmp_path / "reconstruction.png")).astype(int)
    recorded, drawn, wrong = np.split(rows, 3)
    assert np.abs(recorded - drawn)[4:-4].mean() < 1.5 and np.abs(wrong[4:-4, 4:-4] - 128).mean() < 20
    for name in ("modes.png", "residual.png"):
        assert (tmp_path / name).stat().st_size > 5000
    tracked = read_video(tmp_path / "tracked.mp4")
    assert tracked.shape == (20, 2 * SIZE[0], 2 * SIZE[1], 3)


def test_residuals_are_small_where_the_model_sees_and_large_where_points_are_wrong(
    encoded: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(seen_module, "read_video", np.load)
    model, root = face_figures.find_face(encoded)
    corpus = Corpus.open(root)
    seen = see(model, corpus, "toy3")
    found = residuals(model, seen)
    assert found["points, pixels"].max() < 0.5 and found["texture, grey levels"].max() < 4
    seen.landmarks[5, :10] += [4, 0]
    assert residuals(model, seen)["points, pixels"].argmax() == 5
    assert residuals(model, seen)["points, pixels"][5] == pytest.approx(4 * np.sqrt(10 / 15), abs=0.3)
    with pytest.raises(DnnvssError, match="utterance toy9: is not in the corpus"):
        see(model, corpus, "toy9")


def test_a_face_without_texture_shows_what_it_leaves_out_of_the_points(tmp_path: Path) -> None:
    toy = aam_cases.corpus(tmp_path / "toy", 4)
    splits = {"train": ["toy0", "toy1", "toy2"], "test": ["toy3"]}
    settings = PointsSettings(points=aam_cases.POINTS, modes=1, pose_smoothing=0.0)
    face = encode_corpus(toy, splits, settings, tmp_path / "face", progress=False).face
    written = points_figures(tmp_path, face, toy, "toy3")
    assert [p.name for p in written] == ["residual.png"] and written[0].stat().st_size > 5000
