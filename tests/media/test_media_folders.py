"""Videos in folders."""

from pathlib import Path

import pytest

from dnnvss.errors import DnnvssError
from dnnvss.media.folders import VIDEOS, find_videos


def test_videos_of_all_kinds_are_found_and_what_systems_hide_is_not(tmp_path: Path) -> None:
    there = [*(f"a{i}{s}" for i, s in enumerate(VIDEOS)), "deep/b.MP4", "._a0.mp4", ".hidden.mp4", "notes.txt",
             ".stages/clips/c.mp4", "deep/.trash/d.mp4"]
    for name in there:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    (tmp_path / "folder.mp4").mkdir()
    found = [p.relative_to(tmp_path).as_posix() for p in find_videos(tmp_path)]
    assert found == sorted([*(f"a{i}{s}" for i, s in enumerate(VIDEOS)), "deep/b.MP4"])
    assert find_videos(tmp_path / "a0.mp4") == [tmp_path / "a0.mp4"]


def test_none_and_nowhere_are_said(tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match="holds no video"):
        find_videos(tmp_path)
    with pytest.raises(DnnvssError, match="nowhere: no such folder or file"):
        find_videos(tmp_path / "nowhere")
