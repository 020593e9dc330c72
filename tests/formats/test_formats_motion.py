"""Curves and markers are read as tools write them; damaged files are an error of ours."""

from fractions import Fraction
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
from dnnvss.timing.rates import even_frames


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


@pytest.mark.parametrize("text, times", [
    ("time_ms,jaw\n0,0.5\n40,0.25\n", [0, 0.04]), ("Time (s);jaw\n0;0,5\n0,04;0,25\n", [0, 0.04]),
    ("\ufeff,jaw,time [ms],\n0,0.5,0,\n1,0.25,40,\n", [0, 0.04]), ("jaw,Frame\n.5,7\n.25,8\n", None),
    ("sep=;\nframe number;jaw\n1;0,5\n2;0,25\n", None)])
def test_columns_of_time_in_any_unit_and_of_row_numbers_are_no_curves(
    tmp_path: Path, text: str, times: list[float] | None
) -> None:
    found = read_curves(written(tmp_path, text))
    assert found.names == ("jaw",) and found.values[:, 0].tolist() == [0.5, 0.25]
    assert found.times is None if times is None else found.times == pytest.approx(times)


def test_frames_without_a_row_are_missing_and_disorder_is_refused(tmp_path: Path) -> None:
    found = read_curves(written(tmp_path, "frame,jaw\n3,1\n6,2\n")).values[:, 0]
    assert found[[0, 3]].tolist() == [1, 2] and np.isnan(found[1:3]).all()
    marks = read_markers(written(tmp_path, "time,a_x,a_y,a_z\n0,1,2,3\n.01,1,2,3\n.02,1,2,3\n.05,4,5,6\n"))
    assert marks.rate == pytest.approx(100) and np.isnan(marks.points[3:5]).all() and len(marks.points) == 6
    with pytest.raises(DnnvssError, match="line 3: frame 1 does not come after 2"):
        read_curves(written(tmp_path, "frame,jaw\n2,1\n1,2\n"))
    with pytest.raises(DnnvssError, match="2 rows for the frames 1 to 90"):
        read_curves(written(tmp_path, "frame,jaw\n1,1\n90,2\n"))


TRC = (
    "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n100\t100\t{frames}\t{count}\tmm\n"
    "Frame#\tTime\ta\t\t\tb\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n{first}\t0.00\t1\t2\t3\t0\t0\t0\n4\t0.01\t1\t2\t3\t4\t5\t6\n"
)


def test_a_trc_that_is_cut_short_or_skips_frames_is_seen(tmp_path: Path) -> None:
    found = read_trc(written(tmp_path, TRC.format(frames=2, count=2, first=2), "a.trc"))
    assert len(found.points) == 3 and np.isnan(found.points[1]).all()
    assert np.isnan(found.points[0, 1]).all() and found.points[2, 1].tolist() == [4, 5, 6]
    for told, said in (({"frames": 9}, "2 frames, and its head tells of 9"), ({"count": 3}, "2 markers"),
                       ({"first": 4}, "frame 4 does not come after 4")):
        text = TRC.format(**{"frames": 2, "count": 2, "first": 2} | told)
        with pytest.raises(DnnvssError, match=said):
            read_trc(written(tmp_path, text, "a.trc"))


VICON = (
    "Trajectories\n100\n,,me:LLIP,,,me:ULIP,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm\n"
    "1,0,1,2,3,4,5,6\n2,0,1,2,3,,,\n"
)
MOTIVE = (
    "Format Version,1.23,Take Name,x,Capture Frame Rate,100.000000,Length Units,Meters\n\n"
    ",Type,Rigid Body,Marker,Marker,Marker,Marker,Marker,Marker\n,Name,head,LLIP,LLIP,LLIP,me:ULIP,me:ULIP,me:ULIP\n"
    ",ID,1,2,2,2,3,3,3\n,,Rotation,Position,Position,Position,Position,Position,Position\n"
    "Frame,Time (Seconds),X,X,Y,Z,X,Y,Z\n0,0.00,9,.001,.002,.003,.004,.005,.006\n1,0.01,9,.001,.002,.003,,,\n"
)


@pytest.mark.parametrize("text", [VICON, MOTIVE, VICON.replace(",", ";"), "\ufeff" + MOTIVE.replace("\n", "\r\n")])
def test_tables_of_capture_systems_are_markers(tmp_path: Path, text: str) -> None:
    found = read_markers(written(tmp_path, text))
    assert found.names == ("LLIP", "ULIP") and found.rate == 100
    np.testing.assert_allclose(found.points[0], [[1, 2, 3], [4, 5, 6]])
    assert np.isnan(found.points[1, 1]).all() and found.points[1, 0] == pytest.approx([1, 2, 3])


@pytest.mark.parametrize("text", [VICON[:40], VICON.replace("mm", "parsec"), MOTIVE.replace("Marker", "Bone"),
                                  VICON.replace("1,0,1,2", "1,0,x,2")])
def test_damaged_tables_of_capture_systems_are_refused(tmp_path: Path, text: str) -> None:
    path = written(tmp_path, text)
    with pytest.raises(DnnvssError) as found:
        read_markers(path)
    assert found.value.file == path


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


@pytest.mark.parametrize("rate, longer", [("30000/1001", 1.001), ("30", 1), ("24000/1001", 1), ("25/2", 1)])
def test_a_second_of_time_code_at_29_97_frames_is_longer_than_one_of_the_clock(tmp_path, rate, longer):
    """30 frames are counted to it, so that at the rate that is told frames are as far apart as they were."""
    codes = "\n".join(f"01:00:{k // 30:02d}:{k % 30:02d}.000,{k}" for k in range(1500))
    curves = read_curves(written(tmp_path, f"Timecode,JawOpen\n{codes}\n"))
    assert curves.counted == 30
    np.testing.assert_allclose(curves.since(Fraction(rate)), longer * np.arange(1500) / 30, atol=1e-9)
    kept = even_frames(curves.since(Fraction(rate)), Fraction(rate))[0]
    assert len(kept) == round(1500 / 30 * longer * Fraction(rate))
