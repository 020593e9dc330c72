"""Which engine speaks: the one that is named, or the best that is there, each with a voice that can do it."""

from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.speech.engines.base import Engine
from dnnvss.speech.engines.builtin import FormantEngine
from dnnvss.speech.engines.espeak import EspeakEngine
from dnnvss.speech.engines.festival import FestivalEngine
from dnnvss.speech.engines.flite import FliteEngine

ENGINES: dict[str, type[Any]] = {
    engine.name: engine for engine in (FestivalEngine, FliteEngine, EspeakEngine, FormantEngine)
}
"""All engines by name, the best sounding first; the last one is always there."""


def find_engine(name: str = "auto", imposing: bool = False, voice: str | None = None) -> Engine:
    """The engine of that name, or for ``auto`` the best that can speak (its ``name`` and ``voice`` say which).

    Args:
        name: of the engine, or ``auto``.
        imposing: it has to speak the durations that it is given.
        voice: one of its voices; None takes the best that is installed.

    Raises:
        DnnvssError: there is no such engine or voice, it is not installed (the message names the package), or it
            cannot speak given durations where it has to.
    """
    if name != "auto" and name not in ENGINES:
        raise DnnvssError(f"unknown speech engine {name!r}", remedy=f"Use one of: auto {' '.join(ENGINES)}")
    known = _built(list(ENGINES) if name == "auto" else [name])
    named = [engine for engine in known if voice in (None, engine.voice)]
    if not named:
        raise DnnvssError(f"speech.engine={name} has no voice {voice!r}",
                          remedy=f"Use speech.voice=null, or one of {', '.join(e.voice for e in known)}")
    fit = [engine for engine in named if engine.imposes or not imposing]
    if not fit:
        raise DnnvssError(f"the speech engine {named[0].name} speaks in its own time only"
                          + (f" with the voice {voice}" if voice else ""),
                          remedy="Use speech=auto, or leave out what sets the time: alignment, speed, total, "
                                 "durations=model, or pauses and rates in the text")
    if able := next((engine for engine in fit if engine.available() is None), None):
        return able
    raise DnnvssError(f"the speech engine {fit[0].name} cannot speak here: {fit[0].available()}",
                      remedy="Or take the best that is there with speech=auto")


def _built(names: list[str]) -> list[Engine]:
    """These engines with each of their voices, the best first."""
    return [ENGINES[name](voice) for name in names for voice in ENGINES[name].voices]
