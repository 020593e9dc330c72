"""A folder of recordings becomes a corpus; what is wrong with a recording is said, and costs that recording alone."""

import errno
import os
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from films import talker_folder

from data_prep.folder import _alone, _landmarks, _marks, _others, prepare_folder
from data_prep.landmarks import read_raw
from data_prep.recipe import Source, own_lexicon
from data_prep.shelf import Shelf
from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.face.landmarker import ROWS, find_task, mesh_groups
from dnnvss.formats import read_npz, write_openface, write_pts
from dnnvss.media import read_audio, read_video, write_video, write_wav


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five recordings of the built-in talker as a user has them: video with sound, words, landmarks, phone times."""
    return talker_folder(tmp_path_factory.mktemp("folder"), 5, 80)


@pytest.fixture
def raw(recordings: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(recordings, tmp_path / "raw"))


def test_everything_is_taken_over(recordings: Path, tmp_path: Path) -> None:
    corpus = Corpus.open(prepare_folder(recordings, tmp_path / "out", jobs=1))
    demo = Corpus.open(recordings.parent / "demo")
    assert corpus.utterances.keys() == demo.utterances.keys() and corpus.info.size == (80, 80)
    for name, u in corpus.utterances.items():
        other = demo.utterances[name]
        assert (u.text, u.frames, u.rate) == (other.text, other.frames, other.rate)
        assert u.alignment["phones"].labels == other.alignment["phones"].labels
        np.testing.assert_allclose(u.alignment["phones"].edges[:-1], other.alignment["phones"].edges[:-1], atol=1e-3)
        points, valid = corpus.landmarks(u)
        np.testing.assert_array_equal(points[valid], demo.landmarks(other)[0][valid])
        assert valid.mean() > 0.9  # five clips are few to tell a quick movement from a ghost
    assert sum(len(corpus.split(s)) for s in ("train", "val", "test")) == 5


def test_landmarks_that_no_video_has_are_found_in_the_pictures(raw: Path, tmp_path: Path) -> None:
    try:
        find_task()
    except DnnvssError:
        pytest.skip("face_landmarker.task is not installed: make extras")
    spared = sorted(path.stem for path in raw.glob("*.mp4"))[3:]  # three are enough
    for path in (*raw.glob("*.npz"), raw / "landmarks.json", *(p for stem in spared for p in raw.glob(f"{stem}.*"))):
        path.unlink(missing_ok=True)
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    first, end = corpus.info.landmark_groups["lips_inner"]
    assert end - first == 20 and "were found in their pictures" in (tmp_path / "out" / "report.md").read_text()
    for u in corpus.utterances.values():
        points, valid = corpus.landmarks(u)
        lips = points[valid][:, first:end].mean(axis=1)
        assert points.shape[1] == 146 and valid.mean() > 0.75 and np.abs(lips[:, 0] - 40).max() < 4


def test_the_points_of_a_whole_mesh_are_known_by_their_number(raw: Path, tmp_path: Path) -> None:
    (raw / "landmarks.json").unlink()
    rng = np.random.default_rng(0)
    kept = {}
    for path in raw.glob("*.npz"):
        frames = len(read_npz(path).points)
        kept[path.stem] = (20 + 40 * rng.random(478 * 2)).reshape(1, 478, 2) + rng.normal(0, 0.1, (frames, 478, 2))
        files.write_arrays(path, points=kept[path.stem].astype(np.float32), valid=np.ones(frames, bool))
    recordings, rows = _marks(raw, [Source(i, landmarks=(raw / f"{i}.npz",)) for i in sorted(kept)], 2)
    assert recordings.groups == mesh_groups() and rows == tuple(ROWS.tolist())
    name, points = next(iter(kept.items()))
    read_raw(name, tmp_path / "out", (raw / f"{name}.npz",), 1.0, len(points), (80, 80), rows=rows)
    found = read_arrays(tmp_path / "out" / ".stages" / "landmarks" / f"{name}.npz")["points"]
    np.testing.assert_allclose(found, points[:, ROWS], atol=1e-5)
    deep = np.concatenate([points / 80, np.full((len(points), 478, 1), -0.1)], axis=2)  # shares of the picture, depth
    files.write_arrays(raw / f"{name}.npz", points=deep.astype(np.float32), valid=np.ones(len(points), bool))
    told = read_raw(name, tmp_path / "out", (raw / f"{name}.npz",), 1.0, len(points), (80, 80), rows=rows)
    found = read_arrays(tmp_path / "out" / ".stages" / "landmarks" / f"{name}.npz")["points"]
    np.testing.assert_allclose(found, points[:, ROWS], atol=1e-4)
    assert told["shares"]


def test_ids_may_hold_spaces_and_given_splits_stay(raw: Path, tmp_path: Path) -> None:
    names = {"demo_001": "clip", "demo_002": "clip 2", "demo_003": "clip 3"}
    for old, new in names.items():
        for path in sorted(raw.glob(f"{old}.*")):
            path.rename(raw / f"{new}{path.suffix}")
    files.write_text(raw / "splits" / "test.txt", "clip 2\nclip\n")
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    assert [u.id for u in corpus.split("test")] == ["clip 2", "clip"]
    others = [u.id for s in ("train", "val") for u in corpus.split(s)]
    assert len(others) == 3 and not set(others) & {"clip", "clip 2"}
    files.write_text(corpus.root / "splits" / "val.txt", "clip\n")
    with pytest.raises(DnnvssError, match="test and val both name clip"):
        corpus.split("train")
    with pytest.raises(DnnvssError, match=r"unseen_train\.txt: no such file\. Choose one of the splits \['test'"):
        corpus.split("train", "unseen")


def test_changed_recordings_and_landmarks_are_taken_anew(raw: Path, tmp_path: Path,
                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    first = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    u, seen = first.utterances["demo_001"], [first.fingerprint]
    points, sound = first.landmarks(u)[0], read_audio(first.path(u, "audio"))

    def again() -> Corpus:
        corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
        seen.append(corpus.fingerprint)
        return corpus

    for work in ("recordings.media", "checks.read_raw", "sounds.in_step", "checks.write_clean", "digests.digested"):
        monkeypatch.setattr(f"data_prep.{work}", None)
    assert again().fingerprint == first.fingerprint  # nothing changed, nothing done
    monkeypatch.undo()
    arrays = read_arrays(raw / "demo_001.npz")
    files.write_arrays(raw / "demo_001.npz", **{**arrays, "points": arrays["points"] + np.float32(0.25)})
    np.testing.assert_allclose(again().landmarks(u)[0], points + 0.25, atol=1e-5)
    write_video(raw / "demo_001.mp4", read_video(raw / "demo_001.mp4"), u.rate, sound / 2, 16000)
    changed = read_audio(again().path(u, "audio"))
    assert np.abs(changed).max() == pytest.approx(np.abs(sound).max() / 2, rel=0.1)
    marks = files.read_json(raw / "landmarks.json")
    files.write_json(raw / "landmarks.json", {**marks, "scale": 1.25})
    np.testing.assert_allclose(again().landmarks(u)[0], (points + 0.25) / 1.25, atol=1e-5)
    out = tmp_path / "out" / "splits"
    files.write_text(raw / "splits" / "test.txt", (out / "val.txt").read_text())
    again()
    assert len(set(seen)) == 5 and seen[0] == seen[1]


def test_landmarks_of_another_picture_size_are_dropped(raw: Path, tmp_path: Path) -> None:
    arrays = read_arrays(raw / "demo_001.npz")
    files.write_arrays(raw / "demo_001.npz", **{**arrays, "points": 2 * arrays["points"]})
    few = read_arrays(raw / "demo_002.npz")
    few["points"][3:5, :9] -= 80
    files.write_arrays(raw / "demo_002.npz", **few)
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    report = (tmp_path / "out" / "report.md").read_text()
    assert "demo_001" not in corpus.utterances
    assert re.search(r"demo_001\.npz: utterance demo_001: landmarks reach over x \d+ to 1\d\d and y \d+ to 1\d\d, "
                     r"the video is 80 x 80 pixels. Track this very video, or set scale", report)
    assert "landmarks outside the picture in 2 frames (3-4)" in report
    assert np.flatnonzero(~corpus.landmarks(corpus.utterances["demo_002"])[1])[:2].tolist() == [3, 4]


def test_splits_that_cannot_be_completed_are_told_before_the_work(raw: Path, tmp_path: Path) -> None:
    files.write_text(raw / "splits" / "train.txt", "".join(f"demo_00{k}\n" for k in range(5)))
    with pytest.raises(DnnvssError, match="too few utterances are left for val and test"):
        prepare_folder(raw, tmp_path / "out", jobs=1)
    files.write_text(raw / "splits" / "test.txt", "demo_004\n")
    with pytest.raises(DnnvssError, match="test and train both name demo_004"):
        prepare_folder(raw, tmp_path / "out", jobs=1)
    assert not (tmp_path / "out").exists()


def test_an_id_that_cannot_stand_in_a_split_file_or_name_files_is_dropped(raw: Path, tmp_path: Path) -> None:
    for old, new in (("demo_001", " clip"), ("demo_002", "com1"), ("demo_003", "a\\b")):
        for path in sorted(raw.glob(f"{old}.*")):
            path.rename(raw / f"{new}{path.suffix}")
    with pytest.raises(DnnvssError, match="2 utterances cannot be split"):
        prepare_folder(raw, tmp_path / "out", jobs=1)
    report = (tmp_path / "out" / "report.md").read_text()
    assert "the name ' clip' begins or ends with a space" in report
    assert all(f"not every system has files of the name {name}" in report for name in ("'com1'", "'a\\\\b'"))


def test_pts_files_are_those_of_the_id_alone(tmp_path: Path) -> None:
    for stem in ("clip_000002", "clip_000001", "clip_2_000001", "clip_a", "clip_"):
        write_pts(tmp_path / f"{stem}.pts", np.zeros((68, 2)))
    assert [p.stem for p in _landmarks(Shelf(tmp_path), "clip")] == ["clip_000001", "clip_000002"]
    assert [p.stem for p in _landmarks(Shelf(tmp_path), "clip_2")] == ["clip_2_000001"]


def test_a_file_that_differs_in_case_alone_is_named(tmp_path: Path) -> None:
    for name in ("clip.MP4", "clip.mp4", "clip.txt", "caf\u00e9.mp4", "cafe\u0301.mp4"):
        (tmp_path / name).touch()
    shelf = Shelf(tmp_path)
    assert _others(shelf, "clip", shelf.get("clip", ".mp4")) == ("there is also clip.mp4: clip.MP4 is taken",)
    assert len(_others(shelf, "caf\u00e9", shelf.get("caf\u00e9", ".mp4"))) == 1


def test_a_text_without_a_recording_is_told(tmp_path: Path) -> None:
    for name in ("a.mp4", "a.txt", "A b.srt", "lonely.txt", "README.txt", "c.lab", "d.csv"):
        (tmp_path / name).touch()
    (told,) = _alone(Shelf(tmp_path), {"a"})
    assert told == "Texts that are not used, for no recording has their name (3): A b.srt, c.lab, lonely.txt"
    assert _alone(Shelf(tmp_path), {"a", "c", "lonely", "A b"}) == ()


def test_a_link_to_a_video_that_is_not_there_is_a_recording_that_is_dropped(raw: Path, tmp_path: Path) -> None:
    (raw / "demo_001.mp4").unlink()
    (raw / "demo_001.mp4").symlink_to(tmp_path / "nowhere.mp4")
    assert "demo_001" not in Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1)).utterances
    assert "demo_001.mp4: no such file" in (tmp_path / "out" / "report.md").read_text()


def spoil_transcript(raw: Path) -> None:
    (raw / "demo_001.txt").unlink()


def empty_transcript(raw: Path) -> None:
    (raw / "demo_001.txt").write_text(" \n")


def spoil_video(raw: Path) -> None:
    (raw / "demo_001.mp4").write_bytes(b"no video at all")


def silence_video(raw: Path) -> None:
    write_video(raw / "demo_001.mp4", read_video(raw / "demo_001.mp4"), 30)


def shorten_landmarks(raw: Path) -> None:
    arrays = read_arrays(raw / "demo_001.npz")
    files.write_arrays(raw / "demo_001.npz", **{k: v[:-5] for k, v in arrays.items()})


def spoil_landmarks(raw: Path) -> None:
    arrays = read_arrays(raw / "demo_001.npz")
    arrays["points"][7] = np.nan
    files.write_arrays(raw / "demo_001.npz", **arrays)


def remove_landmarks(raw: Path) -> None:
    (raw / "demo_001.npz").unlink()


def unknown_phone(raw: Path) -> None:
    (raw / "demo_001.TextGrid").unlink()
    (raw / "demo_001.lab").write_text("0 5000000 sil\n5000000 9000000 QQ\n")


def gap(raw: Path) -> None:
    (raw / "demo_001.TextGrid").unlink()
    (raw / "demo_001.lab").write_text("0 5000000 sil\n6000000 30000000 AA\n")


def overlap(raw: Path) -> None:
    (raw / "demo_001.TextGrid").unlink()
    (raw / "demo_001.lab").write_text("0 5000000 sil\n4000000 30000000 AA\n")


@pytest.mark.parametrize("spoil, reason", [
    (spoil_transcript, "demo_001.txt: no such file"), (empty_transcript, "holds no word"),
    (spoil_video, "demo_001.mp4"), (silence_video, "has no sound"), (shorten_landmarks, "holds landmarks of"),
    (spoil_landmarks, "frame 7 are NaN"), (remove_landmarks, "no landmarks"), (unknown_phone, "'QQ'"),
    (gap, "gap"), (overlap, "overlap")], ids=lambda v: getattr(v, "__name__", ""))
def test_a_bad_recording_is_dropped_with_its_reason(raw: Path, tmp_path: Path, spoil: Callable[[Path], None],
                                                   reason: str) -> None:
    spoil(raw)
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    assert "demo_001" not in corpus.utterances and len(corpus.utterances) == 4
    report = (tmp_path / "out" / "report.md").read_text()
    assert "demo_001" in report and reason in report
    with pytest.raises(DnnvssError, match="demo_001"):
        prepare_folder(raw, tmp_path / "strict", jobs=1, strict=True)
    assert not (tmp_path / "strict" / "corpus.json").exists()


def test_a_video_without_sound_takes_the_one_beside_it(raw: Path, tmp_path: Path) -> None:
    whole = Corpus.open(prepare_folder(raw, tmp_path / "whole", jobs=1))
    name = "demo_001"
    sound = read_audio(raw / f"{name}.mp4")
    silence_video(raw)
    write_wav(raw / f"{name}.wav", sound, 16000)
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    assert name in corpus.utterances
    ours, theirs = (c.sound(c.utterances[name]).samples for c in (corpus, whole))
    assert len(ours) == len(theirs) and np.corrcoef(ours, theirs)[0, 1] > 0.99


def test_a_folder_without_videos_and_unknown_landmarks_are_refused(raw: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(DnnvssError, match="holds no video"):
        prepare_folder(tmp_path / "empty", tmp_path / "out", jobs=1)
    (raw / "landmarks.json").unlink()
    with pytest.raises(DnnvssError, match="82 landmarks a frame, and their groups are not known"):
        prepare_folder(raw, tmp_path / "out", jobs=1)
    assert not (tmp_path / "out").exists()


def test_phones_are_heard_where_no_times_are_given_and_landmarks_come_in_any_form(raw: Path, tmp_path: Path) -> None:
    demo = Corpus.open(prepare_folder(raw, tmp_path / "given", jobs=1))
    for path in raw.glob("*.TextGrid"):
        path.unlink()
    for k, name in enumerate(sorted(demo.utterances)):
        marks = read_npz(raw / f"{name}.npz")
        if k == 0:
            for frame, points in enumerate(marks.points):
                write_pts(raw / name / f"{frame:04d}.pts", points)
        elif k == 1:
            for frame, points in enumerate(marks.points):
                write_pts(raw / f"{name}_{frame + 1:06d}.pts", points)
        elif k == 2:
            write_openface(raw / f"{name}.csv", marks)
        if k < 3:
            (raw / f"{name}.npz").unlink()
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "heard", jobs=1))
    assert corpus.utterances.keys() == demo.utterances.keys()
    for name, u in corpus.utterances.items():
        points, valid = corpus.landmarks(u)
        np.testing.assert_allclose(points[valid], demo.landmarks(demo.utterances[name])[0][valid], atol=1e-4)
        starts = [[s.start for s in x.alignment["words"] if s.label] for x in (u, demo.utterances[name])]
        assert np.median(np.abs(np.subtract(*starts))) < 0.03


def place_of(path: Path, out: Path) -> str:
    """Name the kind of a file in a corpus: its folder, or its own name at the top."""
    inside = path.relative_to(out)
    return inside.parent.as_posix() if len(inside.parts) > 1 else inside.name


def test_a_disk_that_is_full_ends_every_stage_in_one_line_and_is_resumed(
    recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, out, seen, full = files.replacing, tmp_path / "out", [], []

    @contextmanager
    def watched(path: str | Path) -> Iterator[Path]:
        with real(path) as temporary:
            yield temporary
            if (place := place_of(Path(path), out)) not in seen:
                seen.append(place)
                full.append(path)
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    for module in (files, files.writing):
        monkeypatch.setattr(module, "replacing", watched)
    for _ in range(99):
        stopped = len(full)
        try:
            prepare_folder(recordings, out, jobs=1)
        except DnnvssError as error:
            assert len(full) == stopped + 1 and Path(str(error.file)) == full[-1]
            assert "No space left" in str(error) and "it resumes" in str(error) and "\n" not in str(error)
            assert not list(out.rglob(".*part*")) and not (out / "corpus.json").exists()
        else:
            break
    assert {"video", ".stages/media", ".stages/sound", ".stages/landmarks", "audio", "landmarks",
            ".stages/given alignment", ".stages/digest", "splits", "report.md", "utterances.jsonl",
            "corpus.json"} <= set(seen)
    monkeypatch.undo()
    whole = Corpus.open(prepare_folder(recordings, tmp_path / "whole", jobs=1))
    assert Corpus.open(out).fingerprint == whole.fingerprint


def test_a_copy_onto_a_full_disk_is_no_fault_of_the_recording(
    recordings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(source: Path, target: Path) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(source), None, str(target))

    monkeypatch.setattr(shutil, "copyfile", full)
    with pytest.raises(DnnvssError, match=r"out/video/demo_000\.mp4: cannot be written \(No space"):
        prepare_folder(recordings, tmp_path / "out", jobs=1)


@pytest.mark.parametrize("blocked", ["", "corpus.json", "video", ".stages", ".stages/media", "splits"])
def test_a_place_that_cannot_be_written_is_said_in_one_line(
    blocked: str, recordings: Path, tmp_path: Path
) -> None:
    """A file where a folder is to be, or a folder where a file: that stops the user with all rights too."""
    path = tmp_path / "out" / blocked
    if blocked == "corpus.json":
        (path / "inside").mkdir(parents=True)
    else:
        files.write_text(path, "in the way")
    with pytest.raises(DnnvssError, match=r"out.*cannot be (written|removed) .*Choose another place"):
        prepare_folder(recordings, tmp_path / "out", jobs=1)


def test_files_that_systems_hide_and_folders_are_no_recordings(raw: Path, tmp_path: Path) -> None:
    for name in ("._demo_001.mp4", ".DS_Store", "._demo_001.npz"):
        (raw / name).write_bytes(b"\0")
    (raw / "edits.mp4").mkdir()
    said = (raw / "demo_002.txt").read_text("utf-8")
    (raw / "demo_002.txt").write_bytes(said.encode("utf-16"))
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1, strict=True))
    assert sorted(corpus.utterances) == [f"demo_00{i}" for i in range(5)]
    assert corpus.utterances["demo_002"].text == said


@pytest.mark.parametrize("group, said", [
    ([0, 4000], r"runs from 0 to 4000, and a frame has \d+"), ([4, 4], "runs from 4 to 4"), ([-4, 4], "runs from -4"),
    ([9, 4], "runs from 9 to 4")])
def test_groups_beyond_the_landmarks_are_refused_at_once(
    raw: Path, tmp_path: Path, group: list[int], said: str
) -> None:
    files.write_json(raw / "landmarks.json", {"groups": {"lips_outer": group}})
    with pytest.raises(DnnvssError, match=f"lips_outer {said}"):
        prepare_folder(raw, tmp_path / "out", jobs=1)


def test_landmarks_in_one_place_are_no_face(raw: Path, tmp_path: Path) -> None:
    arrays = read_arrays(raw / "demo_001.npz")
    arrays["points"][4:7] = 0.0
    files.write_arrays(raw / "demo_001.npz", **arrays)
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    points, valid = corpus.landmarks(corpus.utterances["demo_001"])
    assert not valid[4:7].any() and (np.ptp(points, axis=1) > 1).all()
    assert "landmarks not found in" in (tmp_path / "out" / "report.md").read_text()


def test_an_id_counts_once_in_a_split(raw: Path, tmp_path: Path) -> None:
    files.write_text(raw / "splits" / "test.txt", "demo_001\ndemo_002\ndemo_001\n")
    corpus = Corpus.open(prepare_folder(raw, tmp_path / "out", jobs=1))
    assert [u.id for u in corpus.split("test")] == ["demo_001", "demo_002"]


@pytest.mark.parametrize("phones, said", [("QQ X", "unknown phones QQ X"), ("", "no phone"), (3, "lexicon.FOO is 3"),
                                          (None, "lexicon.FOO is None")])
def test_a_lexicon_of_ones_own_is_checked_before_hours_of_work(
    raw: Path, tmp_path: Path, phones: Any, said: str
) -> None:
    with pytest.raises(DnnvssError, match=said):
        prepare_folder(raw, tmp_path / "out", jobs=1, lexicon={"FOO": phones})
    assert own_lexicon({"FOO": "f uw1", "bar": "B AA1 R"}) == {"foo": "F UW1", "bar": "B AA1 R"}
