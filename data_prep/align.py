"""Phone times of a recording: from the user's file, or by the aligner."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from data_prep.off_sound import APART, said_in, seconds_off, suspicious
from dnnvss.errors import DnnvssError
from dnnvss.formats import read_alignment, spanning
from dnnvss.formats.labels import UnknownWordError
from dnnvss.media import read_audio
from dnnvss.phones import SILENCES
from dnnvss.speech.align import UnfitError, align
from dnnvss.speech.align_doubt import Word, levels, without_rumble
from dnnvss.speech.align_edges import sharpened
from dnnvss.speech.align_onset import given_back
from dnnvss.speech.align_words import words_over
from dnnvss.text.agreement import OTHER, agreement
from dnnvss.text.lexicon import pronunciations
from dnnvss.text.sentence import spoken_words
from dnnvss.timing import Alignment, Tier


def heard(name: str, out: Path, audio: Path, words: list[tuple[str, list[tuple[str, ...]]]],
          bounds: list[tuple[float, float]], slack: float, frames: int, rate: str) -> dict[str, Any]:
    """Return the alignment that the aligner heard, as plain containers, with its scores.

    Its edges are the aligner's own: the talker's voice is learnt from them, or :func:`sharp` moves them. Words that do
    not fit the sound give ``{"dropped": message, "unfit": reason}``: the talker's voice may know better.

    Args:
        name: the utterance id.
        out: the prepared corpus; not used.
        audio: the sound.
        words: each word with its pronunciations.
        bounds: start and end of each word in seconds, or nothing where they are not known.
        slack: seconds around the bounds in which a word is looked for.
        frames, rate: of the video; the alignment ends where it ends.

    Raises:
        DnnvssError: there is no speech in this sound, or no word.
    """
    try:
        found = align(read_audio(audio), words, bounds or None, slack, sharp=False)
    except UnfitError as error:
        message = str(DnnvssError(error.problem, utterance=name, remedy=error.remedy))
        return {"dropped": message, "unfit": error.problem}
    except DnnvssError as error:
        raise DnnvssError(error.problem, utterance=name, remedy=error.remedy) from error
    whole = spanning(found.alignment, float(frames / Fraction(rate)))
    return {"alignment": whole.to_json(), "scores": [round(s, 2) for s in found.scores], "attempt": found.attempt,
            "late": lateness(whole, bounds)}


def sharp(name: str, out: Path, audio: Path, first: dict[str, Any],
          bounds: list[tuple[float, float]], limits: dict[str, float]) -> dict[str, Any]:
    """The result of :func:`heard` with its edges where the sound changes, and silence where no phone can last so long.

    Args:
        name, out: not used.
        audio: the sound.
        first: the result.
        bounds: start and end of each word in seconds, or nothing where they are not known.
        limits: seconds that a phone lasts behind a silence at most.
    """
    held = given_back(Alignment.from_json(first["alignment"]), limits)
    whole = sharpened(held, read_audio(audio))
    return first | {"alignment": whole.to_json(), "late": lateness(whole, bounds)}


def lateness(alignment: Alignment, bounds: Sequence[tuple[float, float]]) -> list[float]:
    """Return by how many seconds each word starts after its given time; nothing where no times are given."""
    starts = [s.start for s in alignment["words"] if s.label]
    return [round(a - b[0], 4) for a, b in zip(starts, bounds, strict=True)] if bounds else []


LOUDER = 6.0
"""Decibels by which what an alignment calls silence may be louder than what it calls speech; half of it is noted."""

_SHIFT = 0.03
"""Seconds from which it matters whether times count from the first sample or from the first picture."""


def given(name: str, out: Path, path: Path, words: list[tuple[str, list[tuple[str, ...]]]], frames: int,
          rate: str, late: float, text: str = "", variant: str = "en_us", audio: Path | None = None,
          starts: float = 0.0) -> dict[str, Any]:
    """The alignment in the user's file moved ``late`` seconds ahead, as plain containers, with notes.

    Where its words are of another sentence than the text, the sound decides: if the text fits it, the alignment is not
    taken (``{"other": what is to be noted}``); if its own words fit it, it is taken and the text is noted.

    Times that are far from where the aligner hears the words are not taken either, nor is an alignment without phones,
    or in which a word has none.

    Its times count from the first sample of the file's sound. Where that starts late, and speech is where the times
    say only if they count from the first picture, they do.

    Args:
        name, out: not used.
        path: the file.
        words: each word with its pronunciations.
        frames, rate: of the video.
        late: seconds by which the sound was moved.
        text, variant: what is said, compared with the words of the alignment.
        audio: the sound of the corpus, None where there is none.
        starts: seconds from the first picture to the first sample of the file's sound.

    Raises:
        DnnvssError: the file is damaged, has no phones, is of another sentence that does not fit the sound, as the text
            does not, or does not fit the recording.
    """
    try:
        found = read_alignment(path, name)
    except UnknownWordError:
        if audio is None:
            raise
        return {"other": "its alignment has a word that its aligner did not know (spn): the sound was aligned in its "
                "place"}
    if "phones" not in found:
        if audio is None:
            raise DnnvssError("has no tier of phones", file=path, utterance=name, remedy=_NAMED)
        return {"other": f"its alignment has no tier of phones ({', '.join(tier.name for tier in found.tiers)}): the "
                f"sound was aligned in its place. {_NAMED} if one of these is it"}
    try:
        sound = read_audio(audio) if audio is not None else None
        share, notes = _compared(found, text, variant)
        if share < OTHER:
            if sound is not None and said_in(sound, words) is not None:
                return {"other": f"its alignment is of another sentence ({_said(found)!r}): the sound was aligned to "
                                 "the text in its place"}
            own = [(w, pronunciations(w, variant)) for w, _ in spoken_words(_said(found, None), variant)]
            if sound is None or said_in(sound, own) is None:
                raise DnnvssError(f"its words are {_said(found)!r}, and the text is {text[:80]!r}", remedy=_OTHER)
            notes = [f"its text is not what is said, by its sound and its alignment ({_said(found)!r}): mend the text"]
        whole, more = _laid(found, float(frames / Fraction(rate)), late, starts, sound)
        if "words" not in whole:
            whole = whole.with_tier(words_over(whole["phones"], words))
        if sound is not None and (off := _off(whole, sound, words)) > APART:
            return {"other": f"the times of its alignment are {off:.2f} s off its sound: it was aligned in their place"}
    except DnnvssError as error:
        raise DnnvssError(error.problem, file=path, utterance=name, remedy=error.remedy) from error
    return {"alignment": whole.to_json(), "scores": [], "attempt": "given", "late": [], "notes": notes + more}


def _off(whole: Alignment, sound: np.ndarray, words: Sequence[Word]) -> float:
    """By how many seconds an alignment is off its sound, 0 where nothing speaks for that."""
    by_ear = said_in(sound, words) if suspicious(whole["phones"], sound) else None
    return 0.0 if by_ear is None else seconds_off(whole, by_ear)


_NAMED = "Name the tier phones"
_OTHER = "Give the alignment of this recording, or leave it out: the sound is aligned then"


def _said(found: Alignment, most: int | None = 80) -> str:
    """What the words of an alignment say, its first characters."""
    return " ".join(label for label in found["words"].labels if label)[:most]


def _compared(found: Alignment, text: str, variant: str) -> tuple[float, list[str]]:
    """The share of the words of an alignment that are those of the text, and what is to be noted of the others."""
    if "words" not in found or not text:
        return 1.0, []
    share, written, aligned = agreement(text, found["words"].labels, variant)
    return share, [f"its alignment says {aligned!r} where the text has {written!r}"] if share < 1 else []


def _laid(found: Alignment, seconds: float, late: float, starts: float, sound: np.ndarray | None
          ) -> tuple[Alignment, list[str]]:
    """An alignment over a recording of some seconds, and what is to be noted of it."""
    whole = _moved(spanning(found, seconds), late - starts)
    if sound is None:
        return whole, []
    clear, notes = contrast(whole["phones"], sound), list[str]()
    if abs(starts) > _SHIFT:
        other = _moved(spanning(found, seconds), late)
        if contrast(other["phones"], sound) > clear + 1:
            whole, clear = other, contrast(other["phones"], sound)
            notes = [f"its times count from the first picture, and its sound starts {starts:.2f} s after it"]
    if clear < -LOUDER:
        raise DnnvssError(f"what its alignment calls silence is {-clear:.0f} dB louder than what it calls speech",
                          remedy="Give the alignment of this recording, or leave it out: the sound is aligned then")
    if clear < -LOUDER / 2:
        notes.append(f"what its alignment calls silence is {-clear:.0f} dB louder than what it calls speech")
    return whole, notes


def contrast(phones: Tier, sound: np.ndarray) -> float:
    """Decibels between the middle level of speech and that of silence; 0 where there is little of either.

    What is lower than a voice does not count.

    Args:
        phones: the tier.
        sound: (n,) at 16 kHz.
    """
    level = levels(without_rumble(sound))
    at = (np.arange(len(level)) + 0.5) / 100
    edges = np.array([s.end for s in phones])
    labels = np.array([s.label not in SILENCES for s in phones])
    spoken = labels[np.minimum(np.searchsorted(edges, at, "right"), len(labels) - 1)]
    if min(spoken.sum(), (~spoken).sum()) < 20:
        return 0.0
    return float(np.median(level[spoken]) - np.median(level[~spoken]))


def _moved(alignment: Alignment, late: float) -> Alignment:
    """Return the alignment ``late`` seconds ahead, over the stretch of time that it spanned before."""
    return Alignment(tier.ahead(late) for tier in alignment.tiers) if late else alignment
