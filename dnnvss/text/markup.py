"""Text with tags, as SSML and HTML have them: pieces of plain text, and how each is to be read.

**Source**: W3C, Speech Synthesis Markup Language 1.1, section 3.
"""

import html
import re
from dataclasses import dataclass, replace

from dnnvss.errors import DnnvssError
from dnnvss.phones.alphabets import arpabet
from dnnvss.text.tokens import word_set

_TAG = re.compile(
    r"<!--.*?-->|<\?[^>]*>|<![A-Za-z][^>]*>|<!\[CDATA\[(?P<data>.*?)\]\]>"
    r"|<(?P<end>/?)(?P<name>[A-Za-z][\w.:-]*)"
    r"(?P<attributes>(?:\s+[\w.:-]+\s*=\s*(?:\"[^\"]*\"|'[^']*'))*)\s*(?P<alone>/?)>", re.DOTALL)
_ATTRIBUTE = re.compile(r"([\w.:-]+)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')", re.DOTALL)
_ENTITY = re.compile(r"&(?:#\d{1,7}|#[xX][0-9a-fA-F]{1,6}|[A-Za-z]\w{1,30});")
_TIME = re.compile(r"\s*(\d{1,4}(?:\.\d+)?|\.\d+)\s*(ms|s)\s*", re.IGNORECASE)
_SILENT = word_set("speak b i u em strong span div html body small big font a mark w token voice lang prosody "
                   "emphasis say-as")
_PARTS = word_set("p s paragraph sentence br")
_STRONG = {"none": "", "x-weak": "", "weak": "minor", "medium": "major", "strong": "major", "x-strong": "major"}
_RATES = {"x-slow": 0.5, "slow": 0.75, "medium": 1.0, "default": 1.0, "fast": 1.25, "x-fast": 1.6}
_SPELT = word_set("characters character spell-out spell verbatim letters digits telephone")
_COUNTED = word_set("cardinal number")
_READ = _COUNTED | word_set("date time currency fraction unit address name measure text")
_UNHEARD = {"voice": "another voice", "lang": "another language"}
_ILL_WRITTEN = re.compile(rf"</?(?:{'|'.join(sorted(_SILENT - {'a', 'b', 'i', 'u', 'w'}))}|break|sub|phoneme)\b"
                          r"|<\s*/?\s*(?:speak|break|pause|silence|prosody|emphasis|say-as|phoneme|sub)\b[^<>]*>"
                          r"|<[a-z][\w:-]*\s+[\w:-]+\s*=[^<>]*>|<v[ .][^<>]*>|<\d\d:\d\d[^<>]*>", re.IGNORECASE)
"""What was meant for a tag."""
KNOWN = "break, emphasis, p, s, phoneme, prosody (rate), say-as, speak and sub"
"""Tags that change what is said or when."""


@dataclass(frozen=True)
class Reading:
    """How a piece of text is to be read.

    Args:
        emphasis: it is emphasised.
        rate: how fast, 1 as usual.
        spelt: sign by sign.
        ordinal: a number in it is a rank.
        counted: a number in it is no year.
        dates: order of day, month and year (``dmy``), empty where none is told.
        dated: it is a date.
        phones: how it is said, in ARPAbet; empty where that is not told.
        written: what stands in the text in its place, where that is something else.
        doubt: what was asked for and cannot be done.
    """

    emphasis: bool = False
    rate: float = 1.0
    spelt: bool = False
    ordinal: bool = False
    counted: bool = False
    dates: str = ""
    dated: bool = False
    phones: str = ""
    written: str = ""
    doubt: str = ""


PLAIN = Reading()
"""Text without tags."""


@dataclass(frozen=True)
class Piece:
    """A piece of a text.

    Args:
        text: without tags and entities; empty for a break.
        reading: how it is read.
        brk: the break that it is: ``none``, ``minor`` or ``major``.
        pause: seconds of a pause, None where none is asked for.
    """

    text: str
    reading: Reading = PLAIN
    brk: str = "none"
    pause: float | None = None


def pieces_of(text: str, lenient: bool = False) -> list[Piece]:
    """The pieces of a text, in order; a text without tags and entities is one.

    Args:
        text: as typed.
        lenient: pass over tags that are not understood.

    Raises:
        DnnvssError: a tag or an entity that is not understood, or a value of a tag; the message names it.
    """
    if not lenient and (unknown := next((m[0] for m in _ENTITY.finditer(text) if html.unescape(m[0]) == m[0]), "")):
        raise DnnvssError(f"the entity {unknown} is not known", remedy="Write the sign itself, or & as &amp;")
    if "<" not in text:
        return [Piece(_decoded(text))]
    reader = _Reader(lenient)
    at = 0
    while at < len(text):
        match = _TAG.search(text, at)
        if match is None:
            reader.say(_decoded(reader.checked(text[at:])))
            break
        reader.say(_decoded(reader.checked(text[at:match.start()])))
        at = reader.take(match, text)
    return reader.found


def _decoded(text: str) -> str:
    return _ENTITY.sub(lambda m: html.unescape(m[0]), text) if "&" in text else text


class _Reader:
    """Tags read one after the other; what is open is a stack."""

    def __init__(self, lenient: bool) -> None:
        self.lenient = lenient
        self.found: list[Piece] = []
        self._open: list[tuple[str, Reading]] = []

    @property
    def _reading(self) -> Reading:
        return self._open[-1][1] if self._open else Reading()

    def say(self, text: str, reading: Reading | None = None) -> None:
        """Add text; pieces read alike are one, so that a sentence may go on behind a tag."""
        reading = reading or self._reading
        last = self.found[-1] if self.found else None
        if last is not None and last.text and last.reading == reading and not reading.phones and not reading.written:
            self.found[-1] = replace(last, text=last.text + text)
        elif text:
            self.found.append(Piece(text, reading))

    def checked(self, text: str) -> str:
        """Text between tags; one that is written wrongly is no text."""
        if (wrong := _ILL_WRITTEN.search(text)) and not self.lenient:
            raise DnnvssError(f"the tag {text[wrong.start():][:40]!r} cannot be read",
                              remedy="Write tags as <break time=\"500ms\"/>, their values in quotes")
        return text

    def take(self, match: re.Match[str], text: str) -> int:
        """Read a tag; where the text goes on."""
        if match["data"] is not None:
            self.say(match["data"])
        if match["name"] is None:
            return match.end()
        name = match["name"].lower()
        if match["end"]:
            self._close(name)
            return match.end()
        values = {m[1].lower(): html.unescape(m[2] if m[2] is not None else m[3])
                  for m in _ATTRIBUTE.finditer(match["attributes"])}
        try:
            if name in ("sub", "phoneme"):
                return self._replaced(name, values, match, text)
            self._opened(name, values, bool(match["alone"]))
        except DnnvssError:
            if not self.lenient:
                raise
        return match.end()

    def _close(self, name: str) -> None:
        if name in _PARTS:
            self.found.append(Piece("", brk="major"))
        names = [n for n, _ in self._open]
        if name in names:
            del self._open[len(names) - 1 - names[::-1].index(name):]

    def _opened(self, name: str, values: dict[str, str], alone: bool) -> None:
        if name == "break":
            self.found.append(_break(values))
        elif name in _PARTS:
            self.found.append(Piece("", brk="major") if name != "br" else Piece("", brk="minor"))
        elif name in _SILENT:
            if not alone:
                self._open.append((name, _changed(self._reading, name, values)))
        else:
            raise DnnvssError(f"the tag <{name}> is not understood", remedy=f"Take it out; understood are {KNOWN}")

    def _replaced(self, name: str, values: dict[str, str], match: re.Match[str], text: str) -> int:
        """Read an element whose text is not what is said."""
        closing = re.compile(rf"</{name}\s*>", re.IGNORECASE).search(text, match.end())
        if match["alone"]:
            stop, written = match.end(), ""
        elif closing is None:
            raise DnnvssError(f"the tag <{name}> is not closed", remedy=f"Write </{name}> where it ends")
        else:
            stop, written = closing.end(), _decoded(_TAG.sub("", text[match.end():closing.start()])).strip()
        if name == "sub":
            said = values.get("alias", "").strip() or written
            self.say(said, replace(self._reading, written=written or said))
            return stop
        alphabet, phones = values.get("alphabet", "ipa").lower(), values.get("ph", "").strip()
        if phones:
            given, shown = " ".join(arpabet(phones, alphabet)), written or phones
            self.say(shown, replace(self._reading, phones=given, written=shown))
        else:
            self.say(written)
        return stop


def _changed(reading: Reading, name: str, values: dict[str, str]) -> Reading:
    """A reading within an element."""
    if name in ("em", "strong") or (name == "emphasis" and values.get("level", "moderate") in ("moderate", "strong")):
        return replace(reading, emphasis=True)
    if name == "w" and values.get("role"):
        return replace(reading, doubt="<w>: role is not heeded")
    if name in _UNHEARD:
        return replace(reading, doubt=f"<{name}>: {_UNHEARD[name]} is not taken")
    if name == "prosody":
        others = sorted(set(values) & {"pitch", "contour", "range", "volume", "duration"})
        rate = reading.rate * _rate(values.get("rate", "medium"))
        return replace(reading, rate=rate, doubt=f"prosody {others[0]} is not heeded" if others else reading.doubt)
    if name == "say-as":
        kind = values.get("interpret-as", "").lower()
        if kind.removeprefix("vxml:") in _COUNTED and values.get("format"):
            kind = values["format"].lower()  # <say-as interpret-as="number" format="ordinal">
        if kind.removeprefix("vxml:") in _SPELT:
            return replace(reading, spelt=True)
        if kind == "ordinal":
            return replace(reading, ordinal=True)
        if kind == "date":
            return replace(reading, dates=values.get("format", "").lower(), dated=True)
        if kind.removeprefix("vxml:") in _COUNTED:
            return replace(reading, counted=True)
        if kind.removeprefix("vxml:") not in _READ:
            raise DnnvssError(f"say-as interpret-as={kind!r} is not understood",
                              remedy=f"Use one of {', '.join(sorted((_SPELT | _READ | {'ordinal'}) - {'text'}))}")
    return reading


def _rate(value: str) -> float:
    """How fast: a name, a factor, a percentage, or one more or less (``+10%``)."""
    text = value.strip().lower()
    if text in _RATES:
        return _RATES[text]
    match = re.fullmatch(r"([+-]?)(\d{1,4}(?:\.\d+)?|\.\d+)(%?)", text)
    if match:
        number = float(match[2]) / (100 if match[3] else 1)
        rate = 1 + number if match[1] == "+" else 1 - number if match[1] == "-" else number
        if 0.2 <= rate <= 5:
            return rate
    raise DnnvssError(f"prosody rate={value!r} is not understood",
                      remedy=f"Use {', '.join(_RATES)}, or a percentage such as 80% or +10%")


def _break(values: dict[str, str]) -> Piece:
    """A pause: of so many seconds, or as strong as is told."""
    if "time" in values:
        match = _TIME.fullmatch(values["time"])
        if match is None:
            raise DnnvssError(f"break time={values['time']!r} is no time", remedy="Write it as 500ms or 1.5s")
        return Piece("", brk="major", pause=float(match[1]) / (1000 if match[2].lower() == "ms" else 1))
    strength = values.get("strength", "medium").lower()
    if strength not in _STRONG:
        raise DnnvssError(f"break strength={strength!r} is not understood", remedy=f"Use {', '.join(_STRONG)}")
    return Piece("", brk=_STRONG[strength] or "none", pause=1.0 if strength == "x-strong" else None)
