"""OpenFace's CSV is read by the names of its columns, in the plane and in space; damaged lines are named."""

from pathlib import Path

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.formats import Landmarks, check_times, common_rate, read_landmarks, read_npz, stamped, write_npz
from dnnvss.formats.openface import read_openface, write_openface
from dnnvss.timing import FrameClock


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "clip.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_columns_are_found_by_name_in_any_order(tmp_path: Path) -> None:
    path = written(tmp_path, "\ufeff AU01_r ,y_1, x_1,success ,Z_0,y_0,x_0,frame, X_0, Y_0,X_1,Y_1,Z_1, timestamp\n"
                             "high,4,3,1,700,2,1,1,10,20,30,40,710,0.000\n\n"
                             "low,8,7,1,701,6,5,2,11,21,31,41,711,0.033,\n")
    flat, deep = read_openface(path), read_openface(path, 3)
    assert flat.points.tolist() == [[[1, 2], [3, 4]], [[5, 6], [7, 8]]]
    assert deep.points.tolist() == [[[10, 20, 700], [30, 40, 710]], [[11, 21, 701], [31, 41, 711]]]
    assert flat.valid.all() and deep.valid.all()
    assert flat.times is not None and flat.times.tolist() == [0.0, 0.033]


@pytest.mark.parametrize("word", ["nan", "-nan(ind)", "NaN", "1.#QNAN", "-1.#IND", "inf", ""])
def test_a_value_that_is_no_number_makes_its_frame_invalid(tmp_path: Path, word: str) -> None:
    path = written(tmp_path, f"frame,success,x_0,y_0\n1,1,2,3\n2,1,{word},3\n3,0,{word},{word}\n")
    assert read_openface(path).valid.tolist() == [True, False, False]


def test_frames_may_be_missing_and_counted_from_zero(tmp_path: Path) -> None:
    found = read_openface(written(tmp_path, "frame,success,x_0,y_0\n3,1,3,3\n0,1,0,0\n1,1,1,1\n"))
    assert found.valid.tolist() == [True, True, False, True]
    assert found.points[[0, 1, 3], 0, 0].tolist() == [0, 1, 3]


@pytest.mark.parametrize(("rows", "said"), [
    ("1,1,2,3\n1,1,4,5\n", "line 3: frame 1 comes a second time"),
    ("1,1,2,3\n\n2,1,2\n", "line 4: 3 columns of 4"),
    ("1,1,2,3\n2,1,2,3,4\n", "line 3: 5 columns of 4"),
    ("1,1,2,3\n2,1,two,3\n", "line 3: x_0 is 'two', which is not a number"),
    ("1,1,2,3\n2.5,1,2,3\n", "line 3: frame is 2.5, which is not the number of a frame"),
    ("1,1,2,3\n-4,1,2,3\n", "line 3: frame is -4"),
    ("1,1,2,3\nnan,1,2,3\n", "line 3: frame is 'nan'"),
    ("1,1,2,3\n900000000,1,2,3\n", "line 3: frame is 9e\\+08"),
])
def test_wrong_lines_are_named(tmp_path: Path, rows: str, said: str) -> None:
    path = written(tmp_path, "frame,success,x_0,y_0\n" + rows)
    with pytest.raises(DnnvssError, match=said) as caught:
        read_openface(path)
    assert str(path) in str(caught.value) and caught.value.remedy


@pytest.mark.parametrize(("head", "said"), [
    ("frame,success,x_0,y_0,x_2,y_2", "has no columns x_1, y_1"),
    ("frame,success,x_0,y_0,x_0", "has no columns x_1, y_1"),
    ("frame,success,success,x_0,y_0", "has two columns success"),
    ("success,x_0,y_0", "has no columns frame"),
])
def test_wrong_columns_are_named(tmp_path: Path, head: str, said: str) -> None:
    row = ",".join("1" for _ in head.split(","))
    with pytest.raises(DnnvssError, match=said):
        read_openface(written(tmp_path, f"{head}\n{row}\n"))


def test_points_in_space_are_asked_for(tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match="has no columns X_0, Y_0, Z_0"):
        read_openface(written(tmp_path, "frame,success,x_0,y_0\n1,1,2,3\n"), 3)
    (tmp_path / "a.pts").write_text("version: 1\nn_points: 1\n{\n1 2\n}\n")
    with pytest.raises(DnnvssError, match="no third coordinate"):
        read_landmarks(tmp_path / "a.pts", 3)


@pytest.mark.parametrize("kind", [".csv", ".npz"])
def test_points_in_space_round_trip(tmp_path: Path, kind: str) -> None:
    points = np.random.default_rng(0).normal(0, 50, (4, 5, 3)).round(4).astype(np.float32)
    clip = Landmarks(points, np.array([True, True, False, True]), np.array([0, 0.04, 0.08, 0.12]))
    write = {".csv": write_openface, ".npz": write_npz}[kind]
    found = read_landmarks(write(tmp_path / f"clip{kind}", clip), 3)
    np.testing.assert_array_equal(found.points, points)
    np.testing.assert_array_equal(found.valid, clip.valid)
    assert found.times is not None and found.times.tolist() == [0, 0.04, 0.08, 0.12]


def test_an_npz_of_the_other_dimensions_says_so(tmp_path: Path) -> None:
    np.savez(tmp_path / "deep.npz", points=np.zeros((3, 5, 3)))
    with pytest.raises(DnnvssError, match=r"points have 3 coordinates, and 2 are looked for.*points\[\.\.\., :2\]"):
        read_npz(tmp_path / "deep.npz")
    np.savez(tmp_path / "words.npz", points=np.full((3, 5, 2), "x"))
    with pytest.raises(DnnvssError, match=r"its points are <U1, not numbers"):
        read_npz(tmp_path / "words.npz")


@pytest.mark.parametrize("rate", ["23.976", "24", "25", "29.97", "30", "50", "59.94", "60", "120"])
def test_rounded_time_stamps_tell_the_rate_of_the_camera(rate: str) -> None:
    clock = FrameClock(rate)
    spans = [(n, round(round(n / float(clock.rate), 3) + e, 3)) for n, e in ((70, 0), (91, 0.001), (120, -0.001))]
    assert common_rate(spans) == clock


def test_rates_that_no_camera_has_stay_and_none_is_none() -> None:
    assert common_rate([(2000, 2000 / 21.5)]) == FrameClock("21.5")
    assert common_rate([]) is None


def test_time_stamps_that_are_not_of_one_rate_are_refused(tmp_path: Path) -> None:
    points = np.zeros((4, 1, 2), np.float32)
    clip = Landmarks(points, np.ones(4, bool), np.array([0, 0.04, np.nan, 0.12]))
    assert stamped(clip, tmp_path) == (3, 0.12)
    check_times(clip, FrameClock(25), tmp_path)
    late = Landmarks(points, np.ones(4, bool), np.array([0, 0.04, 0.08, 0.20]))
    with pytest.raises(DnnvssError, match=r"frame 3 comes 2\.0 frames late at 25 a second"):
        check_times(late, FrameClock(25), tmp_path)
    with pytest.raises(DnnvssError, match="do not rise"):
        stamped(Landmarks(points, np.ones(4, bool), np.zeros(4)), tmp_path)


def test_a_last_row_that_breaks_off_is_not_valid(tmp_path: Path) -> None:
    """A tracker that is stopped while it writes leaves half a row."""
    head = "frame,success,x_0,y_0\n"
    found = read_openface(written(tmp_path, f"{head}1,1,2,3\n2,1,3,4\n3,1,4"))
    assert found.points[:, 0].tolist() == [[2, 3], [3, 4]] and found.valid.all()
    with pytest.raises(DnnvssError, match="line 3: 3 columns of 4"):
        read_openface(written(tmp_path, f"{head}1,1,2,3\n2,1,3\n3,1,4,5\n"))


def test_success_may_be_true_or_false(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("frame,success,x_0,y_0\n1,True,1,2\n2,False,3,4\n")
    assert read_openface(path).valid.tolist() == [True, False]
