"""The 57 articulatory questions, their answers, and the distance between phones that follows from them."""

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.phones.articulation import ARTICULATION, Articulation
from dnnvss.phones.inventory import PHONES, phone_id


@dataclass(frozen=True)
class Question:
    """A yes/no question about a phone.

    Args:
        name: column name.
        asks: the question in words, for the documentation.
        answer: the test of a phone's features.
        weight: its share in the distance between phones; what a viewer can see weighs most.
    """

    name: str
    asks: str
    answer: Callable[[Articulation], bool]
    weight: float = 1.0


_CORONAL = ("dental", "alveolar", "postalveolar")
_OBSTRUENT = ("stop", "fricative", "affricate")


def _is_consonant(a: Articulation) -> bool:
    return a.manner not in ("vowel", "silence")


def _is_sibilant(a: Articulation) -> bool:
    return a.manner in ("fricative", "affricate") and a.place in ("alveolar", "postalveolar")


def _manner(*manners: str) -> Callable[[Articulation], bool]:
    return lambda a: a.manner in manners


def _place(*places: str) -> Callable[[Articulation], bool]:
    return lambda a: _is_consonant(a) and a.place in places


def _vowel(**features: object) -> Callable[[Articulation], bool]:
    return lambda a: a.manner == "vowel" and all(getattr(a, name) == value for name, value in features.items())


def _voiced(manner: str, voiced: bool) -> Callable[[Articulation], bool]:
    return lambda a: a.manner == manner and a.voiced == voiced


QUESTIONS: tuple[Question, ...] = (
    # what a viewer sees
    Question("lip_closing", "Do the lips close?", lambda a: a.lips == "closed", 8),
    Question("labiodental", "Does the lower lip touch the upper teeth?", lambda a: a.lips == "tucked", 8),
    Question("lip_rounding", "Are the lips rounded or pushed out?", lambda a: a.lips == "rounded", 6),
    Question("lip_spreading", "Are the lips spread?", lambda a: a.lips == "spread", 3),
    Question("jaw_open", "Is the jaw wide open?", lambda a: a.opening >= 0.7, 3),
    Question("tongue_visible", "Is the tongue seen at the teeth?", lambda a: _place("dental")(a) or a.lateral, 2),
    # silence and the major classes
    Question("silence", "Is it a pause of any kind?", _manner("silence"), 20),
    Question("short_pause", "Is it a short pause?", lambda a: a.manner == "silence" and a.place == "short", 0.5),
    Question("vowel", "Is it a vowel?", _manner("vowel"), 0.5),
    Question("consonant", "Is it a consonant?", _is_consonant, 0.5),
    Question("voiced", "Is it voiced?", lambda a: a.voiced, 0.25),
    Question("unvoiced", "Is it an unvoiced sound?", lambda a: _is_consonant(a) and not a.voiced, 0.25),
    Question("sonorant", "Is it a vowel, nasal or approximant?", _manner("vowel", "nasal", "approximant"), 0.5),
    Question("obstruent", "Is it a stop, fricative or affricate?", _manner(*_OBSTRUENT), 0.5),
    Question("continuant", "Does air flow through the mouth?", _manner("vowel", "fricative", "approximant"), 0.5),
    # manner
    Question("stop", "Is it a stop?", _manner("stop"), 0.5),
    Question("nasal", "Is it a nasal?", _manner("nasal"), 0.5),
    Question("fricative", "Is it a fricative?", _manner("fricative"), 0.5),
    Question("affricate", "Is it an affricate?", _manner("affricate"), 0.5),
    Question("approximant", "Is it an approximant?", _manner("approximant"), 0.5),
    Question("liquid", "Is it a liquid?", lambda a: a.manner == "approximant" and (a.lateral or a.rhotic), 0.5),
    Question("glide", "Is it a glide?", lambda a: a.manner == "approximant" and not (a.lateral or a.rhotic), 0.5),
    Question("lateral", "Is it lateral?", lambda a: a.lateral, 1),
    Question("rhotic", "Has it an r-colour?", lambda a: a.rhotic, 1),
    Question("sibilant", "Is it a sibilant?", _is_sibilant, 1),
    Question("strident", "Is it a sibilant or labiodental?", lambda a: _is_sibilant(a) or a.lips == "tucked", 0.5),
    Question("voiced_consonant", "Is it a voiced consonant?", lambda a: _is_consonant(a) and a.voiced, 0.25),
    Question("voiced_stop", "Is it a voiced stop?", _voiced("stop", True), 0.1),
    Question("unvoiced_stop", "Is it an unvoiced stop?", _voiced("stop", False), 0.1),
    Question("voiced_fricative", "Is it a voiced fricative?", _voiced("fricative", True), 0.1),
    Question("unvoiced_fricative", "Is it an unvoiced fricative?", _voiced("fricative", False), 0.1),
    # place
    Question("bilabial", "Is it made with both lips?", _place("bilabial", "labiovelar"), 0.5),
    Question("labial", "Is it made with a lip?", _place("bilabial", "labiovelar", "labiodental"), 0.5),
    Question("dental", "Is it made at the teeth?", _place("dental"), 1),
    Question("alveolar", "Is it made at the tooth ridge?", _place("alveolar"), 1),
    Question("postalveolar", "Is it made behind the tooth ridge?", _place("postalveolar"), 1),
    Question("palatal", "Is it made at the palate?", _place("palatal"), 0.5),
    Question("velar", "Is it made at the soft palate?", _place("velar", "labiovelar"), 0.5),
    Question("glottal", "Is it made in the throat?", _place("glottal"), 0.5),
    Question("coronal", "Is it made with the blade of the tongue?", _place(*_CORONAL), 1),
    Question("anterior", "Is it made at the tooth ridge or before it?",
             _place("bilabial", "labiodental", "dental", "alveolar"), 0.5),
    # vowels
    Question("front_vowel", "Is it a front vowel?", _vowel(place="front"), 0.5),
    Question("central_vowel", "Is it a central vowel?", _vowel(place="central"), 0.5),
    Question("back_vowel", "Is it a back vowel?", _vowel(place="back"), 0.5),
    Question("high_vowel", "Is it a high vowel?", _vowel(height="high"), 1),
    Question("mid_vowel", "Is it a mid vowel?", _vowel(height="mid"), 0.5),
    Question("low_vowel", "Is it a low vowel?", _vowel(height="low"), 1),
    Question("rounded_vowel", "Is it a rounded vowel?", _vowel(lips="rounded"), 0.5),
    Question("unrounded_vowel", "Is it an unrounded vowel?",
             lambda a: a.manner == "vowel" and a.lips != "rounded", 0.5),
    Question("tense_vowel", "Is it a tense vowel?", _vowel(tense=True), 0.25),
    Question("lax_vowel", "Is it a lax vowel?", _vowel(tense=False), 0.25),
    Question("diphthong", "Is it a diphthong?", lambda a: bool(a.glide), 0.5),
    Question("fronting_diphthong", "Does it glide to the front?", _vowel(glide="front"), 1),
    Question("rounding_diphthong", "Does it glide to rounded lips?", _vowel(glide="rounded"), 1),
    Question("high_front_vowel", "Is it a high front vowel?", _vowel(height="high", place="front"), 0.25),
    Question("high_back_vowel", "Is it a high back vowel?", _vowel(height="high", place="back"), 0.25),
    Question("neutral_vowel", "Is it a mid central vowel?", _vowel(height="mid", place="central"), 0.25),
)
"""The questions in the order of their columns.

The paper uses 57 such questions from the HTS toolkit and does not print them (**Source**: Thangthai 2016, section 4.1).
This list is our own: it keeps their number and kind, and asks first what can be seen of a phone.
"""

ANSWERS: np.ndarray = np.array([[q.answer(ARTICULATION[p]) for q in QUESTIONS] for p in PHONES], dtype=np.uint8)
"""Binary table (41, 57): row is a phone's code, column a question. Every two phones differ, every two questions too."""
ANSWERS.flags.writeable = False

_WEIGHTS = np.array([q.weight for q in QUESTIONS])
DISTANCES: np.ndarray = (np.abs(ANSWERS[:, None].astype(float) - ANSWERS[None]) * _WEIGHTS).sum(-1)
"""Distance of every two phones (41, 41): the summed weights of the questions that they answer differently."""
DISTANCES.flags.writeable = False


def nearest(phone: str, known: Collection[str]) -> list[tuple[str, float]]:
    """Return the known phones with their distance from ``phone``, nearest first; a known phone is its own nearest.

    The distance is the summed weight of the questions that the two phones answer differently, so that a visible
    difference (closed, tucked, rounded or spread lips, an open jaw) counts for more than voicing or manner. Ties fall
    in the order of :data:`PHONES`.

    Raises:
        DnnvssError: no phone is known, or one of the labels is not one of the 41.
    """
    if not known:
        raise DnnvssError(f"no phone is known to stand in for {phone!r}", remedy="Give at least one known phone")
    row = DISTANCES[phone_id(phone)]
    codes = sorted({phone_id(p) for p in known}, key=lambda code: (row[code], code))
    return [(PHONES[code], float(row[code])) for code in codes]
