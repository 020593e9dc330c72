"""Small mistakes of a user's that once lost a file or ended in a traceback."""

import os
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import run_command

from dnnvss import files
from dnnvss.commands import speak as speaking
from dnnvss.commands.flags import Flags
from dnnvss.commands.speak import check_exports, check_text
from dnnvss.commands.speak_settings import SpeakSettings, SpeechSettings, check_files, numbered
from dnnvss.errors import DnnvssError
from dnnvss.export.timecode import TimeCode
from dnnvss.runs.naming import check_begun
from dnnvss.settings import at_home
from dnnvss.style.generator import StyleSettings
from dnnvss.synthesis.request import Recording, Scene, SpeakRequest
from dnnvss.timing import FrameClock

IMPORTERS = {
    "takes nothing": ("def make(): pass", "does not take what it is given (got an unexpected keyword argument 'out')"),
    "wants more": ("def make(out, secret): pass", "does not take what it is given (missing a required argument"),
    "raises": ("def make(out):\n    return {}['a']", "failed in {file}, line 2 (KeyError: 'a')"),
    "is none": ("make = 3", "is no function"),
    "cannot be run": ("raise RuntimeError('no')", "cannot be imported (RuntimeError: no)"),
    "cannot be read": ("def make(:", "cannot be imported (SyntaxError"),
    "has a mistake of the user's": (
        "from dnnvss.errors import DnnvssError\ndef make(out):\n    raise DnnvssError('no words', file='a.txt')",
        "error: a.txt: no words"),
}


@pytest.mark.parametrize("name", IMPORTERS)
def test_an_importer_of_the_users_own_that_is_wrong_is_named(
        name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    code, said = IMPORTERS[name]
    (tmp_path / "my_importer.py").write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "my_importer", raising=False)
    status = run_command("prepare", "corpus=folder", "corpus.raw=x", f"corpus.out={tmp_path}/out",
                         "corpus.importer={kind:my_importer.make}")
    told = capsys.readouterr().err.strip().splitlines()
    assert status == 1 and told[-1].startswith("error: ") and len(told) == 1
    assert said.format(file=tmp_path / "my_importer.py") in told[-1]
    assert "corpus.importer.kind=my_importer.make" in told[-1] or "a.txt" in told[-1]


def test_an_importer_of_the_users_own_is_given_what_it_takes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "my_importer.py").write_text(
        "def make(out, raw, speed):\n    out.mkdir()\n    (out / 'a').write_text(f'{raw.name} {speed}')")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "my_importer", raising=False)
    assert run_command("prepare", "corpus=folder", "corpus.raw=x", f"corpus.out={tmp_path}/out",
                       "corpus.importer={kind:my_importer.make,speed:3}") == 0
    assert (tmp_path / "out" / "a").read_text() == "x 3"


def settings(**given: object) -> SpeakSettings:
    return SpeakSettings(speech=SpeechSettings(), style=StyleSettings(name="plain"), **given)  # type: ignore[arg-type]


def test_jobs_of_a_sweep_have_outputs_of_their_own() -> None:
    given = settings(out="o/a.mp4", export_alignment="t.full.lab")
    assert numbered(given, None) is given
    second = numbered(given, 1)
    assert (second.out, second.export_alignment, second.export_keys) == ("o/a_2.mp4", "t_2.full.lab", None)


def test_the_home_folder_is_found_as_a_shell_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert at_home("~/a") == tmp_path / "a" and at_home("a/~/b") == Path("a/~/b") and at_home("~a") == Path("~a")
    parser = Flags()
    parser.add_argument("run", nargs="+", type=Path)
    parser.add_argument("--out", type=Path)
    options = parser.read(["~/a", "b", "--out=~/c"])
    assert options.run == [tmp_path / "a", Path("b")] and options.out == tmp_path / "c"
    from dnnvss.settings import read_settings

    read = read_settings(SpeakSettings, {"speech": {}, "style": {"name": "plain"}, "out": "~/x.mp4", "text": "~/x"}, "")
    assert (read.out, read.text) == (f"{tmp_path}/x.mp4", "~/x")


def test_a_folder_of_other_things_is_no_place_for_a_run(tmp_path: Path) -> None:
    check_begun(tmp_path / "new", None, "")  # type: ignore[arg-type]
    check_begun(tmp_path, None, "")  # type: ignore[arg-type]
    (tmp_path / ".config.abcdefgh.part.yaml").touch()  # what a killed command left
    check_begun(tmp_path, None, "")  # type: ignore[arg-type]
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(DnnvssError, match="holds something that is not a run"):
        check_begun(tmp_path, None, "")  # type: ignore[arg-type]


def test_a_name_that_is_too_long_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("compare", "e" * 300) == 1
    assert capsys.readouterr().err.startswith("error: ")
    assert files.remedy_for(OSError(36, "File name too long")) == "Choose a shorter name"


@pytest.mark.parametrize("words", [
    ("visemes", "data", "--rate", "1e300"),
    ("prepare", "corpus=demo", "corpus.out=/proc/self/mem"),
])
def test_rates_and_places_that_there_cannot_be_are_told(
        words: tuple[str, ...], capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(*words) in (1, 2)
    said = capsys.readouterr().err.strip().splitlines()
    assert said[-1].startswith("error: ") and len(said) == 1


def test_what_steers_a_terminal_is_escaped_in_an_error() -> None:
    error = DnnvssError("is named \x1b]0;own\x07 and \u202eexe", file="a\x9b.txt", remedy="Rename it\r")
    assert str(error) == "a\\x9b.txt: is named \\x1b]0;own\\x07 and \\u202eexe. Rename it\\x0d."


def test_a_take_on_a_head_is_never_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    take = tmp_path / "t.csv"
    take.write_text("seconds,jawOpen\n0,0\n0.1,1\n")
    (tmp_path / "link.csv").symlink_to(take)
    for out in (take, tmp_path / "link.csv"):
        assert run_command("rig", take, "--out", out) == 1
        assert "is read, and would be written over" in capsys.readouterr().err
    assert run_command("rig", take, "--out", tmp_path / "a.json", tmp_path / "a.json") == 1
    assert run_command("rig", take, "--out", tmp_path / "a.mp4", "--turn", "nan") == 1
    assert "--turn nan is no angle" in capsys.readouterr().err
    assert run_command("rig", take, "--out", tmp_path / "a.mp4", "--rate", "1/1000000") == 1
    assert "a video has 1/100 to 1000 frames a second" in capsys.readouterr().err
    assert take.read_text().startswith("seconds")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["link.csv", "t.csv"]


def test_a_take_far_too_long_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = [f"c{k}" for k in range(1000)]
    rows = [",".join(["seconds", *names]), ",".join(["0"] * 1001), ",".join(["3600", *["1"] * 1000])]
    (tmp_path / "t.csv").write_text("\n".join([*rows, ""]))
    assert run_command("rig", tmp_path / "t.csv", "--rate", "60", "--out", tmp_path / "a.csv") == 1
    assert "432,000 frames of 1000 curves are too many" in capsys.readouterr().err


def test_the_name_of_a_file_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "a b.txt").write_text("hello")
    for text in (f"{tmp_path}/a b.txt", f"@{tmp_path}/a b.txt"):
        with pytest.raises(DnnvssError, match=r"a b\.txt: text= is the name of a file.*\$\(cat '.*a b\.txt'\)"):
            check_text(text)
    for text in ("readme.txt", f"see {tmp_path}/a b.txt", "x" * 5000 + ".txt", "a\0.txt"):
        check_text(text)


@pytest.mark.parametrize(("given", "said"), [
    ({"export_keys": "k.txt"}, r"k\.txt: keys cannot be kept as \.txt"),
    ({"export_alignment": "t.ctm"}, r"t\.ctm: alignments of the kind '\.ctm' cannot be written\. Use \.TextGrid"),
    ({"out": "folder.mp4"}, r"folder\.mp4: cannot be written \(Is a directory\)"),
    ({"out": "a.txt/b.mp4"}, r"b\.mp4: cannot be written \(Not a directory\)"),
    ({"export_rig": "closed/deep/take.csv"}, r"take\.csv: cannot be written \(Permission denied\)"),
])
def test_an_output_that_cannot_be_written_is_refused_before_anything_is_said(
        given: dict[str, str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("folder.mp4", "closed"):
        (tmp_path / name).mkdir()
    (tmp_path / "a.txt").touch()
    access = os.access
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path).name != "closed" and access(path, mode))
    check_files(settings(text="hello"))
    with pytest.raises(DnnvssError, match=said):
        check_files(settings(text="hello", **given))


def test_a_time_code_that_the_rate_has_not_is_refused_before_a_video_is_drawn(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    take = tmp_path / "t.csv"
    take.write_text("seconds,jawOpen\n0,0\n0.1,1\n")
    out = [tmp_path / "a.mp4", tmp_path / "a.json"]
    assert run_command("rig", take, "--out", *out, "--rate", "25", "--timecode", "00:00:00:25") == 1
    assert "the time code begins with frame 25, and there are 25 a second" in capsys.readouterr().err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["t.csv"]


def test_an_export_that_does_not_go_with_what_is_given_is_refused_before_anything_is_said(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    face = SimpleNamespace(gauges={}, names=("aam01",), contours={"lips_outer": (0, 1)}, kind="aam")
    run: Any = SimpleNamespace(face=face, voice=SimpleNamespace(rate=25.0))
    words, voice = SpeakRequest("hello"), SpeakRequest(recording=Recording(np.zeros(9), 16000))
    monkeypatch.setattr("dnnvss.synthesis.rig.on_head", lambda run, head: None)
    monkeypatch.setattr("dnnvss.synthesis.rig.speaking_head", lambda: None)
    monkeypatch.setattr("dnnvss.synthesis.speak.key_gauges", lambda run: {"aperture": None})
    late, glb = {"rig_timecode": TimeCode(frame=25)}, {"export_rig": "t.glb"}
    for given, request, said in (
            (glb | late, words, "the time code begins with frame 25, and there are 25 a second"),
            (glb | {"rig_curves": "plain"}, words, r"t\.glb: no head is moved by these curves"),
            (glb | {"rig_curves": "oculus"}, words, r"t\.glb: no head is moved by these curves"),
            ({"export_rig": "t.csv", "rig_curves": "oculus"}, voice, "a voice alone tells no phones"),
            ({"export_visemes": "t.tsv"}, voice, r"t\.tsv: a voice alone tells no phones"),
            ({"export_alignment": "t.lab"}, voice, r"t\.lab: a voice alone tells no phones"),
            ({"export_keys": "k.csv", "key_names": ("aperture", "apperture")}, words, "nothing is named 'apperture'")):
        with pytest.raises(DnnvssError, match=said):
            check_exports(settings(**given), run, request)
    whole = glb | {"export_visemes": "t.tsv", "export_alignment": "t.lab", "export_keys": "k.csv",
                   "key_names": ("aperture",)}
    check_exports(settings(**whole), run, words)
    check_exports(settings(**glb, **late, rig_rate=FrameClock(30)), run, words)
    check_exports(settings(**glb, **late), run, replace(words, scene=Scene(rate=FrameClock(30))))


def test_exports_are_checked_before_anything_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*given: Any) -> None:
        raise DnnvssError("not so")

    monkeypatch.setattr(speaking, "read_request", lambda settings, run: None)
    monkeypatch.setattr(speaking, "speak", lambda run, request: pytest.fail("it was said"))
    edited = settings(import_curves="curves.wav", rig_rate=FrameClock(25))
    with monkeypatch.context() as unchecked, pytest.raises(DnnvssError, match="a take is not read from"):
        unchecked.setattr(speaking, "check_exports", lambda *given: None)
        speaking._spoken(edited, None)  # type: ignore[arg-type]
    monkeypatch.setattr(speaking, "check_exports", refuse)
    with pytest.raises(DnnvssError, match="not so"):
        speaking._spoken(settings(), None)  # type: ignore[arg-type]


@pytest.mark.parametrize("command", ["unseen", "outside"])
def test_the_last_run_is_looked_at_before_the_first_is_worked_on(
        command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    for reader in ("settings.RunSettings.load", "run.Run.open"):
        monkeypatch.setattr(f"dnnvss.runs.{reader}", lambda folder: files.read_text(folder / "config.yaml", ""))
    monkeypatch.setattr("dnnvss.evaluation.unseen.leave_words_out", lambda *given: pytest.fail("it was fitted"))
    monkeypatch.setattr("dnnvss.face.landmarker.find_task", lambda path: pytest.fail("it was watched"))
    for name in "ab":
        (tmp_path / name).mkdir()
        (tmp_path / name / "config.yaml").touch()
    assert run_command(command, tmp_path / "a", tmp_path / "typo") == 1
    assert "typo/config.yaml: no such file" in capsys.readouterr().err
    (tmp_path / "b" / "evaluation").touch()
    assert run_command(command, tmp_path / "a", tmp_path / "b") == 1
    assert "cannot be written (Not a directory)" in capsys.readouterr().err


def test_a_table_that_cannot_be_written_is_refused_before_it_is_reckoned(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from dnnvss.evaluation import correlation_figures, finished

    study: Any = SimpleNamespace(name="context")
    (tmp_path / "table").touch()
    with pytest.raises(DnnvssError, match="Train a system first"):  # a file that is no run is no place
        finished.compare_runs([tmp_path / "table"])
    with pytest.raises(DnnvssError, match=r"face\.npz: no such file"):
        correlation_figures.write_correlations(study, tmp_path / "table")
    monkeypatch.setattr(finished, "read_run", lambda folder: None)
    monkeypatch.setattr(finished, "by_face", lambda runs: pytest.fail("it was compared"))
    monkeypatch.setattr(correlation_figures, "open_encoding", lambda folder: (None, None, ""))
    with pytest.raises(DnnvssError, match=r"evaluation\.md: cannot be written \(Not a directory\)"):
        finished.compare_runs([tmp_path], tmp_path / "table")
    with pytest.raises(DnnvssError, match=r"context\.png: cannot be written \(Not a directory\)"):
        correlation_figures.write_correlations(study, tmp_path, tmp_path / "table")
