"""``dnnvss speak text="..."``: a trained run speaks; settings in ``conf/synth.yaml``.

Reads what is given, calls :func:`dnnvss.synthesis.speak.speak`, prints and writes.
"""

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from omegaconf import DictConfig

from dnnvss import files
from dnnvss.commands.arguments import SettingsCommand, parse_arguments
from dnnvss.commands.compose import compose
from dnnvss.commands.composed import job_number, run_command, typed_settings
from dnnvss.commands.speak_settings import SpeakSettings, check_files, numbered
from dnnvss.errors import DnnvssError
from dnnvss.formats import read_alignment, spanning, write_alignment
from dnnvss.media import SOUND_RATE, SPEECH_RATE, read_audio
from dnnvss.runs.choice import HEARD, SPOKEN, best_run
from dnnvss.runs.run import Run
from dnnvss.runs.talkers import is_together, talker_run
from dnnvss.style import read_keys, write_keys
from dnnvss.style.generator import StyleSettings, make_style
from dnnvss.synthesis.footage import read_footage
from dnnvss.synthesis.outputs import write_spoken
from dnnvss.synthesis.plan import check_alignment
from dnnvss.synthesis.request import Recording, Scene, SpeakRequest, check_views
from dnnvss.synthesis.speak import Spoken, named_gauges, speak
from dnnvss.synthesis.stage import scene_clock
from dnnvss.text.overrides import read_overrides
from dnnvss.timing import Alignment

if TYPE_CHECKING:  # a head is loaded when one is to be written
    from dnnvss.synthesis.rig import RigRequest

COMMAND = SettingsCommand("speak", "synth", SpeakSettings, bare="text", literal=True)


def main(arguments: Sequence[str]) -> int:
    """Speak what the arguments ask for."""
    return run_command(COMMAND, arguments, synthesise)


def synthesise(config: DictConfig) -> None:
    """Write the video that ``config`` asks for, and its trajectory, alignment, plot and report beside it."""
    settings: SpeakSettings = numbered(typed_settings(COMMAND, config), job_number())
    check_files(settings)
    run = Run.open(chosen_run(settings))
    spoken = _spoken(settings, run)
    print("\n".join([*spoken.remarks, *spoken.stage.remarks]))
    exported = write_exports(settings, spoken)
    about = {"style": asdict(settings.style), "keys": settings.import_keys}
    if settings.session:
        about = {"session": settings.session}
    keep = Path(settings.wav) if settings.wav else None
    written = write_spoken(spoken, Path(settings.out), about, keep, with_progress)
    print("wrote " + ", ".join(map(str, written + exported)))


def _spoken(settings: SpeakSettings, run: Run) -> Spoken:
    """What is said; where curves came back edited, once more with the keys that hold what was changed."""
    request = read_request(settings, run)
    check_exports(settings, run, request)
    if not settings.import_curves:
        return speak(run, request)
    from dnnvss.export.take_read import read_take
    from dnnvss.synthesis.edits import keys_of_edits

    made_at = settings.rig_rate or scene_clock(run, request.scene)
    edited = read_take(Path(settings.import_curves), made_at=made_at)  # refused before anything is said
    edits = keys_of_edits(speak(run, request), edited, settings.easing / 1000)
    print(f"{settings.import_curves}: {len(edits)} keys hold what was edited")
    if settings.export_edits:
        print(f"wrote {write_keys(settings.export_edits, edits)}")
    return speak(run, replace(request, keys=(*request.keys, *edits)))


def chosen_run(settings: SpeakSettings) -> Path:
    """The run that is named, or the best one for what is given; prints which it is.

    Raises:
        DnnvssError: no run does with what is given.
    """
    folder, why = Path(settings.run or ""), ""
    if settings.session:
        from dnnvss.commands.speak_session import session_run

        folder, why = session_run(settings, Path(settings.session)), "of the session"
    elif not settings.run:
        spoken = SPOKEN if settings.text or settings.alignment or not settings.wav else frozenset()
        heard = HEARD if settings.wav or settings.speech.engine != "none" else frozenset()
        folder, why = best_run(Path(settings.runs), spoken | heard, settings.talker)
    elif is_together(folder):
        folder, why = talker_run(folder, settings.talker), f"of {settings.talker}"
    print(f"run: {folder}" + (f" ({why})" if why else ""))
    return folder


def check_text(text: str) -> None:
    """Refuse the name of a file in place of its text."""
    name = text.strip().removeprefix("@")
    named = name.lower().endswith((".txt", ".ssml", ".xml", ".srt", ".vtt")) and not set("\n\0") & set(name)
    if named and all(len(part) < 250 for part in Path(name).parts) and Path(name).is_file():
        raise DnnvssError("text= is the name of a file, which would be read out letter by letter", file=name,
                          remedy=f'Give what it holds: text="$(cat {shlex.quote(name)})"')


def read_request(settings: SpeakSettings, run: Run) -> SpeakRequest:
    """The request, with every file read that it names.

    Raises:
        DnnvssError: a file that is missing or damaged, or a setting that asks for what there is not.
    """
    recording = _recording(Path(settings.wav)) if settings.wav else None
    if settings.session:
        from dnnvss.commands.speak_session import session_request

        return session_request(Path(settings.session), run, recording, named_style, settings.scale)
    scene = read_scene(settings, run)
    text = files.as_utf8(settings.text or "")
    check_text(text)
    alignment = _alignment(Path(settings.alignment), text, recording) if settings.alignment else None
    return SpeakRequest(
        text=text, recording=recording, alignment=alignment,
        overrides=read_overrides(settings.overrides) if settings.overrides else None,
        durations=settings.durations, speed=settings.speed, total=settings.total, lead_in=settings.lead_in / 1000,
        lead_out=settings.lead_out / 1000, engine=settings.speech.engine, engine_voice=settings.speech.voice,
        style=make_style(settings.style, run.face),
        keys=tuple(read_keys(settings.import_keys)) if settings.import_keys else (),
        anticipation=settings.anticipation / 1000, scene=scene)


def read_scene(settings: SpeakSettings, run: Run) -> Scene:
    """What is to be seen, the footage read.

    Raises:
        DnnvssError: an unknown view, or footage that is missing, has no landmarks or too few of them.
    """
    views = tuple(settings.render.split("+"))
    check_views(views, settings.into is not None)
    footage = read_footage(run, settings.into) if settings.into is not None else None
    if footage is not None:
        footage.usable()
    return Scene(views, footage, settings.into_fill, settings.rate, settings.scale)


def named_style(name: str) -> StyleSettings:
    """A style of ``conf/style``.

    Raises:
        UsageError: there is none of that name.
    """
    return typed_settings(COMMAND, compose(parse_arguments(COMMAND, [f"style={name}"]))).style


def _recording(path: Path) -> Recording:
    return Recording(read_audio(path, SOUND_RATE), SOUND_RATE, read_audio(path, SPEECH_RATE), path)


def _alignment(path: Path, text: str, recording: Recording | None) -> Alignment:
    """The phone times in a file, over the whole of the recording that they belong to."""
    alignment = check_alignment(read_alignment(path), text, path)
    if recording is None:
        return alignment
    try:
        return spanning(alignment, len(recording.samples) / recording.rate)
    except DnnvssError as error:
        raise DnnvssError(error.problem, file=path, remedy=error.remedy) from error


def check_exports(settings: SpeakSettings, run: Run, request: SpeakRequest) -> None:
    """Refuse exports that what is going to be spoken cannot be written as.

    Raises:
        DnnvssError: keys of nothing, phones of a voice alone, or curves, a time code or a kind of file that does not go
            with the face or the rate.
    """
    if settings.export_keys:
        named_gauges(run, settings.key_names)
    if settings.export_alignment and request.wordless and Path(settings.export_alignment).suffix.lower() != ".textgrid":
        raise DnnvssError("a voice alone tells no phones, and this format holds nothing else",
                          file=settings.export_alignment,
                          remedy="Name it FILE.TextGrid, or give the text or an alignment")
    if settings.export_rig:
        from dnnvss.synthesis.rig import check_take

        check_take(Path(settings.export_rig), run, rig_request(settings), request)
    if settings.export_visemes and request.wordless:
        raise DnnvssError("a voice alone tells no phones, and visemes are phones as they are seen",
                          file=settings.export_visemes, remedy="Give the text or an alignment")


def rig_request(settings: SpeakSettings) -> "RigRequest":
    """How a take is to be written."""
    from dnnvss.synthesis.rig import RigRequest

    return RigRequest(settings.rig_curves, settings.rig_rate, settings.rig_timecode)


def write_exports(settings: SpeakSettings, spoken: Spoken) -> list[Path]:
    """Write the keys, times and curves that are asked for, and return their paths."""
    written = []
    if settings.export_keys:
        written.append(write_keys(settings.export_keys, spoken.keys(settings.key_names, settings.key_positions)))
    if settings.export_alignment:
        written.append(_export_alignment(Path(settings.export_alignment), spoken))
    if settings.export_curves:
        from dnnvss.export.curves import write_curves

        written.append(write_curves(Path(settings.export_curves), spoken.curves(), spoken.stage.clock))
    if settings.export_rig:
        written += _export_rig(Path(settings.export_rig), settings, spoken)
    if settings.export_visemes:
        written.append(_export_visemes(Path(settings.export_visemes), settings, spoken))
    return written


def _export_rig(path: Path, settings: SpeakSettings, spoken: Spoken) -> list[Path]:
    """Write the take, print how well it fits, and draw that beside it."""
    from dnnvss.export.take import write_take
    from dnnvss.synthesis.rig import plot_fit, spoken_take

    made = spoken_take(spoken, rig_request(settings))
    if lines := made.remarks():
        print("\n".join(lines))
    plot = plot_fit(path.with_name(f"{path.stem}.fit.png"), made, spoken)
    return [write_take(path, made.take), *([plot] if plot else [])]


def _export_visemes(path: Path, settings: SpeakSettings, spoken: Spoken) -> Path:
    from dnnvss.export.visemes import write_cues

    assert spoken.face_phones is not None
    sound = Path(settings.out).with_suffix(".wav").name if spoken.plan.sound else ""
    return write_cues(path, spoken.face_phones, settings.viseme_list, sound)


def _export_alignment(path: Path, spoken: Spoken) -> Path:
    """Write the times in the format of the suffix, HTS full-context labels for ``.full.lab``."""
    from dnnvss.text.full_context import write_full_context

    if path.name.lower().endswith(".full.lab"):
        return write_full_context(path, spoken.plan.alignment, spoken.plan.text)
    return write_alignment(path, spoken.plan.alignment)


def with_progress(frames: Iterator[np.ndarray]) -> Iterator[np.ndarray]:
    """The pictures, with a bar that counts them."""
    from dnnvss.progress import counted

    with counted(frames, "rendering", unit="pictures") as bar:
        yield from bar
