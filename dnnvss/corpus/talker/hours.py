"""The sentences of a motion-capture session: the time of day, from the grammar of its paper.

**Source**: Edge et al. 2004, "Animating visible speech by concatenating motion fragments", section 4: its grammar in
Backus-Naur form. Its examples leave exactness or minutes out, so either may be absent.
"""

from collections.abc import Sequence

import numpy as np

PROLOG = "the time is now"
EXACTNESS = ("exactly", "just after", "a little after", "almost")
MINUTES = (
    "five past",
    "ten past",
    "quarter past",
    "twenty past",
    "twenty-five past",
    "half past",
    "twenty-five to",
    "twenty to",
    "quarter to",
    "ten to",
    "five to",
)
HOURS = (
    "one",
    "two",
    "three",
    "four",
    "five",
    "six",
    "seven",
    "eight",
    "nine",
    "ten",
    "eleven",
    "twelve",
)
DAY_INFO = ("in the morning", "in the afternoon", "am", "pm")

SPOKEN_FORMS: dict[str, tuple[str, ...]] = {
    word: tuple(phones.split())
    for word, phones in {
        "the": "DH AH0",
        "time": "T AY1 M",
        "is": "IH1 Z",
        "now": "N AW1",
        "exactly": "IH0 G Z AE1 K T L IY0",
        "just": "JH AH1 S T",
        "after": "AE1 F T ER0",
        "a": "AH0",
        "little": "L IH1 T AH0 L",
        "almost": "AO1 L M OW2 S T",
        "five": "F AY1 V",
        "past": "P AE1 S T",
        "ten": "T EH1 N",
        "quarter": "K W AO1 R T ER0",
        "twenty": "T W EH1 N T IY0",
        "half": "HH AE1 F",
        "to": "T UW1",
        "one": "W AH1 N",
        "two": "T UW1",
        "three": "TH R IY1",
        "four": "F AO1 R",
        "six": "S IH1 K S",
        "seven": "S EH1 V AH0 N",
        "eight": "EY1 T",
        "nine": "N AY1 N",
        "eleven": "IH0 L EH1 V AH0 N",
        "twelve": "T W EH1 L V",
        "in": "IH1 N",
        "morning": "M AO1 R N IH0 NG",
        "afternoon": "AE2 F T ER0 N UW1 N",
        "am": "EY1 EH1 M",
        "pm": "P IY1 EH1 M",
    }.items()
}
"""Every word of the grammar with its phones."""


def times_of_day(count: int, seed: int = 0, without: Sequence[str] = ()) -> list[str]:
    """``count`` different sentences of the grammar, drawn at random; the same for the same seed.

    Args:
        count: how many; the grammar has 12 hours, 11 minutes and none, 4 kinds of exactness and none, 4 times of day.
        seed: of the draw.
        without: sentences that are not to be among them.
    """
    random = np.random.default_rng([seed, 7])
    found: dict[str, None] = {}
    while len(found) < count:
        parts = [
            _one(random, EXACTNESS, 0.25),
            _one(random, MINUTES, 0.15),
            _one(random, HOURS, 0.0),
        ]
        info = " ".join(part for part in parts if part)
        text = f"{PROLOG.capitalize()}, {info}, {_one(random, DAY_INFO, 0.0)}."
        if text not in without:
            found[text] = None
    return list(found)


def _one(random: np.random.Generator, options: Sequence[str], absent: float) -> str:
    return "" if random.random() < absent else options[int(random.integers(len(options)))]
