"""What a page or another program may ask a run to say: the names and meanings are those of ``conf/synth.yaml``."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.face.base import Face
from dnnvss.settings import check_settings, setting
from dnnvss.speech.engines.choice import ENGINES
from dnnvss.style import Key, Style
from dnnvss.style.generation import Dials
from dnnvss.style.generator import StyleSettings, make_style
from dnnvss.synthesis.request import CORPUS, Recording, Scene, SpeakRequest
from dnnvss.timing import Alignment, FrameClock

LONGEST_TEXT = 20_000
"""Signs of a text; longer ones are for ``synth.py``."""


@dataclass(frozen=True, kw_only=True)
class KeyAsked:
    """A value that a curve is to take: see :class:`dnnvss.style.Key`."""

    time: float = setting(least=0, most=36_000, doc="seconds from the start")
    name: str = setting(doc="a curve: a gauge of the face such as aperture, or a coefficient")
    low: float | None = setting(None, doc="least value; none where null")
    high: float | None = setting(None, doc="largest value; none where null")
    end: float | None = setting(None, least=0, most=36_000, doc="seconds at which it lets go; one picture where null")
    softness: float = setting(0.0, least=0, doc="0 holds it; more gives way")
    phone: str | None = setting(None, doc="label of the phone that it moves with")
    index: int | None = setting(None, least=0, doc="which of the phones, counted from 0")
    position: float | None = setting(None, least=0, most=1, doc="0 at the phone's start, 1 at its end")

    def key(self) -> Key:
        """The key; a missing bound is none."""
        low, high = float("-inf") if self.low is None else self.low, float("inf") if self.high is None else self.high
        return Key(self.time, self.name, low, high, self.end, self.softness, self.phone, self.index, self.position)


@dataclass(frozen=True, kw_only=True)
class Change:
    """How something is said: what can change while the words, their times and the sound stay."""

    style: str = setting("articulated", doc="articulated, or plain for what the system says and nothing more")
    articulation: float | None = setting(None, least=0, most=5, doc="the dial: 1 the talker's own, above 1 stronger")
    closures: bool | None = setting(None, doc="lips close on p, b and m")
    contacts: bool | None = setting(None, doc="the lower lip reaches the teeth on f and v")
    rest: bool | None = setting(None, doc="silence pulls the face to rest")
    life: float | None = setting(None, least=0, most=1, doc="eyes, brows and head: 0 still, 1 as lively as the talker")
    seed: int | None = setting(None, least=0, doc="of the chance by which they move")
    anticipation: float = setting(0.0, least=-5000, most=5000, doc="milliseconds by which the face is ahead")
    keys: tuple[KeyAsked, ...] = setting((), doc="values that curves are to take")

    def __post_init__(self) -> None:
        check_settings(self, "")
        if len(self.keys) > 5000:
            raise DnnvssError("more than 5000 keys", remedy="Hold fewer of them")

    def styled(self, styles: Mapping[str, StyleSettings], face: Face) -> Style:
        """The style, with the dials that are set.

        Raises:
            DnnvssError: there is no style of that name.
        """
        if self.style not in styles:
            raise DnnvssError(f"there is no style {self.style[:40]!r}", remedy=f"Use one of {', '.join(styles)}")
        own = {f.name: value for f in fields(Dials) if (value := getattr(self, f.name, None)) is not None
               and f.name != "anticipation"}
        return replace(make_style(styles[self.style], face), **own)


@dataclass(frozen=True, kw_only=True)
class Saying(Change):
    """What is said, by whom and how."""

    run: str = setting(doc="name of the run, from GET /v1/runs")
    text: str = setting("", doc="the words; {W AY1 N D} gives phones; empty where a voice alone is followed")
    sound: str | None = setting(None, doc="a recording of the words, from POST /v1/sounds")
    alignment: Mapping[str, Any] | None = setting(None, doc="phone times: tier to edges in seconds and labels")
    pronunciations: Mapping[str, str] = setting({}, doc="word to phones, where the dictionary is wrong")
    engine: str = setting("auto", choices=("auto", *ENGINES, CORPUS, "none"), doc="whose voice; none for a silent face")
    speed: float = setting(1.0, least=0.25, most=4, doc="against the talker's")
    rate: str | None = setting(None, doc="pictures a second; the corpus's own where null")
    view: str = setting("face", doc="face, patch or mesh")

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.text) > LONGEST_TEXT:
            raise DnnvssError(f"the text has {len(self.text)} signs",
                              remedy=f"Say at most {LONGEST_TEXT}, or use dnnvss speak")

    def request(self, face: Face, styles: Mapping[str, StyleSettings], recording: Recording | None) -> SpeakRequest:
        """The request for :func:`dnnvss.synthesis.speak.speak`.

        Args:
            face: of the run.
            styles: by name.
            recording: the sound that is named.

        Raises:
            DnnvssError: values that mean nothing.
        """
        times = None if self.alignment is None else Alignment.from_json(self.alignment)
        clock = None if self.rate is None else FrameClock.from_setting(self.rate, "rate")
        return SpeakRequest(
            text=self.text, recording=recording, alignment=times, overrides=_lower(self.pronunciations) or None,
            speed=self.speed, engine=self.engine, style=self.styled(styles, face),
            keys=tuple(key.key() for key in self.keys), anticipation=self.anticipation / 1000,
            scene=Scene((self.view,), rate=clock))


def _lower(pronunciations: Mapping[str, str]) -> dict[str, str]:
    from dnnvss.text.lexicon import check_phones

    for word, phones in pronunciations.items():
        check_phones(phones, word)
    return {word.lower(): phones for word, phones in pronunciations.items()}
