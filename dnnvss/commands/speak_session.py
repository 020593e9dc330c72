"""A session of the studio, said again from a shell: what is said and how stands in the file, in place of settings."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from dnnvss import files
from dnnvss.commands.speak_settings import SpeakSettings
from dnnvss.errors import DnnvssError
from dnnvss.records import as_record
from dnnvss.runs.run import Run
from dnnvss.runs.talkers import run_folders
from dnnvss.studio.speaking.saying import Saying
from dnnvss.style.generator import StyleSettings
from dnnvss.synthesis.request import Recording, SpeakRequest

_REMEDY = "Take session.json away from the studio once more"


def read_session(path: Path) -> Saying:
    """What the studio was asked to say.

    Raises:
        DnnvssError: the file is no session.
    """
    value = files.read_json(path, _REMEDY)
    if not isinstance(value, dict) or "saying" not in value:
        raise DnnvssError("this is no session of the studio", file=path, remedy=_REMEDY)
    return as_record(Saying, value["saying"], path, _REMEDY)


def session_run(settings: SpeakSettings, path: Path) -> Path:
    """The run that is named, or else the one of ``runs`` that the session was spoken by.

    Raises:
        DnnvssError: it is not there.
    """
    if settings.run:
        return Path(settings.run)
    name = read_session(path).run
    for folder in run_folders(Path(settings.runs)):
        if folder.name == name and folder.is_dir():
            return folder
    raise DnnvssError(f"the session was spoken by {name}, which is not in {settings.runs}", file=path,
                      remedy="Say where it is: run=FOLDER")


def session_request(
    path: Path, run: Run, recording: Recording | None, style: Callable[[str], StyleSettings], scale: float
) -> SpeakRequest:
    """The request that the studio made of it.

    Args:
        path: of the session.
        run: that speaks.
        recording: the voice that it was spoken to.
        style: the style of a name.
        scale: of the pictures.

    Raises:
        DnnvssError: it was spoken to a voice and there is none, or the other way about.
    """
    saying = read_session(path)
    if (recording is None) != (saying.sound is None):
        told = "was spoken to a voice" if saying.sound else "was spoken without a voice of its own"
        remedy = "Give the speech.wav that lay beside it, as wav=speech.wav" if saying.sound else "Leave wav= out"
        raise DnnvssError(f"the session {told}", file=path, remedy=remedy)
    request = saying.request(run.face, {saying.style: style(saying.style)}, recording)
    return replace(request, scene=replace(request.scene, scale=scale))
