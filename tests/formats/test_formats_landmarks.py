"""Landmark files survive a round trip, and damaged ones are named."""

from pathlib import Path

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.formats import (
    LAYOUT_68,
    Landmarks,
    Marks,
    read_landmarks,
    read_marks,
    read_npz,
    read_pts,
    write_npz,
    write_openface,
    write_pts,
)


@pytest.fixture
def clip():
    points = np.random.default_rng(0).uniform(0, 300, (4, 68, 2)).round(4).astype(np.float32)
    return Landmarks(points, np.array([True, True, False, True]))


def test_pts_round_trip(tmp_path, clip):
    path = write_pts(tmp_path / "a_000001.pts", clip.points[0])
    assert path.read_text().startswith("version: 1\nn_points: 68\n{\n")
    np.testing.assert_array_equal(read_pts(path), clip.points[0])


def test_a_folder_of_pts_is_ordered_by_number_and_a_missing_frame_is_not_valid(tmp_path, clip):
    for frame in (9, 10, 12):
        write_pts(tmp_path / "clip" / f"a_{frame}.pts", clip.points[frame - 9])
    found = read_landmarks(tmp_path / "clip")
    assert found.valid.tolist() == [True, True, False, True]
    np.testing.assert_array_equal(found.points[[0, 1, 3]], clip.points[[0, 1, 3]])
    assert np.isnan(found.points[2]).all()


@pytest.mark.parametrize("kind", [".csv", ".npz"])
def test_whole_clips_round_trip(tmp_path, clip, kind):
    write = {".csv": write_openface, ".npz": write_npz}[kind]
    found = read_landmarks(write(tmp_path / f"clip{kind}", clip))
    np.testing.assert_array_equal(found.points, clip.points)
    np.testing.assert_array_equal(found.valid, clip.valid)


def test_npz_of_scaled_integers(tmp_path):
    np.savez(tmp_path / "a.npz", points=np.full((3, 5, 2), 48, np.int16))
    found = read_npz(tmp_path / "a.npz", scale=32)
    assert found.points.dtype == np.float32
    assert (found.points == 1.5).all()
    assert found.valid.all()


def test_openface_follows_the_surer_face_and_marks_lost_frames(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("frame, face_id, timestamp, confidence, success, x_0, y_0\n"
                    "1, 0, 0.00, 0.3, 1, 99, 99\n1, 1, 0.00, 0.9, 1, 1, 2\n3, 1, 0.08, 0.1, 0, 5, 6\n")
    found = read_landmarks(path)
    assert found.points[[0, 2]].tolist() == [[[1, 2]], [[5, 6]]]
    assert found.valid.tolist() == [True, False, False]


def test_layout_of_68_points_covers_every_row_once():
    rows = [i for start, end in LAYOUT_68.values() for i in range(start, end)]
    assert sorted(rows) == list(range(68))


@pytest.mark.parametrize(("name", "text", "said"), [
    ("a.pts", "version: 1\nn_points: 2\n{\n1 2\n}\n", "holds 1 points, its header says 2"),
    ("a.pts", "version: 1\nn_points: 1\n{\n1 two\n}\n", "line 4: '1 two' is not X Y"),
    ("a.csv", "frame,success,x_0\n1,1,2\n", "has no columns y_0"),
    ("a.csv", "frame,success\n1,1\n", "has no columns x_0"),
    ("a.csv", "frame,success,x_0,y_0\n1,1,2,3\n2,1,2\n", "line 3: 3 columns of 4"),
    ("a.csv", "frame,success,x_0,y_0\n", "holds no frame"),
    ("a.npz", "not a zip", "cannot be read"),
    ("a.json", "{}", "not understood"),
])
def test_damaged_files_are_named(tmp_path, name, text, said):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(DnnvssError, match=said) as caught:
        read_landmarks(path)
    assert str(path) in str(caught.value)
    assert caught.value.remedy


def test_pts_of_different_markups(tmp_path, clip):
    write_pts(tmp_path / "a_1.pts", clip.points[0])
    write_pts(tmp_path / "a_2.pts", clip.points[1, :49])
    with pytest.raises(DnnvssError, match=r"a_2\.pts: holds 49 points, a_1\.pts holds 68"):
        read_landmarks(tmp_path)


def test_npz_of_another_shape(tmp_path):
    np.savez(tmp_path / "a.npz", points=np.zeros((3, 5)))
    with pytest.raises(DnnvssError, match=r"not points \(frames, points, 2\)"):
        read_landmarks(tmp_path / "a.npz")


def test_notes_beside_what_is_known_are_left_alone_and_slips_are_told(tmp_path):
    path = tmp_path / "landmarks.json"
    path.write_text('{"scale": 32, "unit": "pixel, x right", "groups": {"lips_outer": [36, 56]}}')
    assert read_marks(path) == Marks({"lips_outer": (36, 56)}, 32.0)
    path.write_text('{"scales": 32}')
    with pytest.raises(DnnvssError, match="scales is no setting"):
        read_marks(path)


def test_a_picture_on_the_wall_is_no_talker_and_is_told(tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{i}, {face}, {i / 25}, {sure}, 1, 0, {size}, 0, {size}"
            for i in range(1, 5) for face, sure, size in ((0, .98, 40), (1, .88, 150))]
    path.write_text("\n".join(["frame, face_id, timestamp, confidence, success, x_0, x_1, y_0, y_1", *rows]))
    found = read_landmarks(path)
    assert (found.points[:, 1] == 150).all() and found.faces == 2
    alone = tmp_path / "b.csv"
    alone.write_text("\n".join(line for line in path.read_text().splitlines() if ", 0, 0." not in line))
    assert read_landmarks(alone).faces == 1
    path.write_text(path.read_text().replace("2, 1, ", "2, nan, "))
    assert read_landmarks(path).valid.tolist() == [True, False, True, True]  # of no face that is known


def test_the_brackets_of_points_may_stand_in_other_lines(tmp_path: Path) -> None:
    path = tmp_path / "a.pts"
    for text in ("version: 1\nn_points: 2 {\n1 2\n3 4\n}\n", "version: 1\nn_points: 2\n{ 1 2\n3 4 }\n"):
        path.write_text(text)
        assert read_pts(path).tolist() == [[1, 2], [3, 4]]


@pytest.mark.parametrize("name", ["a.xml", "a.json", "a.csv"])
def test_landmarks_of_other_tools_are_told_the_way_in(tmp_path: Path, name: str) -> None:
    """dlib and CVAT write XML, MediaPipe's users JSON, DeepLabCut a table of three lines of names."""
    path = tmp_path / name
    path.write_text("scorer,DLC,DLC\nbodyparts,lip,lip\ncoords,x,y\n0,1.0,2.0\n")
    with pytest.raises(DnnvssError, match=r"points.*\(frames, points, 2\)"):
        read_landmarks(path)
