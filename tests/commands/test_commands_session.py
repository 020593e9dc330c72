"""A session of the studio as ``dnnvss speak session=`` takes it; that it gives the same frames, tests/studio holds."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import run_command

from dnnvss.commands.speak_session import read_session, session_request
from dnnvss.errors import DnnvssError
from dnnvss.studio.speaking import Saying
from dnnvss.synthesis.request import Recording

SAID = Saying(run="ann", text="hello", seed=3, pronunciations={"hello": "HH AH0 L OW1"})

VOICE = Recording(np.zeros(10), 100, np.zeros(10))


def session(folder: Path, **more: Any) -> Path:
    path = folder / "session.json"
    path.write_text(json.dumps({"saying": asdict(SAID) | more}))
    return path


def test_a_session_is_what_the_studio_was_asked_to_say(tmp_path: Path) -> None:
    assert read_session(session(tmp_path)) == SAID


@pytest.mark.parametrize(("text", "said"), [("{}", "no session"), ("[]", "no session"), ('{"saying": {}}', "run"),
                                            ('{"saying": {"run": "a", "colour": 1}}', "colour"), ("{", "session.json")])
def test_another_file_is_told(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "session.json").write_text(text)
    with pytest.raises(DnnvssError, match=said):
        read_session(tmp_path / "session.json")


@pytest.mark.parametrize(("sound", "voice", "said"), [("x", None, "wav=speech.wav"), (None, VOICE, "Leave wav= out")])
def test_a_voice_belongs_to_a_session_that_was_spoken_to_one_and_to_no_other(
    tmp_path: Path, sound: str | None, voice: Recording | None, said: str
) -> None:
    with pytest.raises(DnnvssError, match=said):
        session_request(session(tmp_path, sound=sound), None, voice, lambda name: None, 1.0)  # type: ignore[arg-type]


@pytest.mark.parametrize(("more", "said"), [
    ((), "spoken by ann, which is not in runs"), (("text=a",), "text= and session="),
    (("rate=30",), "rate= and session="), (("out=session.mp4",), "overwrite")])
def test_mistakes_are_told_in_a_line(tmp_path: Path, capsys: pytest.CaptureFixture[str],
                                     monkeypatch: pytest.MonkeyPatch, more: tuple[str, ...], said: str) -> None:
    session(tmp_path)
    monkeypatch.chdir(tmp_path)
    assert run_command("speak", "session=session.json", *more) != 0
    assert said in capsys.readouterr().err
