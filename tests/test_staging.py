"""Temporary files are told from leftovers by their locks; sets are moved at once; names stay in their folder."""

import os
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from dnnvss import files, staging
from dnnvss.errors import DnnvssError


def test_a_leftover_is_swept_and_what_is_being_written_is_not(tmp_path: Path) -> None:
    (tmp_path / ".a.abcdefgh.part.mp4").write_text("left by a killed command")
    (tmp_path / ".a.part.mp4").write_text("somebody's own")
    with files.replacing(tmp_path / "b.txt") as temporary:
        assert staging.sweep(tmp_path) == [] and temporary.is_file()
        assert {p.name for p in tmp_path.iterdir()} == {".a.part.mp4", temporary.name}
        temporary.write_text("b")
    assert {p.name for p in tmp_path.iterdir()} == {".a.part.mp4", "b.txt"}


def test_a_set_comes_at_once_or_not_at_all(tmp_path: Path) -> None:
    for name in ("a.mp4", "a.npz", "a.json"):
        files.write_text(tmp_path / name, "old")
    with pytest.raises(ValueError, match="stop"), files.together(tmp_path / "a.json"):
        files.write_text(tmp_path / "a.mp4", "new")
        raise ValueError("stop")
    assert {p.read_text() for p in tmp_path.iterdir()} == {"old"}
    with files.together(tmp_path / "a.json") as group:
        for name in ("a.json", "a.mp4"):
            files.write_text(tmp_path / name, "new")
        group.leave_out(tmp_path / "a.npz")
        assert (tmp_path / "a.mp4").read_text() == "old"
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"a.mp4": "new", "a.json": "new"}


def test_a_set_whose_name_is_a_folder_leaves_the_older_files(tmp_path: Path) -> None:
    files.write_text(tmp_path / "a.mp4", "old")
    (tmp_path / "a.png").mkdir()
    with pytest.raises(DnnvssError, match=r"a\.png: cannot be written"), files.together(tmp_path / "a.json"):
        for name in ("a.mp4", "a.png", "a.json"):
            files.write_text(tmp_path / name, "new")
    assert {p.name for p in tmp_path.iterdir()} == {"a.mp4", "a.png"} and (tmp_path / "a.mp4").read_text() == "old"


def test_a_lock_whose_process_is_gone_locks_nothing(tmp_path: Path) -> None:
    (tmp_path / ".a.json.lock").write_text("")
    with staging.locked(tmp_path / "a.json"):
        assert (tmp_path / ".a.json.lock").is_file() and not staging.abandoned(tmp_path / ".a.json.lock")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["", "..", "../a", "a/../../b", "/etc/passwd", "C:/a", "a\\b", "a\0", "nul", "COM1.a"])
def test_names_that_lead_out_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(DnnvssError, match="leads out of the folder"):
        files.inside(tmp_path, name)


def test_links_may_point_inside_and_not_out(tmp_path: Path) -> None:
    (tmp_path / "folder" / "deep").mkdir(parents=True)
    (tmp_path / "folder" / "a").write_text("a")
    (tmp_path / "folder" / "deep" / "in").symlink_to("../a")
    (tmp_path / "folder" / "out").symlink_to(tmp_path)
    assert files.inside(tmp_path / "folder", "deep/in").read_text() == "a"
    with pytest.raises(DnnvssError, match="is a link"):
        files.inside(tmp_path / "folder", "out/b")


def test_scratch_goes_and_what_killed_processes_left_goes_first(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(staging, "_NEW", 0.0)
    ours = "dnnvss.scratch-"
    killed = """import os, sys, tempfile
tempfile.tempdir = sys.argv[1]
from dnnvss import staging
with staging.scratch() as folder:
    (folder / "said.wav").write_bytes(b"words")
    os.kill(os.getpid(), 9)
"""
    done = subprocess.run([sys.executable, "-c", killed, str(tmp_path)], check=False)
    assert done.returncode == -9 and [p.name.startswith(ours) for p in tmp_path.iterdir()] == [True]
    (tmp_path / "somebody's").mkdir()
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere/kept").write_text("kept")
    (tmp_path / f"{ours}link").symlink_to(tmp_path / "elsewhere")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with staging.scratch() as folder:
        others = {"elsewhere", "somebody's", f"{ours}link"}
        assert {p.name for p in tmp_path.iterdir()} == {*others, folder.name}
        staging._sweep_scratch(tmp_path)  # as another process does
        assert folder.is_dir()
    assert {p.name for p in tmp_path.iterdir()} == others
    assert (tmp_path / "elsewhere/kept").is_file()


@pytest.mark.parametrize(("mask", "mode"), [(0o022, 0o644), (0o077, 0o600), (0o002, 0o664)])
def test_a_file_is_for_those_whom_the_mask_of_the_process_lets_in(tmp_path: Path, mask: int, mode: int) -> None:
    before = os.umask(mask)
    try:
        with staging.locked(tmp_path / "a.json"):
            lock, = tmp_path.iterdir()
            assert stat.S_IMODE(lock.stat().st_mode) == mode
        written = files.write_json(tmp_path / "a.json", {})
    finally:
        os.umask(before)
    assert stat.S_IMODE(written.stat().st_mode) == mode
