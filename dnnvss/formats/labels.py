"""What other tools call a phone, a silence or a word, said in our labels."""

import re

from dnnvss.errors import DnnvssError
from dnnvss.phones import PHONES, SHORT_PAUSE, SILENCE, SILENCES, strip_stress
from dnnvss.timing import Segment, Tier

_LONG = {"sil", "<sil>", "silence", "h#", "#h", "pau", "<s>", "</s>", "sent-start", "sent-end", "!enter", "!exit"}
_SHORT = {"sp", "<sp>", "ssil", "#"}
_EMPTY = {"", "<eps>", "_", "-", "<p:>"}
_WORD_PAUSES = (_LONG | _SHORT | _EMPTY) - {"silence"}  # which is a word of English too
_FULL_CONTEXT = re.compile(r"-([^-+^@/]+)\+")
_ALIASES = {"AX": "AH", "AXR": "ER", "IX": "IH", "EL": "L", "EM": "M", "EN": "N", "DX": "T", "NX": "N", "HV": "HH",
            "UX": "UW", "AX-H": "AH", "ENG": "NG"}


def phone_of(label: str) -> str:
    """Return our label of a phone as other tools write it, or ``""`` for an interval without a name.

    Stress digits go, case does not matter, silences of HTK, TIMIT, Festival and the Montreal Forced Aligner are known,
    reduced vowels and syllabic consonants of TIMIT and Festival become their full phone, and from an HTS full-context
    label or an HTK triphone the phone in the middle is taken.

    Raises:
        DnnvssError: the label is none of these.
    """
    middle = _FULL_CONTEXT.search(label)
    name = (middle.group(1) if middle else label).strip()
    lower = name.lower()
    if lower in _EMPTY:
        return ""
    if lower in _LONG:
        return SILENCE
    if lower in _SHORT:
        return SHORT_PAUSE
    phone = strip_stress(name.upper())
    phone = _ALIASES.get(phone, phone)
    if phone in PHONES:
        return phone
    if lower == "spn":
        raise DnnvssError("phone 'spn' marks a word that the aligner did not know",
                          remedy="Add the word to the aligner's dictionary and align again")
    raise DnnvssError(f"unknown phone {label!r}",
                      remedy=f"Use the CMU phones, with or without stress: {' '.join(PHONES)}")


def word_of(label: str) -> str:
    """Return the word of a label; ``""`` for any name of a pause."""
    name = label.strip()
    return "" if name.lower() in _WORD_PAUSES else name


def phone_tier(segments: list[Segment]) -> Tier:
    """Return the tier ``phones``: every label ours, neighbouring silences made one.

    An interval without a name is ``sil`` at either end and ``sp`` elsewhere.
    """
    named = [s._replace(label=phone_of(s.label)) for s in segments]
    last = len(named) - 1
    pauses = [SILENCE if i in (0, last) else SHORT_PAUSE for i in range(len(named))]
    named = [s if s.label else s._replace(label=pause) for s, pause in zip(named, pauses, strict=True)]
    return Tier("phones", _merged(named, SILENCES))


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
