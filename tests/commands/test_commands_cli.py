"""What is typed on the command line reaches the configuration as it was typed."""

import errno
import os

import pytest
from conftest import ROOT
from hydra import compose, initialize_config_dir
from hypothesis import given, settings
from hypothesis import strategies as st

from dnnvss.commands.entry import command, helped, quoted


def heard(text: str) -> str:
    with initialize_config_dir(str(ROOT / "conf"), version_base="1.3"):
        return str(compose("synth", quoted([f"text={text}"])).text)


@pytest.mark.parametrize("text", [
    "Hello, I am: here", "it's {W AY1 N D}", "the ${price} is $5", "a \\${b} and \\\\${c}", "${", "back\\", "a\\'b",
    '"quoted"', "[1, 2]", "x=y", "C:\\new\\'quote", "\\\\",
])
def test_texts_arrive_as_they_were_typed(text: str) -> None:
    assert heard(text) == text


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.text(st.sampled_from("ab \\'\"${},:="), min_size=1, max_size=8))
def test_any_text_arrives_as_it_was_typed(text: str) -> None:
    if text.strip():
        assert heard(text) == text


def test_other_settings_are_left_to_hydra() -> None:
    assert quoted(["rate=25", "text=null", "style.rest=true"]) == ["rate=25", "text=null", "style.rest=true"]


def test_help_says_what_settings_mean(capsys: pytest.CaptureFixture[str]) -> None:
    assert helped(ROOT / "conf", "synth", ["run=x", "--help"]) and not helped(ROOT / "conf", "synth", ["text=--help"])
    said = capsys.readouterr().out
    assert "speed: 1.0 " in said and "2 is twice as fast" in said and "# style=... one of: articulated, plain" in said
    assert "hydra:" not in said


@pytest.mark.parametrize("number, said", [(errno.EACCES, "error: x.mp4: Permission denied. Choose another place"),
                                          (errno.ENOSPC, "error: x.mp4: No space left on device. Free some")])
def test_trouble_with_files_ends_in_a_line(number: int, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    @command
    def write() -> None:
        raise OSError(number, os.strerror(number), "x.mp4")

    with pytest.raises(SystemExit, match="1"):
        write()
    assert said in capsys.readouterr().err
