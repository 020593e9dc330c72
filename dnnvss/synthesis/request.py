"""What is asked of a synthesis: plain, typed, frozen; whoever asks has read all files."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.media import SPEECH_RATE, Sound
from dnnvss.style import Key, Style
from dnnvss.timing import Alignment, FrameClock

if TYPE_CHECKING:
    from dnnvss.render import Footage

VIEWS = ("face", "head", "patch", "mesh", "reference")
FILLS = ("pingpong", "hold")
CORPUS = "corpus"
"""Stands for an engine: the recordings of the fragments whose movement is played are heard."""


@dataclass(frozen=True)
class Recording:
    """Somebody's voice.

    Args:
        samples: mono sound (n,) in [-1, 1], as it is to be heard.
        rate: samples a second.
        speech: the same sound at :data:`SPEECH_RATE`, which the aligner and labels of sound listen to.
        file: that it was read from, for messages.
    """

    samples: np.ndarray
    rate: int
    speech: np.ndarray | None = None
    file: Path | None = None

    @property
    def heard(self) -> Sound:
        """What programs listen to."""
        return Sound(self.samples, self.rate) if self.speech is None else Sound(self.speech, SPEECH_RATE)


@dataclass(frozen=True)
class Scene:
    """What is shown, and where the face is drawn.

    Args:
        views: of :data:`VIEWS`, from left to right.
        footage: what the face is drawn into; the run's own picture where None.
        fill: of :data:`FILLS`: how speech longer than the footage goes on.
        rate: the clock of the video; that of the footage or of the talker's corpus where None.
        scale: size of the pictures against those that are drawn into.

    Raises:
        DnnvssError: a view that there is not, or the footage is to be seen and there is none.
    """

    views: tuple[str, ...] = ("face",)
    footage: "Footage | None" = None
    fill: str = "pingpong"
    rate: FrameClock | None = None
    scale: float = 1.0

    def __post_init__(self) -> None:
        check_views(self.views, self.footage is not None)


def check_views(views: tuple[str, ...], footage: bool) -> None:
    """Refuse views that there are not, and that of the footage where there is none."""
    if unknown := [view for view in views if view not in VIEWS]:
        raise DnnvssError(f"render: there is no view {unknown[0]!r}",
                          remedy=f"Use some of {', '.join(VIEWS)}, joined by +")
    if "reference" in views and not footage:
        raise DnnvssError("render=reference needs footage", remedy="Say which with into=")


@dataclass(frozen=True)
class SpeakRequest:
    """What is said, how and when, and what is seen of it.

    What is given decides: an ``alignment`` (with a ``recording`` of it, or to be spoken by an engine), else a
    ``recording`` of the ``text``, else the ``text`` alone, else the ``recording`` alone, which a run that reads the
    sound and nothing else can follow.

    Args:
        text: the words.
        recording: the user's own voice.
        alignment: phone times; with a recording they are those of the recording, else their start is the start of all.
        overrides: pronunciations by word.
        durations: ``corpus``, learnt from the talker, or ``model``, of the run's own system.
        speed: against the talker's; 2 is twice as fast.
        total: seconds of speech wanted in all.
        lead_in, lead_out: seconds of silence before the first and after the last word.
        engine: what speaks: a name, ``auto``, :data:`CORPUS` or ``none``.
        engine_voice: which of the engine's voices.
        style: of the movement.
        keys: an artist's, to be held.
        anticipation: seconds by which the face moves ahead of the sound.
        scene: what is shown.
        id: of the utterance; a system that plays recordings knows its own by it.
    """

    text: str = ""
    recording: Recording | None = None
    alignment: Alignment | None = None
    overrides: Mapping[str, str] | None = None
    durations: str = "corpus"
    speed: float = 1.0
    total: float | None = None
    lead_in: float = 0.25
    lead_out: float = 0.35
    engine: str = "auto"
    engine_voice: str | None = None
    style: Style = field(default_factory=Style)
    keys: tuple[Key, ...] = ()
    anticipation: float = 0.0
    scene: Scene = field(default_factory=Scene)
    id: str = "synthesis"

    @property
    def timed(self) -> bool:
        """Whether times are set that an engine has to keep to."""
        return self.alignment is not None or bool(self.total) or self.speed != 1 or self.durations == "model"

    @property
    def idle(self) -> tuple[str, ...]:
        """The settings of times that have no effect, because a recording or an alignment tells the times."""
        if self.recording is None and self.alignment is None:
            return ()
        asked = {"speed": self.speed != 1, "total": self.total is not None, "durations": self.durations == "model"}
        return tuple(name for name, given in asked.items() if given)

    @property
    def wordless(self) -> bool:
        """Whether a voice alone is given, of which nobody knows words or phones."""
        return self.recording is not None and self.alignment is None and not self.text.strip()

    @property
    def by_recordings(self) -> bool:
        """Whether the corpus's own recordings are to be heard."""
        return self.engine == CORPUS and self.recording is None
