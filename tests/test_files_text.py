"""Text is read in the encodings that programs write, and in no other."""

import codecs
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dnnvss import files
from dnnvss.corpus.store import split_files
from dnnvss.errors import DnnvssError
from dnnvss.formats import (
    read_alignment,
    read_grid_align,
    read_marks,
    read_openface,
    read_pts,
    write_openface,
    write_pts,
)
from dnnvss.formats.openface import Landmarks
from dnnvss.style.keys import read_keys
from dnnvss.text.overrides import read_overrides

TEXT = "Zoë says: don\u2019t\nstop\n"
ENCODED = {
    "utf-8": lambda t: t.encode(), "mark": lambda t: codecs.BOM_UTF8 + t.encode(),
    "utf-16": lambda t: t.encode("utf-16"), "big": lambda t: codecs.BOM_UTF16_BE + t.encode("utf-16-be"),
    "windows old": lambda t: t.encode("cp1252"), "wide": lambda t: t.encode("utf-32"),
    "bare": lambda t: t.encode("utf-16-le"), "windows": lambda t: t.replace("\n", "\r\n").encode(),
}
Encode = Callable[[str], bytes]


@pytest.fixture(params=list(ENCODED))
def encode(request: pytest.FixtureRequest) -> Encode:
    return ENCODED[request.param]


def test_text_is_the_same_in_every_encoding(encode: Encode, tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_bytes(encode(TEXT))
    assert files.read_text(tmp_path / "a.txt", "") == TEXT


@pytest.mark.parametrize("data, said", [(b"one\ndon\x81t", r"line 2: byte 7 \(0x81\) is no utf-8"),
                                        (codecs.BOM_UTF16_LE + b"a\0b", "is no utf-16"),
                                        (b"\xff\xfea", "is no utf-16")])
def test_another_encoding_is_said_with_its_line(data: bytes, said: str, tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_bytes(data)
    with pytest.raises(DnnvssError, match=rf"a\.txt: .*{said}.*Save it as UTF-8"):
        files.read_text(tmp_path / "a.txt", "")


def test_an_empty_file_holds_nothing(tmp_path: Path) -> None:
    (tmp_path / "a.txt").touch()
    assert files.read_text(tmp_path / "a.txt", "") == ""
    with pytest.raises(DnnvssError, match=r"no such file\. Write it"):
        files.read_text(tmp_path / "b.txt", "Write it")
    with pytest.raises(DnnvssError, match=r"a\.txt: is empty"):
        files.read(tmp_path / "a.txt", lambda path: path.read_bytes()[0], "")


def described(found: Any) -> Any:
    return json.dumps(found, default=lambda o: o.tolist() if isinstance(o, np.ndarray) else repr(o))


def files_of_others(folder: Path) -> dict[str, tuple[Path, Callable[[Path], Any]]]:
    """Text files that users bring, and who reads them."""
    points = np.arange(136, dtype=np.float32).reshape(1, 68, 2)
    write_pts(folder / "a.pts", points[0])
    write_openface(folder / "a.csv", Landmarks(points, np.ones(1, bool)))
    texts = {"a.lab": "0 5000000 sil\n5000000 9000000 AA\n", "a.align": "0 10000 sil\n10000 20000 bin\n",
             "train.txt": "first\nsecond\n", "own.dict": "ZOE Z OW IY\n",
             "landmarks.json": '{"groups": {"lips": [0, 4]}, "scale": 2}',
             "keys.csv": "name,phone,occurrence,position,low,high\n"}
    for name, text in texts.items():
        files.write_text(folder / name, text)
    readers: dict[str, Callable[[Path], Any]] = {
        "a.pts": read_pts, "a.csv": lambda p: read_openface(p).points, "a.lab": lambda p: read_alignment(p).to_json(),
        "a.align": lambda p: [tuple(s) for s in read_grid_align(p)], "train.txt": lambda p: split_files(p.parent),
        "own.dict": read_overrides, "landmarks.json": read_marks, "keys.csv": read_keys}
    return {name: (folder / name, reader) for name, reader in readers.items()}


def test_every_text_file_of_other_programs_is_read_in_every_encoding(encode: Encode, tmp_path: Path) -> None:
    for name, (path, reader) in files_of_others(tmp_path).items():
        before = described(reader(path))
        path.write_bytes(encode(path.read_text("utf-8")))
        assert described(reader(path)) == before, name


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    for wrong in (tmp_path / "taken", tmp_path / "taken" / "below", Path("/proc/dnnvss")):
        with pytest.raises(DnnvssError, match=r"cannot be made \(.*\)\. Choose another place") as caught:
            files.make_folder(wrong)
        assert caught.value.file == wrong
    assert (tmp_path / "taken").read_text() == "a file"
    assert files.make_folder(tmp_path / "a" / "b").is_dir() and files.make_folder(tmp_path / "a").is_dir()


def test_a_file_that_goes_while_it_is_read_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("here")

    def gone(path: Path) -> bytes:
        path.unlink()
        return path.read_bytes()

    with pytest.raises(DnnvssError, match=r"a\.txt.* was removed by another command .* Again"):
        files.read(path, gone, "Again")


def test_quotes_tell_what_an_old_mac_wrote(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    for written in ("It\u2019s a \u201ctest\u201d at the caf\u00e9", "(\u201cYes\u201d)", "don\u2019t"):
        for encoding in ("mac_roman", "cp1252"):
            path.write_bytes(written.encode(encoding))
            assert files.text_encoding(path.read_bytes()) == encoding and files.read_text(path, "") == written
    path.write_bytes("\u00d3rla and \u00d2scar at \u00c9cole".encode("cp1252"))
    assert files.text_encoding(path.read_bytes()) == "cp1252"
