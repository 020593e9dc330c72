"""The settings of ``conf/synth.yaml``, and which of them do not go together."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.export.take import CURVES, check_take_file
from dnnvss.export.timecode import TimeCode
from dnnvss.export.visemes import SUFFIXES, check_cue_file
from dnnvss.formats import check_alignment_file
from dnnvss.runs.talkers import is_together
from dnnvss.settings import setting
from dnnvss.speech.engines.choice import ENGINES
from dnnvss.style import check_keys_file
from dnnvss.style.generator import StyleSettings
from dnnvss.synthesis.footage import footage_files
from dnnvss.synthesis.outputs import SOUND, beside
from dnnvss.synthesis.request import CORPUS, FILLS
from dnnvss.timing import FrameClock

_INPUTS = ("session", "wav", "alignment", "import_keys", "import_curves", "overrides")
_IN_SESSION = ("text", "alignment", "overrides", "import_keys", "import_curves", "into", "rate", "total", "talker")
"""Settings that mean nothing beside a session, which says all of that."""
_OUTPUTS = ("export_curves", "export_keys", "export_alignment", "export_rig", "export_visemes", "export_edits")
_ENDINGS = {"out": (".mp4", "export_curves=FILE.csv writes numbers"),
            "export_curves": (".csv", "the trajectory's .npz is written beside the video")}
"""Settings that name a file of one kind, and where other kinds are to be had."""
_MOST_FRAMES = 1000
"""Frames a second, beyond which no screen goes."""


@dataclass(frozen=True)
class SpeechSettings:
    """Who speaks."""

    engine: str = setting("auto", choices=("auto", *ENGINES, CORPUS, "none"),
                          doc="festival, flite, espeak, formant, auto for the best that can, corpus for "
                          "recordings of fragments, or none")
    voice: str | None = setting(None, doc="one of the engine's voices")


@dataclass(frozen=True)
class SpeakSettings:
    """What ``synth.py`` is told; ``conf/synth.yaml`` says what each setting means."""

    speech: SpeechSettings
    style: StyleSettings
    run: str | None = setting(None, path=True)
    runs: str = setting("runs", path=True)
    talker: str | None = setting(None)
    text: str | None = setting(None)
    wav: str | None = setting(None, path=True)
    alignment: str | None = setting(None, path=True)
    session: str | None = setting(None, path=True)
    out: str = setting("speech.mp4", path=True)
    rate: FrameClock | None = setting(None)
    into: str | None = setting(None, path=True)
    into_fill: str = setting("pingpong", choices=FILLS)
    render: str = setting("face")
    scale: float = setting(1.0, above=0, most=16)
    durations: str = setting("corpus", choices=("corpus", "model"))
    speed: float = setting(1.0, above=0)
    total: float | None = setting(None, above=0)
    lead_in: float = setting(250.0, least=0, most=600_000)
    lead_out: float = setting(350.0, least=0, most=600_000)
    anticipation: float = setting(0.0, least=-5000, most=5000)
    export_alignment: str | None = setting(None, path=True)
    export_curves: str | None = setting(None, path=True)
    overrides: str | None = setting(None, path=True)
    import_keys: str | None = setting(None, path=True)
    export_keys: str | None = setting(None, path=True)
    import_curves: str | None = setting(None, path=True)
    easing: float = setting(80.0, least=0, most=2000)
    export_edits: str | None = setting(None, path=True)
    export_rig: str | None = setting(None, path=True)
    rig_curves: str = setting("arkit", choices=CURVES)
    rig_rate: FrameClock | None = setting(None)
    rig_timecode: TimeCode = setting(TimeCode())
    export_visemes: str | None = setting(None, path=True)
    viseme_list: str = setting("rhubarb", choices=tuple(SUFFIXES))
    key_names: tuple[str, ...] = setting(("aperture", "lower_lip", "width"))
    key_positions: tuple[float, ...] = setting((0.5,), least=0, most=1)


def numbered(settings: SpeakSettings, job: int | None) -> SpeakSettings:
    """The settings of a job of a sweep, whose outputs have its number, so that none overwrites another's.

    Args:
        settings: as composed.
        job: counted from 0; None where there is no sweep, and the outputs keep their names.
    """
    if job is None:
        return settings
    named = {name: getattr(settings, name) for name in ("out", *_OUTPUTS)}
    changed: dict[str, Any] = {name: _with_number(Path(path), job + 1) for name, path in named.items() if path}
    return replace(settings, **changed)


def _with_number(path: Path, number: int) -> str:
    stem, dot, rest = path.name.partition(".")
    return str(path.with_name(f"{stem}_{number}{dot}{rest}"))


def check_files(settings: SpeakSettings) -> None:
    """Refuse inputs that are missing, outputs of another kind, and names under which a file would be lost.

    Raises:
        DnnvssError: the first of them.
    """
    for name in _INPUTS:
        path = getattr(settings, name)
        if path and not Path(path).is_file():
            what = "is a folder" if Path(path).is_dir() else "no such file"
            raise DnnvssError(what, file=path, remedy=f"Check the path given as {name}=")
    for name, (ending, other) in _ENDINGS.items():
        path = getattr(settings, name)
        if (path or name == "out") and Path(path).suffix.lower() != ending:
            raise DnnvssError(f"{name}={path} does not end in {ending}", remedy=f"Name it so; {other}")
    for name in _IN_SESSION:
        if settings.session and getattr(settings, name) is not None:
            raise DnnvssError(f"{name}= and session= were both given, and a session says that itself",
                              remedy="Leave one of them out")
    if settings.run and settings.talker and not is_together(Path(settings.run)):
        raise DnnvssError(f"talker={settings.talker} chooses among runs, and run={settings.run} names one",
                          remedy="Leave one of them out")
    for name in ("rate", "rig_rate"):
        clock = getattr(settings, name)
        if clock is not None and clock.rate > _MOST_FRAMES:
            raise DnnvssError(f"{name}={clock.rate} is too much", remedy=f"Give {_MOST_FRAMES} at most")
    if settings.export_edits and not settings.import_curves:
        raise DnnvssError("export_edits needs curves that were edited", remedy="Give them as import_curves=FILE")
    for path in (settings.export_keys, settings.export_edits):
        if path:
            check_keys_file(path)
    if settings.export_alignment:
        check_alignment_file(settings.export_alignment)
    if settings.export_rig:
        check_take_file(Path(settings.export_rig))
    if settings.export_visemes:
        check_cue_file(Path(settings.export_visemes), settings.viseme_list)
    _check_places(settings)


def _check_places(settings: SpeakSettings) -> None:
    """Refuse an output that is an input, links followed, or another output, and one that cannot be written.

    The sound beside the video is no output where it is the recording that is read: then it stays as it is.
    """
    out = Path(settings.out)
    sound = out.with_suffix(SOUND)
    read = [Path(path) for name in _INPUTS if (path := getattr(settings, name))]
    read += footage_files(settings.into) if settings.into else []
    written = [out, *beside(out), *(Path(path) for name in _OUTPUTS if (path := getattr(settings, name)))]
    own = settings.wav is not None and Path(settings.wav).resolve() == sound.resolve()
    if not own and (settings.wav or settings.speech.engine != "none"):
        written.append(sound)
    places = [path.resolve() for path in written]
    for path in read:
        if path.resolve() in places:
            raise DnnvssError(f"out={out} would overwrite what is read", file=path, remedy="Choose another out=")
    for place in places:
        if places.count(place) > 1:
            raise DnnvssError("two outputs have this name", file=place, remedy="Name one of them otherwise")
    files.check_writable(written)
