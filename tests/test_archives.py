"""Arrays within bounds that are checked before anything is held, and by declaration."""

import io
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

from dnnvss import files
from dnnvss.archives import Held, read_arrays, read_declared
from dnnvss.errors import DnnvssError
from dnnvss.formats import read_landmarks, read_npz, read_pts_sequence, write_pts
from dnnvss.formats.numbers import number, whole


def test_arrays_have_whatever_name_an_utterance_has(tmp_path: Path) -> None:
    names = {name: np.full(2, float(k)) for k, name in enumerate(("path", "arrays", "a b", "file"))}
    held = read_arrays(files.write_arrays(tmp_path / "a.npz", **names))
    assert {name: a.tolist() for name, a in held.items()} == {name: a.tolist() for name, a in names.items()}


def test_an_archive_that_opens_to_gigabytes_is_refused_before_it_is_opened(tmp_path: Path) -> None:
    path = tmp_path / "bomb.npz"
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f4", "fortran_order": False, "shape": (125_000_000, 1, 2)})
    with (zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
          archive.open("points.npy", "w", force_zip64=True) as file):
        file.write(header.getvalue())
        for _ in range(1000):
            file.write(bytes(1_000_000))
    assert path.stat().st_size < 6e6
    tracemalloc.start()
    try:
        with pytest.raises(DnnvssError, match=r"opens to 1,000\.0 MB"):
            read_arrays(path)
        with pytest.raises(DnnvssError, match=r"opens to 1,000\.0 MB, and 2\.6 MB are the most"):
            read_npz(path, frames=100)
        assert tracemalloc.get_traced_memory()[1] < 5e6
    finally:
        tracemalloc.stop()


def test_a_header_that_promises_more_than_there_is_is_refused(tmp_path: Path) -> None:
    path = files.write_arrays(tmp_path / "a.npz", points=np.zeros((2, 3, 2)))
    with zipfile.ZipFile(path) as archive:
        member = archive.read("points.npy").replace(b"(2, 3, 2)", b"(2, 9, 2)")
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("points.npy", member)
    with pytest.raises(DnnvssError, match=r"no float64 of the shape \(2, 9, 2\)"):
        read_arrays(path)


@pytest.mark.parametrize(("arrays", "said"), [
    ({"x": np.zeros((4, 2))}, "lacks names"),
    ({"x": np.zeros((4, 3)), "names": np.array(["a"] * 4)}, r"x has the shape \(4, 3\), not \(N, 2\)|not \(4, 2\)"),
    ({"x": np.zeros((4, 2)), "names": np.array(["a"] * 5)}, r"names has the shape \(5,\), not \(4\)"),
    ({"x": np.full((4, 2), np.nan), "names": np.array(["a"] * 4)}, "x holds numbers that are not finite"),
    ({"x": np.zeros((4, 2), int), "names": np.array(["a"] * 4)}, "x holds int64, not numbers"),
])
def test_arrays_are_as_declared(tmp_path: Path, arrays: dict[str, np.ndarray], said: str) -> None:
    declared = {"x": Held(("N", 2)), "names": Held(("N",), "U")}
    right = files.write_arrays(tmp_path / "right.npz", x=np.ones((4, 2)), names=np.array(["a"] * 4), more=np.zeros(1))
    assert set(read_declared(right, declared, "Write it again")) == {"x", "names"}
    with pytest.raises(DnnvssError, match=rf"{said}.*Write it again"):
        read_declared(files.write_arrays(tmp_path / "a.npz", **arrays), declared, "Write it again")


@pytest.mark.parametrize("text", ["٣", "1_0", "0x10", "1e999", "9" * 400, "nan", "inf", "", "1e16", "--1"])
def test_what_is_no_number_of_a_file(text: str) -> None:
    with pytest.raises(ValueError):
        number(text)


def test_numbers_are_what_they_were() -> None:
    assert [number(t) for t in ("1", "-2.5", ".5", "1e-3", " 7. ", "+4E2")] == [1, -2.5, 0.5, 1e-3, 7, 400]
    assert whole("12") == 12
    with pytest.raises(ValueError):
        whole("1.5")


def test_far_frame_numbers_are_refused_before_room_is_made_for_them(tmp_path: Path) -> None:
    for frame in ("000001", "400000000"):
        write_pts(tmp_path / f"v_{frame}.pts", np.zeros((68, 2)))
    with pytest.raises(DnnvssError, match="is frame 400000000, and there are 2 files from frame 1"):
        read_pts_sequence(tmp_path.glob("*.pts"), tmp_path)
    csv = files.write_text(tmp_path / "a.csv", "frame,success,x_0,y_0\n1,1,2,3\n400000000,1,2,3\n")
    with pytest.raises(DnnvssError, match="line 3: frame is 4e\\+08"):
        read_landmarks(csv)


def test_an_array_written_in_parts_is_the_array(tmp_path: Path) -> None:
    whole = np.arange(60, dtype=np.float64).reshape(10, 3, 2)
    rows = files.Rows(whole.shape, np.float32, (whole[k : k + 4] for k in range(0, 10, 4)))
    held = read_arrays(files.write_arrays(tmp_path / "a.npz", points=rows, rate=25.0))
    assert held["points"].dtype == np.float32 and held["rate"] == 25
    np.testing.assert_array_equal(held["points"], whole)
    np.savez(tmp_path / "b.npz", points=whole.astype(np.float32), rate=25.0)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
