"""Recordings of landmarks without video become a corpus, in the plane and in space, some of them without sound."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from data_prep.demo import prepare_demo
from data_prep.folder import prepare_folder
from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.formats import Landmarks, write_alignment, write_openface
from dnnvss.media import read_audio, read_video, write_video, write_wav

SHIFT = np.array([5.0, -3.0, 700.0])


def deepened(points: np.ndarray) -> np.ndarray:
    """Points (F, P, 3) of a face that bulges towards the viewer, for points (F, P, 2)."""
    centre = points.mean(axis=(0, 1))
    depth = 0.01 * ((points - centre) ** 2).sum(axis=-1, keepdims=True)
    return np.concatenate([points - centre, depth], axis=-1) + SHIFT


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Corpus:
    return prepare_demo(tmp_path_factory.mktemp("unfilmed") / "demo", sentences=5, size=80, jobs=1)


@pytest.fixture
def raw(demo: Corpus, tmp_path: Path) -> Path:
    """OpenFace CSV at 25 a second by its time stamps, a sound of the same length, words and phone times."""
    home = tmp_path / "raw"
    for u in demo.utterances.values():
        points, valid = demo.landmarks(u)
        times = np.arange(len(points)) / float(u.rate)
        write_openface(home / f"{u.id}.csv", Landmarks(points, valid, times.round(3)))
        files.write_arrays(tmp_path / "deep" / f"{u.id}.npz", points=deepened(points), valid=valid, times=times)
        write_wav(home / f"{u.id}.wav", read_audio(demo.path(u, "audio")), 16000)
        files.write_text(home / f"{u.id}.txt", u.text)
        write_alignment(home / f"{u.id}.TextGrid", u.alignment)
    files.write_json(home / "landmarks.json", {"groups": demo.info.landmark_groups})
    return home


def deep(raw: Path) -> None:
    """Replace the CSV files by points in space."""
    for path in raw.glob("*.csv"):
        path.unlink()
    for path in (raw.parent / "deep").iterdir():
        shutil.copyfile(path, raw / path.name)


def test_landmarks_without_video_are_a_corpus(demo: Corpus, raw: Path, tmp_path: Path) -> None:
    (raw / "demo_002.wav").unlink()
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    assert corpus.utterances.keys() == demo.utterances.keys()
    assert (corpus.info.size, corpus.info.rate) == ((0, 0), demo.info.rate)
    assert (corpus.info.dimensions, corpus.info.unit) == (2, "px")
    for name, u in corpus.utterances.items():
        other = demo.utterances[name]
        assert (u.video, u.frames, u.rate) == (None, other.frames, other.rate)
        points, valid = corpus.landmarks(u)
        np.testing.assert_allclose(points[valid], demo.landmarks(other)[0][valid], atol=1e-5)
        assert valid.mean() > 0.9
        assert u.alignment["phones"].labels == other.alignment["phones"].labels
    assert corpus.utterances["demo_002"].audio is None
    sound = read_audio(corpus.path(corpus.utterances["demo_001"], "audio"))
    np.testing.assert_allclose(sound, read_audio(demo.path(demo.utterances["demo_001"], "audio")), atol=1e-4)
    report = (tmp_path / "out" / "report.md").read_text()
    assert "5 of 5 recordings are landmarks without video, 1 of them without sound" in report
    assert "have 30 frames a second (told by time stamps)" in report
    assert "82 landmarks a frame, 2 coordinates in px" in report


def test_points_in_space_are_a_corpus_and_their_ghosts_are_found(demo: Corpus, raw: Path, tmp_path: Path) -> None:
    deep(raw)
    arrays = read_arrays(raw / "demo_001.npz")
    arrays["points"][10, :, 2] *= np.linspace(0.2, 3, 82)
    files.write_arrays(raw / "demo_001.npz", **arrays)
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", dim=3, jobs=1))
    assert (corpus.info.dimensions, corpus.info.unit) == (3, "mm")
    assert files.read_json(corpus.root / "corpus.json")["dimensions"] == 3
    points, valid = corpus.landmarks(corpus.utterances["demo_001"])
    assert points.shape[1:] == (82, 3) and not valid[10]
    np.testing.assert_allclose(points[valid], arrays["points"][valid], atol=1e-4)
    assert "landmarks that are not the face in" in (tmp_path / "out" / "report.md").read_text()


def test_the_wrong_dimensions_are_said(raw: Path, tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match=r"has no columns X_0, Y_0, Z_0"):
        prepare_folder(raw, tmp_path / "out", dim=3, jobs=1)
    with pytest.raises(DnnvssError, match=r"corpus\.importer\.dim is 4"):
        prepare_folder(raw, tmp_path / "out", dim=4, jobs=1)


def test_the_rate_is_that_of_the_setting_the_description_or_the_stamps(raw: Path, tmp_path: Path) -> None:
    deep(raw)
    marks = files.read_json(raw / "landmarks.json")
    files.write_json(raw / "landmarks.json", {**marks, "rate": "29.97"})
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "described", dim=3, jobs=1))
    assert corpus.info.rate == "30000/1001"
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "set", dim=3, rate=31, jobs=1))
    assert corpus.info.rate == "31"
    assert "its time stamps tell 30 frames a second, 31 are taken" in (tmp_path / "set" / "report.md").read_text()
    files.write_json(raw / "landmarks.json", marks)
    for path in raw.glob("*.npz"):
        arrays = read_arrays(path)
        files.write_arrays(path, **{n: v for n, v in arrays.items() if n != "times"})
    with pytest.raises(DnnvssError, match="frame rate of landmarks without video is not known"):
        prepare_folder(raw, tmp_path / "none", dim=3, jobs=1)


def test_some_recordings_may_have_video(demo: Corpus, raw: Path, tmp_path: Path) -> None:
    for name in ("demo_000", "demo_001", "demo_002"):
        u = demo.utterances[name]
        write_video(raw / f"{name}.mp4", read_video(demo.path(u, "video")), u.rate, read_audio(raw / f"{name}.wav"),
                    16000)
    (raw / "notes.csv").write_text("a,b\n1,2\n")
    lines = (raw / "demo_003.csv").read_text().splitlines()
    lines[5] = ",".join([*lines[5].split(",")[:5], *(f"{900 + i % 9}.0" for i in range(164))])
    (raw / "demo_003.csv").write_text("\n".join(lines))
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    filmed = {name: u.video is not None for name, u in corpus.utterances.items()}
    assert filmed == {"demo_000": True, "demo_001": True, "demo_002": True, "demo_003": False, "demo_004": False}
    assert corpus.info.size == (80, 80)
    report = (tmp_path / "out" / "report.md").read_text()
    assert "2 of 5 recordings are landmarks without video" in report
    assert "landmarks outside the picture in 1 frames (4)" in report


def test_a_csv_that_lacks_the_last_pictures_of_its_video_is_taken(demo: Corpus, raw: Path, tmp_path: Path) -> None:
    for u in demo.utterances.values():
        write_video(raw / f"{u.id}.mp4", read_video(demo.path(u, "video")), u.rate, read_audio(raw / f"{u.id}.wav"),
                    16000)
        lines = (raw / f"{u.id}.csv").read_text().splitlines()
        (raw / f"{u.id}.csv").write_text("\n".join(lines[:-1]))
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    u = corpus.utterances["demo_001"]
    assert len(corpus.utterances) == 5 and u.frames == demo.utterances["demo_001"].frames
    assert not corpus.landmarks(u)[1][-1]


@pytest.mark.parametrize(("name", "text", "reason"), [
    ("demo_001.csv", "frame,success,x_0,y_0\n1,1,2\n", "line 2: 3 columns of 4"),
    ("demo_001.wav", "no sound at all", "demo_001.wav"),
    ("demo_001.txt", " \n", "holds no word"),
])
def test_a_bad_recording_is_dropped_with_its_reason(raw: Path, tmp_path: Path, name: str, text: str,
                                                   reason: str) -> None:
    (raw / name).write_text(text)
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    assert "demo_001" not in corpus.utterances and len(corpus.utterances) == 4
    assert reason in (tmp_path / "out" / "report.md").read_text()


def test_without_sound_phone_times_must_be_given(raw: Path, tmp_path: Path) -> None:
    for suffix in (".wav", ".TextGrid"):
        (raw / f"demo_001{suffix}").unlink()
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    assert "demo_001" not in corpus.utterances
    assert "has neither video nor sound, and no phone times" in (tmp_path / "out" / "report.md").read_text()


def test_a_folder_with_nothing_says_so(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(DnnvssError, match="holds no video and no landmarks"):
        prepare_folder(tmp_path / "empty", tmp_path / "out", jobs=1)
    (tmp_path / "empty" / "DCIM" / "100").mkdir(parents=True)
    (tmp_path / "empty" / "DCIM" / "100" / "A.MP4").touch()
    with pytest.raises(DnnvssError, match=r"1 videos lie in .*100: set corpus.raw to it"):
        prepare_folder(tmp_path / "empty", tmp_path / "out")
