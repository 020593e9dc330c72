"""Which engine speaks: the one that is named, or the best that is there."""

from dnnvss.errors import DnnvssError
from dnnvss.speech.engines.base import Engine
from dnnvss.speech.engines.builtin import FormantEngine
from dnnvss.speech.engines.espeak import EspeakEngine
from dnnvss.speech.engines.festival import FestivalEngine
from dnnvss.speech.engines.flite import FliteEngine

ENGINES: dict[str, type] = {
    engine.name: engine for engine in (FestivalEngine, FliteEngine, EspeakEngine, FormantEngine)
}
"""All engines by name, the best sounding first; the last one is always there."""


def find_engine(name: str = "auto", imposing: bool = False) -> Engine:
    """Return the engine of that name, or for ``auto`` the best that is there (its ``name`` says which).

    Args:
        name: of the engine, or ``auto``.
        imposing: it has to speak the durations that it is given.

    Raises:
        DnnvssError: there is no such engine, it is not installed (the message names the package), or it cannot speak
            given durations where it has to.
    """
    if name == "auto":
        present = (engine for engine in (kind() for kind in ENGINES.values()) if engine.available() is None)
        return next(engine for engine in present if engine.imposes or not imposing)
    if name not in ENGINES:
        raise DnnvssError(f"unknown speech engine {name!r}", remedy=f"Use one of: auto {' '.join(ENGINES)}")
    engine: Engine = ENGINES[name]()
    if reason := engine.available():
        raise DnnvssError(f"the speech engine {name} cannot speak here: {reason}",
                          remedy="Or take the best that is there with speech.engine=auto")
    if imposing and not engine.imposes:
        raise DnnvssError(f"the speech engine {name} speaks in its own time only",
                          remedy="Use speech=auto, or leave out the alignment, speed and total that set the time")
    return engine
