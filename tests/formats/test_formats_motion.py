"""Curves and markers are read as tools write them; damaged files are an error of ours."""

from pathlib import Path

import numpy as np
import pytest

from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.formats import (
    Curves,
    Markers,
    marker_columns,
    read_curves,
    read_markers,
    read_trc,
    write_curves,
    write_trc,
)
from dnnvss.formats import c3d as c3d_reader


def written(tmp_path: Path, text: str, name: str = "take.csv") -> Path:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def test_live_link_face_is_known_by_its_time_code(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        "Timecode,BlendShapeCount,JawOpen,MouthClose\n23:59:59:58.000,2,0.1,0.25\n"
        "00:00:00:00.500,2,0.2,0.5\n",
    )
    found = read_curves(path)
    assert found.names == ("JawOpen", "MouthClose") and found.values.tolist() == [
        [0.1, 0.25],
        [0.2, 0.5],
    ]
    assert found.times is not None and np.diff(found.times)[0] == pytest.approx(
        2.5 / 60
    )  # past midnight, in 60ths


def test_any_table_of_named_columns_is_curves(tmp_path: Path) -> None:
    found = read_curves(written(tmp_path, "frame;time;jaw;lip corner\n1;0,00;0,5;1\n2;0,04;;0\n"))
    assert (
        found.names == ("jaw", "lip corner")
        and found.times is not None
        and found.times.tolist() == [0.0, 0.04]
    )
    assert found.values[0].tolist() == [0.5, 1.0] and np.isnan(found.values[1, 0])


def test_curves_come_back_as_they_were_written(tmp_path: Path) -> None:
    curves = Curves(("a", "b"), np.random.default_rng(0).random((5, 2)), np.arange(5) / 60)
    back = read_curves(write_curves(tmp_path / "take.csv", curves))
    assert back.names == curves.names and back.values == pytest.approx(curves.values, abs=1e-9)
    assert back.times == pytest.approx(curves.times, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("jaw,jaw\n1,2\n", "two columns 'jaw'"),
        ("jaw,lip\n1\n", "line 2: 1 columns of 2"),
        ("jaw\nopen\n", "line 2: jaw is 'open'"),
        ("time,jaw\n0.1,1\n0.1,1\n", "line 3: the time '0.1' does not come after"),
        ("Timecode,jaw\n1:2:3,1\n", "'1:2:3' is no time code"),
        ("Timecode,jaw\n1:02:03:900,1\n", "frame 900 in its time code"),
        ("time\n1\n", "no column of values"),
        ("jaw\n", "holds no frame"),
    ],
)
def test_wrong_curves_are_told(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(DnnvssError, match=said) as caught:
        read_curves(written(tmp_path, text))
    assert caught.value.remedy


def markers() -> Markers:
    points = np.random.default_rng(1).normal(scale=100, size=(6, 4, 3))
    points[2, 1] = points[5, 3] = np.nan
    return Markers(("chin", "lip", "jig1", "jig2"), points, 120.0)


def test_trc_comes_back_with_its_gaps(tmp_path: Path) -> None:
    back = read_markers(write_trc(tmp_path / "take.trc", markers()))
    assert back.names == markers().names and back.rate == 120
    assert back.points == pytest.approx(markers().points, abs=1e-6, nan_ok=True)


def test_trc_in_metres_is_in_millimetres(tmp_path: Path) -> None:
    text = write_trc(tmp_path / "take.trc", markers()).read_text().replace("\tmm\t", "\tm\t")
    assert read_trc(written(tmp_path, text, "b.trc")).points[0, 0] == pytest.approx(
        1000 * markers().points[0, 0]
    )


def test_csv_of_markers_is_told_from_curves(tmp_path: Path) -> None:
    assert marker_columns(["chin_x", "chin_y", "chin_z"]) == {"chin": (0, 1, 2)}
    assert marker_columns(["L:Z", "L:X", "L:Y"]) == {"L": (1, 2, 0)}
    assert (
        marker_columns(["JawOpen", "chin_y", "chin_z"]) is None
        and marker_columns(["a_x", "a_y"]) is None
    )
    found = read_markers(written(tmp_path, "time,a_x,a_y,a_z\n0,1,2,3\n0.01,1,,3\n"))
    assert found.rate == pytest.approx(100) and found.points[0, 0].tolist() == [1, 2, 3]
    assert np.isnan(found.points[1]).all()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("hello\n" * 9, "does not begin as a TRC"),
        (
            "PathFileType\nDataRate\tUnits\n0\tmm\nFrame#\tTime\ta\n\tX1\n1\t0\t1\t2\t3\n",
            "rate '0'",
        ),
        (
            "PathFileType\nDataRate\tUnits\n9\tfurlong\nFrame#\tTime\ta\n\tX1\n1\t0\t1\t2\t3\n",
            "unit 'furlong'",
        ),
        (
            "PathFileType\nDataRate\tUnits\n9\tmm\nFrame#\tTime\ta\n\tX1\n1\t0\t1\t2\t3\t4\n",
            "line 6: 6 columns of 5",
        ),
    ],
)
def test_wrong_trc_is_told(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(DnnvssError, match=said):
        read_trc(written(tmp_path, text, "take.trc"))


def c3d(path: Path) -> Path:
    ezc3d = pytest.importorskip("ezc3d")
    own, file = markers(), ezc3d.c3d()
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(own.names)
    file["parameters"]["POINT"]["RATE"]["value"] = [own.rate]
    file["data"]["points"] = np.concatenate([own.points.transpose(2, 1, 0), np.ones((1, 4, 6))])
    file.write(str(path))
    return path


def test_c3d_comes_back_with_its_gaps(tmp_path: Path) -> None:
    back = read_markers(c3d(tmp_path / "take.c3d"))
    assert back.names == markers().names and back.rate == 120
    assert back.points == pytest.approx(markers().points, abs=1e-3, nan_ok=True)


def test_damaged_c3d_is_an_error_of_ours(tmp_path: Path) -> None:
    whole = c3d(tmp_path / "take.c3d").read_bytes()
    random = np.random.default_rng(0)
    for k in range(4):
        bytes_ = bytearray(whole)
        for at in random.integers(512, len(bytes_), 60):
            bytes_[at] = random.integers(256)
        path = tmp_path / f"damaged{k}.c3d"
        path.write_bytes(bytes(bytes_))
        try:
            read_markers(path)
        except DnnvssError as error:
            assert error.remedy
    for cut, said in ((len(whole) // 2, "declares|cannot"), (100, "no C3D")):
        (tmp_path / "cut.c3d").write_bytes(whole[:cut])
        with pytest.raises(DnnvssError, match=said):
            read_markers(tmp_path / "cut.c3d")


def test_other_kinds_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match="not understood"):
        read_markers(tmp_path / "take.bvh")


@pytest.mark.parametrize(
    ("work", "system"),
    [
        ("import os; os.kill(os.getpid(), 9)", True),
        ("raise OSError(24, 'Too many open files')", True),
        ("raise MemoryError", False),
        ("import os; os.kill(os.getpid(), 24)", False),
        ("import os; os.abort()", False),
    ],
)
def test_what_ends_the_reader_of_c3d_is_the_system_or_the_file(
    work: str, system: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    take = c3d(tmp_path / "take.c3d")
    monkeypatch.setattr(c3d_reader, "_WORKER", written(tmp_path, work, "worker.py"))
    with pytest.raises(DnnvssError) as told:
        read_markers(take)
    assert isinstance(told.value, ShortageError) == system
    assert str(take) in str(told.value)
    if work == "raise MemoryError":  # of what the system grants, or of the bound that follows from the file
        monkeypatch.setattr(c3d_reader, "_granted", lambda: 1e8)
        with pytest.raises(ShortageError):
            read_markers(take)
