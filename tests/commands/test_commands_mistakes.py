"""Small mistakes of a user's that once lost a file or ended in a traceback."""

import sys
from pathlib import Path

import pytest
from conftest import run_command

from dnnvss import files
from dnnvss.commands.flags import Flags
from dnnvss.commands.speak import check_text
from dnnvss.commands.speak_settings import SpeakSettings, SpeechSettings, numbered
from dnnvss.errors import DnnvssError
from dnnvss.runs.naming import check_begun
from dnnvss.settings import at_home
from dnnvss.style.generator import StyleSettings

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
    assert "216,001 frames of 1000 curves are too many" in capsys.readouterr().err


def test_the_name_of_a_file_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "a b.txt").write_text("hello")
    for text in (f"{tmp_path}/a b.txt", f"@{tmp_path}/a b.txt"):
        with pytest.raises(DnnvssError, match=r"a b\.txt: text= is the name of a file.*\$\(cat '.*a b\.txt'\)"):
            check_text(text)
    for text in ("readme.txt", f"see {tmp_path}/a b.txt", "x" * 5000 + ".txt", "a\0.txt"):
        check_text(text)
