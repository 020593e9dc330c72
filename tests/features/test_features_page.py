"""The printed tables, and the page that is made of them."""

from pathlib import Path

import pytest
from conftest import run_command

ROOT = Path(__file__).parents[2]


def test_the_page_on_features_is_current(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("features", "--conf", str(ROOT / "conf" / "labels")) == 0
    written = (ROOT / "docs" / "features.md").read_text("utf-8")
    assert capsys.readouterr().out == written, "run: python -m dnnvss features > docs/features.md"


def test_one_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("features", str(ROOT / "conf" / "labels" / "ph_b.yaml"), "--rate", "50") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "## ph_b"
    assert lines[2].startswith("332 columns: 327 binary, of which at most 26 are 1 in a frame, and 5 numeric. Hash `")
    assert lines[3] == "Window: 16 frames (320 ms) before and 16 frames (320 ms) after, at 50 frames a second."
    row = "| 1 | `centre_phone` | frame | binary | 41 | 0:41 | Thangthai 2016, Table 1, frame: centre phoneme |"
    assert lines[7] == row
    assert len(lines) == 7 + 16


def test_labels_are_found_by_their_name_from_any_folder(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    assert run_command("features", "ph_b") == 0
    assert capsys.readouterr().out.startswith("## ph_b\n\n332 columns")


def test_errors_are_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("features", str(tmp_path / "none.yaml")) == 1
    assert "no such file" in capsys.readouterr().err
    (tmp_path / "bad.yaml").write_text("blocks: [: ]")
    assert run_command("features", str(tmp_path / "bad.yaml")) == 1
    assert "bad.yaml: cannot be read" in capsys.readouterr().err
    assert run_command("features", "--conf", str(tmp_path / "empty")) == 1
    assert "holds no configuration" in capsys.readouterr().err
