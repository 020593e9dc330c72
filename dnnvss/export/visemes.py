"""Phone times as lists of visemes: Oculus-15 as curves, Rhubarb's mouth shapes and Azure's numbers as cues."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.phones.viseme_lists import OCULUS, VISEMES
from dnnvss.timing import FrameClock, Tier

_TICKS = 10_000_000
"""Of 100 nanoseconds in a second, in which Azure counts."""
_ONSET = 0.06
"""Seconds over which a viseme comes and goes in curves, half of it outside its own time."""
SUFFIXES = {"rhubarb": (".tsv", ".json"), "azure": (".json",)}
"""Kinds of files that each list of cues is written as."""


@dataclass(frozen=True)
class Cue:
    """A viseme and its time in seconds."""

    start: float
    end: float
    viseme: str


def viseme_cues(phones: Tier, name: str) -> list[Cue]:
    """The visemes of phones; those that follow each other and are one are joined.

    Args:
        phones: the phones tier; its start is time 0.
        name: of a list in :data:`~dnnvss.phones.viseme_lists.VISEMES`.

    Raises:
        DnnvssError: an unknown list.
    """
    if name not in VISEMES:
        raise DnnvssError(
            f"no list of visemes is named {name!r}", remedy=f"Use one of {', '.join(VISEMES)}"
        )
    cues: list[Cue] = []
    for segment in phones:
        visemes = VISEMES[name][segment.label]
        edges = np.linspace(segment.start, segment.end, len(visemes) + 1) - phones.start
        for viseme, start, end in zip(
            visemes, edges[:-1].tolist(), edges[1:].tolist(), strict=True
        ):
            if cues and cues[-1].viseme == viseme:
                cues[-1] = Cue(cues[-1].start, end, viseme)
            else:
                cues.append(Cue(start, end, viseme))
    return cues


def oculus_curves(phones: Tier, clock: FrameClock, frames: int) -> dict[str, np.ndarray]:
    """The 15 visemes of Oculus as curves (F,) that add up to 1: each comes and goes over its edges.

    Args:
        phones: the phones tier.
        clock, frames: of the curves.
    """
    times = clock.centres(frames)
    curves = {name: np.zeros(frames) for name in OCULUS}
    for cue in viseme_cues(phones, "oculus"):
        rises = _step((times - cue.start) / _ONSET)
        curves[cue.viseme] += rises * _step((cue.end - times) / _ONSET)
    whole = np.maximum(np.sum(list(curves.values()), axis=0), 1e-9)
    return {name: track / whole for name, track in curves.items()}


def _step(x: np.ndarray) -> np.ndarray:
    """From 0 at -1/2 to 1 at 1/2, smoothly."""
    return 0.5 - 0.5 * np.cos(np.pi * np.clip(x + 0.5, 0, 1))


def check_cue_file(path: Path, name: str) -> None:
    """Refuse the name of a file of another kind than a list of visemes is written as.

    Raises:
        DnnvssError: another list or another suffix.
    """
    if path.suffix.lower() not in SUFFIXES.get(name, ()):
        known = "; ".join(f"{n}: {', '.join(s)}" for n, s in SUFFIXES.items())
        raise DnnvssError(
            f"visemes of {name} are not written as {path.suffix or 'a folder'}",
            file=path,
            remedy=f"Use {known}; rig_curves=oculus writes curves",
        )


def write_cues(path: Path, phones: Tier, name: str, sound: str = "") -> Path:
    """Write cues as the program writes them that they are named after; return the path.

    Args:
        path: ``.tsv`` or ``.json`` for Rhubarb's, ``.json`` for Azure's.
        phones: the phones tier.
        name: ``rhubarb`` or ``azure``.
        sound: the sound file, which Rhubarb's JSON names.

    Raises:
        DnnvssError: another list or another suffix.
    """
    check_cue_file(path, name)
    cues = viseme_cues(phones, name)
    if name == "azure":
        return files.write_json(
            path,
            [{"audioOffset": round(c.start * _TICKS), "visemeId": int(c.viseme)} for c in cues],
        )
    if path.suffix.lower() == ".tsv":
        return files.write_text(path, _tsv(cues))
    mouth = [{"start": round(c.start, 2), "end": round(c.end, 2), "value": c.viseme} for c in cues]
    duration = round(cues[-1].end if cues else 0.0, 2)
    about = {"soundFile": sound, "duration": duration}
    return files.write_json(path, {"metadata": about, "mouthCues": mouth})


def _tsv(cues: Sequence[Cue]) -> str:
    """Start and shape a line, and where the last one ends."""
    lines = [f"{c.start:.2f}\t{c.viseme}" for c in cues]
    return "\n".join([*lines, f"{cues[-1].end if cues else 0:.2f}\tX", ""])
