"""What other tools call a phone, a silence or a word, said in our labels."""

import re
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

from dnnvss.errors import DnnvssError
from dnnvss.phones import PHONES, SHORT_PAUSE, SILENCE, SILENCES, strip_stress
from dnnvss.phones.alphabets import single_sound
from dnnvss.timing import Segment, Tier

_LONG = {"sil", "<sil>", "silence", "h#", "#h", "pau", "<s>", "</s>", "sent-start", "sent-end", "!enter", "!exit",
         "silb", "sile"}
_SHORT = {"sp", "<sp>", "ssil", "#"}
_EMPTY = {"", "<eps>", "_", "-", "<p:>", "_:"}
_NOISES = {"br", "cg", "lg", "ls", "ns", "breath", "noise", "vocnoise", "cough", "laugh", "laughter", "##", "nsn"}
"""Breaths, coughs, laughter, smacks and noises of the Penn aligner and others, which are no speech."""
_WORD_PAUSES = (_LONG | _SHORT | _EMPTY) - {"silence"}  # a word of English too
_BRACKETS = re.compile(r"\[(.*)\]|<(.*)>|\{(.*)\}|\((.*)\)|\++([^+]*)\++")
"""What stands round the name of a pause or a noise: ``[SIL]``, ``{BR}``, ``<NOISE>``, ``++BREATH++``."""
PLACE = re.compile(r"_[BIES]$")
"""Where in its word a phone is, as Kaldi writes it."""
_FULL_CONTEXT = re.compile(r"-([^-+^@/]+)\+")
_HALF_CONTEXT = re.compile(r"([^-+]+)\+[^-+]+|[^-+]+-([^-+]+)")
"""HTK's phones at the edges of a word: before the next phone, or behind the one before."""
_ALIASES = {"AX": "AH", "AXR": "ER", "IX": "IH", "EL": "L", "EM": "M", "EN": "N", "DX": "T", "NX": "N", "HV": "HH",
            "UX": "UW", "AX-H": "AH", "ENG": "NG", "Q": "T", "EPI": "sp"}
_CLOSURES = {"bcl": ("B",), "dcl": ("D", "JH"), "gcl": ("G",), "pcl": ("P",), "tcl": ("T", "CH"), "kcl": ("K",)}
"""The closures of TIMIT, each with the stops that may follow it."""


class UnknownWordError(DnnvssError):
    """An alignment in which a word has no phones, since its aligner did not know it."""


def phone_of(label: str) -> str:
    """Return our label of a phone as other tools write it, or ``""`` for an interval without a name.

    Stress digits go, and so does Kaldi's place in the word; case does not matter, silences of HTK, TIMIT, Festival and
    the Montreal Forced Aligner are known,
    reduced vowels and syllabic consonants of TIMIT and Festival become their full phone, and from an HTS full-context
    label or an HTK triphone (``l-ow+d``, ``hh+ah``, ``l-ow``) the phone in the middle is taken.

    Raises:
        DnnvssError: the label is none of these.
    """
    middle = _FULL_CONTEXT.search(label)
    name = PLACE.sub("", (middle.group(1) if middle else label).strip())
    lower = name.lower()
    pause = lower if lower in _LONG | _SHORT | _EMPTY else _bracketed(lower) or lower
    if pause in _EMPTY:
        return ""
    if pause in _LONG | _NOISES:
        return SILENCE
    if pause in _SHORT:
        return SHORT_PAUSE
    phone = strip_stress(name.upper())
    phone = _CLOSURES[lower][0] if lower in _CLOSURES else _ALIASES.get(phone, phone)
    if phone in PHONES:
        return phone
    half = _HALF_CONTEXT.fullmatch(name)
    inner = (half[1] or half[2]) if half else name
    if half and _reads(lambda part: (phone_of(part),), inner):
        return phone_of(inner)
    if inner.lower() == "spn":
        raise UnknownWordError("phone 'spn' marks a word that the aligner did not know",
                               remedy="Add the word to the aligner's dictionary and align again")
    raise DnnvssError(f"unknown phone {label!r}",
                      remedy=f"Use the CMU phones, with or without stress: {' '.join(PHONES)}")


def is_pause(label: str) -> bool:
    """Whether a label of a phone is a name of silence or of a noise, or nothing."""
    lower = label.strip().lower()
    return lower in _EMPTY | _LONG | _SHORT | _NOISES or bool(_bracketed(lower))


def _bracketed(lower: str) -> str:
    """The name of a pause or a noise in brackets, without them; nothing of any other label."""
    match = _BRACKETS.fullmatch(lower)
    name = next(filter(None, match.groups()), "") if match else ""
    return name if name in _LONG | _SHORT | _NOISES else ""


def phones_of(labels: Iterable[str]) -> Callable[[str], tuple[str, ...]]:
    """What reads the labels of a tier: ARPAbet, or where some are none, the International Phonetic Alphabet or SAMPA.

    A sign may stand for two phones (\u026a\u0259). Where no alphabet has them all, the one that
    has most is taken: what reads it names the label.
    """
    known = {label.strip() for label in labels}

    def own(label: str) -> tuple[str, ...]:
        return (phone_of(label),)

    def other(alphabet: str) -> Callable[[str], tuple[str, ...]]:
        def read(label: str) -> tuple[str, ...]:
            if is_pause(label) or label.strip().lower() == "spn":
                return own(label)
            return single_sound(label.strip(), alphabet)

        return read

    readers = (own, other("ipa"), other("x-sampa"))
    return min(readers, key=lambda reader: sum(not _reads(reader, label) for label in known))


def _reads(reader: Callable[[str], tuple[str, ...]], label: str) -> bool:
    try:
        return bool(reader(label))
    except DnnvssError:
        return False


def word_of(label: str) -> str:
    """Return the word of a label; ``""`` for any name of a pause."""
    name = label.strip()
    lower = name.lower()
    return "" if lower in _WORD_PAUSES or _bracketed(lower) else name


def phone_tier(segments: list[Segment]) -> Tier:
    """Return the tier ``phones``: every label ours, neighbouring silences made one.

    An interval without a name is ``sil`` at either end and ``sp`` elsewhere.
    """
    read = phones_of(s.label for s in segments)
    segments = _released(segments)
    named = [part for s in segments for part in _parted(s, read(s.label))]
    last = len(named) - 1
    pauses = [SILENCE if i in (0, last) else SHORT_PAUSE for i in range(len(named))]
    named = [s if s.label else s._replace(label=pause) for s, pause in zip(named, pauses, strict=True)]
    return Tier("phones", _merged(named, SILENCES))


def _released(segments: list[Segment]) -> list[Segment]:
    """The segments, closures of TIMIT made one with the stop that they are of."""
    found: list[Segment] = []
    for segment in segments:
        before = found[-1].label.strip().lower() if found else ""
        if strip_stress(segment.label.strip().upper()) in _CLOSURES.get(before, ()) and segment.start == found[-1].end:
            segment = segment._replace(start=found.pop().start)
        found.append(segment)
    return found


def _parted(segment: Segment, phones: Sequence[str]) -> list[Segment]:
    """A segment as so many phones of one length."""
    step = (segment.end - segment.start) / len(phones)
    edges = [*(segment.start + k * step for k in range(len(phones))), segment.end]
    return [Segment(a, b, p) for (a, b), p in zip(pairwise(edges), phones, strict=True)]


def word_tier(segments: list[Segment]) -> Tier:
    """Return the tier ``words``: pauses are ``""``, neighbouring pauses made one."""
    return Tier("words", _merged([s._replace(label=word_of(s.label)) for s in segments], ("",)))


def _merged(segments: list[Segment], mergeable: tuple[str, ...]) -> list[Segment]:
    """Join neighbours that are both ``mergeable``; ``sil`` wins over ``sp``."""
    joined: list[Segment] = []
    for segment in segments:
        if joined and segment.label in mergeable and joined[-1].label in mergeable and segment.start == joined[-1].end:
            label = min(segment.label, joined[-1].label)  # "sil" comes before "sp"
            joined[-1] = Segment(joined[-1].start, segment.end, label)
        else:
            joined.append(segment)
    return joined
