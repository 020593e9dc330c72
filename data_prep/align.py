"""Phone times of a recording: from the user's file, or by the aligner."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.formats import read_alignment, spanning
from dnnvss.media import read_audio
from dnnvss.speech.align import UnfitError, align
from dnnvss.speech.align_edges import sharpened
from dnnvss.speech.align_words import words_over
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
          bounds: list[tuple[float, float]]) -> dict[str, Any]:
    """Return the result of :func:`heard` with its edges where the sound changes; ``name`` and ``out`` are not used."""
    whole = sharpened(Alignment.from_json(first["alignment"]), read_audio(audio))
    return first | {"alignment": whole.to_json(), "late": lateness(whole, bounds)}


def lateness(alignment: Alignment, bounds: Sequence[tuple[float, float]]) -> list[float]:
    """Return by how many seconds each word starts after its given time; nothing where no times are given."""
    starts = [s.start for s in alignment["words"] if s.label]
    return [round(a - b[0], 4) for a, b in zip(starts, bounds, strict=True)] if bounds else []


def given(name: str, out: Path, path: Path, words: list[tuple[str, list[tuple[str, ...]]]], frames: int,
          rate: str, late: float) -> dict[str, Any]:
    """Return the alignment in the user's file moved ``late`` seconds ahead, as plain containers; ``out`` is not used.

    Raises:
        DnnvssError: the file is damaged, has no phones, or does not fit the recording.
    """
    found = read_alignment(path, name)
    if "phones" not in found:
        raise DnnvssError("has no tier of phones", file=path, utterance=name, remedy="Name the tier phones")
    try:
        whole = _moved(spanning(found, float(frames / Fraction(rate))), late)
    except DnnvssError as error:
        raise DnnvssError(error.problem, file=path, utterance=name, remedy=error.remedy) from error
    if "words" not in whole:
        whole = whole.with_tier(words_over(whole["phones"], words))
    return {"alignment": whole.to_json(), "scores": [], "attempt": "given", "late": []}


def _moved(alignment: Alignment, late: float) -> Alignment:
    """Return the alignment ``late`` seconds ahead, over the stretch of time that it spanned before."""
    start, end = alignment.start, alignment.end

    def moved(tier: Tier) -> Tier:
        rows = [s for s in tier.moved(-late) if start < s.end and s.start < end]
        edges = [start, *(s.start for s in rows[1:]), end]
        return Tier(tier.name, zip(edges[:-1], edges[1:], (s.label for s in rows), strict=True))

    return Alignment(moved(tier) for tier in alignment.tiers) if late else alignment
