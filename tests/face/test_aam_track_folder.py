"""Thirty labels to landmarks of every frame: the command, from videos and a folder of labels."""

import shutil
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from conftest import run_command
from face import search_cases as cases

from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.corpus.talker import LANDMARK_GROUPS
from dnnvss.errors import DnnvssError
from dnnvss.face.aam import tracking as program
from dnnvss.face.aam.labelling.sheet import Label, Sheet
from dnnvss.face.aam.search.model import SearchModel, SearchSettings
from dnnvss.face.aam.search.track import Track
from dnnvss.formats import read_landmarks
from dnnvss.formats.landmarks import write_pts
from dnnvss.media import read_video, video_frames, write_video
from dnnvss.media.pictures import write_picture

FRAMES = 24


@pytest.fixture(scope="module")
def material(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Return a folder of two videos, and one of 16 finished labels cut from them."""
    root = tmp_path_factory.mktemp("track")
    videos, labels = root / "videos", root / "labels"
    rows: list[Label] = []
    for number in (0, 1):
        pictures, points = cases.clip(number)
        video = write_video(videos / f"s{number}.mp4", pictures[:FRAMES], 25, quality=14)
        seen = read_video(video)
        for frame in range(0, FRAMES, 3):
            stem = f"s{number}_{frame:06d}"
            labels.mkdir(exist_ok=True)
            write_picture(labels / f"{stem}.png", seen[frame])
            write_pts(labels / f"{stem}.pts", points[frame])
            rows.append(Label(video.name, frame, f"{stem}.png", f"{stem}.pts"))
    sizes = [LANDMARK_GROUPS[g][1] - LANDMARK_GROUPS[g][0] for g in cases.GROUPS]
    ends = np.cumsum(sizes).tolist()
    groups = {g: (e - s, e) for g, s, e in zip(cases.GROUPS, sizes, ends, strict=True)}
    Sheet(labels, groups, tuple(rows), frozenset(r.image for r in rows), "talker", str(videos)).save()
    return labels, videos


def test_labels_become_landmarks_of_every_frame(material: tuple[Path, Path],
                                                capsys: pytest.CaptureFixture[str]) -> None:
    labels, videos = material
    assert run_command("track", labels, videos, "--jobs", "2") == 0  # two processes, as a user has them
    assert f"{2 * FRAMES} of {2 * FRAMES} frames of 2 videos are tracked" in capsys.readouterr().out
    for number in (0, 1):
        found = read_landmarks(videos / f"s{number}.npz")
        assert found.valid.all()
        assert cases.error(found.points, cases.clip(number)[1][:FRAMES]).max() < 0.8
        arrays = read_arrays(videos / f"s{number}.npz")
        assert arrays["error"].shape == arrays["flag"].shape == (FRAMES,)
    assert files.read_json(videos / "landmarks.json")["groups"]["lips_inner"] == list(
        np.array(LANDMARK_GROUPS["lips_inner"]) - LANDMARK_GROUPS["lips_outer"][0])


def test_a_second_call_tracks_only_what_is_missing(material: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch,
                                                   tmp_path: Path) -> None:
    labels, videos = material
    tracked: list[str] = []
    inner = program.track_video
    monkeypatch.setattr(program, "track_video", lambda m, v: (tracked.append(v.stem), inner(m, v))[1])
    program.track_folder(labels, videos, tmp_path, jobs=1)
    (tmp_path / "s1.npz").unlink()
    program.track_folder(labels, videos, tmp_path, jobs=1)
    assert sorted(tracked) == ["s0", "s1", "s1"]


@pytest.fixture
def tracked(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Return the names of the videos that are tracked from now on, by a model that is fitted fast; tracks are true."""
    names: list[str] = []

    def track_video(model: SearchModel, video: Path) -> Track:
        names.append(video.name)
        count = len(list(video_frames(video)))
        return Track(cases.clip(int(video.stem[1]))[1][:count].astype(np.float32), np.full(count, 0.01, np.float32),
                     np.zeros(count, np.int8))

    monkeypatch.setattr(program, "track_video", track_video)
    return names


FAST = SearchSettings(scales=(1.0,), most_pixels=500)


def test_a_video_that_was_replaced_is_tracked_again(material: tuple[Path, Path], tracked: list[str], tmp_path: Path
                                                    ) -> None:
    labels, videos = material
    shutil.copytree(videos, tmp_path / "videos", ignore=shutil.ignore_patterns("tracking", "*.npz"))
    again = partial(program.track_folder, labels, tmp_path / "videos", jobs=1, settings=FAST)
    again()
    shutil.move(tmp_path / "videos", tmp_path / "moved")  # new times, the same videos
    shutil.copytree(tmp_path / "moved", tmp_path / "videos", copy_function=shutil.copyfile)
    again()
    assert sorted(tracked) == ["s0.mp4", "s1.mp4"]
    write_video(tmp_path / "videos" / "s1.mp4", cases.clip(1)[0][:6], 25)
    again()
    assert sorted(tracked) == ["s0.mp4", "s1.mp4", "s1.mp4"]
    assert len(read_landmarks(tmp_path / "videos" / "s1.npz").points) == 6


def test_learning_from_own_frames_is_not_done_twice(material: tuple[Path, Path], tracked: list[str], tmp_path: Path
                                                    ) -> None:
    again = partial(program.track_folder, *material, tmp_path, jobs=1, settings=FAST)
    again(own=5)
    assert sorted(tracked) == ["s0.mp4"] * 2 + ["s1.mp4"] * 2
    models = {p.name: p.read_bytes() for p in (tmp_path / "tracking").glob("*.npz")}
    assert sorted(models) == ["search.npz", "search_own.npz"]
    again(own=5)
    (tmp_path / "s1.npz").unlink()
    again(own=5)
    assert tracked[4:] == ["s1.mp4"]  # by the second model alone
    assert models == {p.name: p.read_bytes() for p in (tmp_path / "tracking").glob("*.npz")}
    again(own=4)
    assert len(tracked) == 9 and models["search_own.npz"] != (tmp_path / "tracking" / "search_own.npz").read_bytes()


def test_two_videos_of_one_name_are_refused(material: tuple[Path, Path], tmp_path: Path) -> None:
    for name in ("b.mp4", "b.mov"):
        shutil.copyfile(material[1] / "s0.mp4", tmp_path / name)
    with pytest.raises(DnnvssError, match=r"b\.mp4: has the name of .*b\.mov, .*b\.npz"):
        program.track_folder(material[0], tmp_path, jobs=1)


def test_a_video_that_cannot_be_read_is_named_and_left_out(material: tuple[Path, Path], tmp_path: Path) -> None:
    labels, videos = material
    shutil.copy(videos / "s0.mp4", tmp_path / "s0.mp4")
    (tmp_path / "torn.mp4").write_bytes((videos / "s1.mp4").read_bytes()[:2000])
    report = program.track_folder(labels, tmp_path, jobs=1)
    assert (tmp_path / "s0.npz").is_file() and not (tmp_path / "torn.npz").exists()
    assert "torn: cannot be read" in program.summary(report)


def test_a_long_video_is_tracked_in_pieces(material: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program, "_MEMORY", 10 * cases.SIZE * cases.SIZE * 3)
    found = program.track_video(cases.model(), material[1] / "s0.mp4")
    assert found.points.shape[0] == FRAMES and found.valid.all()
    assert cases.error(found.points, cases.clip(0)[1][:FRAMES]).max() < 0.8


def test_landmarks_of_others_are_not_overwritten(material: tuple[Path, Path], tmp_path: Path) -> None:
    files.write_arrays(tmp_path / "s0.npz", points=np.zeros((3, 5, 2)))
    with pytest.raises(DnnvssError, match="did not write"):
        program.track_folder(*material, tmp_path, jobs=1)


def test_unfinished_labels_are_refused(material: tuple[Path, Path], tmp_path: Path) -> None:
    sheet = Sheet.open(material[0])
    stem = sheet.labels[0].image
    files.write_json(tmp_path / "labels.json", {**files.read_json(material[0] / "labels.json"),
                                                "done": sorted(sheet.done - {stem})})
    with pytest.raises(DnnvssError, match="still a guess"):
        program.track_folder(tmp_path, material[1], tmp_path, jobs=1)
