"""An engine's phones and times onto the phones that we asked for."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.phones import SHORT_PAUSE, SILENCE, VOWELS, strip_stress
from dnnvss.text.sentence import Sentence
from dnnvss.timing import Alignment, Segment, Tier

_LEFT_OUT = 0.8
_WORST = 0.5  # cost a phone beyond which the engine has said something else
_SHORTEST = 0.005


def matched(sentence: Sentence, heard: Sequence[Segment], engine: str) -> Alignment:
    """Return the sentence's own phones and words on an engine's times.

    Phones are matched in order at the least cost (equal 0, both vowels or both consonants 0.5, else 1.5, left out or
    put in 0.8). A phone that the engine merged into its neighbour gets a share of it; one that it put in goes to the
    phone before it. Silence at the ends is ``sil``, silence between phones ``sp``.

    Args:
        sentence: what was asked for.
        heard: the engine's segments from 0 on; silences are labelled ``sil``, phones in our set without stress.
        engine: for the message.

    Raises:
        DnnvssError: the two rows of phones have too little in common.
    """
    wanted = [strip_stress(p) for w in sentence.words for p in w.phones]
    spoken = [s for s in heard if s.label != SILENCE]
    owner, cost = _aligned(wanted, [s.label for s in spoken])
    if not spoken or cost > _WORST * max(len(wanted), len(spoken)):
        said = " ".join(s.label for s in spoken)
        raise DnnvssError(f"the speech engine {engine} said {said!r} where {' '.join(wanted)!r} was asked for",
                          remedy="Choose another engine, e.g. speech.engine=formant")
    starts, ends = _times(owner, spoken, len(wanted))
    return _tiers(sentence, wanted, starts, ends, heard[0].start, heard[-1].end)


def _cost(a: str, b: str) -> float:
    if a == b:
        return 0.0
    return 0.5 if (a in VOWELS) == (b in VOWELS) else 1.5


def _aligned(wanted: Sequence[str], heard: Sequence[str]) -> tuple[list[int], float]:
    """Return for each heard phone the wanted one that owns it, and the total cost."""
    rows, columns = len(wanted) + 1, len(heard) + 1
    total = np.zeros((rows, columns))
    total[:, 0], total[0, :] = _LEFT_OUT * np.arange(rows), _LEFT_OUT * np.arange(columns)
    for i in range(1, rows):
        for j in range(1, columns):
            total[i, j] = min(total[i - 1, j - 1] + _cost(wanted[i - 1], heard[j - 1]),
                              total[i - 1, j] + _LEFT_OUT, total[i, j - 1] + _LEFT_OUT)
    owner, i, j = [0] * len(heard), len(wanted), len(heard)
    while j:
        if total[i, j] == total[i, j - 1] + _LEFT_OUT:
            j -= 1
            owner[j] = max(i - 1, 0)
        elif i and total[i, j] == total[i - 1, j - 1] + _cost(wanted[i - 1], heard[j - 1]):
            i, j = i - 1, j - 1
            owner[j] = i
        else:
            i -= 1
    return owner, float(total[-1, -1])


def _times(owner: Sequence[int], spoken: Sequence[Segment], count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return start and end (count,) of each wanted phone; those that own nothing share a neighbour's time equally."""
    starts, ends = np.full(count, np.nan), np.full(count, np.nan)
    for index, segment in zip(owner, spoken, strict=True):
        starts[index] = np.fmin(starts[index], segment.start)
        ends[index] = np.fmax(ends[index], segment.end)
    found = np.flatnonzero(~np.isnan(starts))
    groups = [(0 if k == 0 else int(a), int(b)) for k, (a, b) in enumerate(pairwise([*found, count]))]
    for first, last in groups:
        at = found[found >= first][0]
        edges = np.linspace(starts[at], ends[at], last - first + 1)
        starts[first:last], ends[first:last] = edges[:-1], edges[1:]
    return starts, ends


def _tiers(sentence: Sentence, wanted: Sequence[str], starts: np.ndarray, ends: np.ndarray, start: float,
           end: float) -> Alignment:
    phones: list[tuple[float, float, str]] = []
    place: list[int] = []
    for i, label in enumerate(wanted):
        at = phones[-1][1] if phones else start
        if starts[i] - at > _SHORTEST:
            phones.append((at, float(starts[i]), SHORT_PAUSE if phones else SILENCE))
            at = float(starts[i])
        place.append(len(phones))
        phones.append((at, max(float(ends[i]), at + _SHORTEST), label))
    if end - phones[-1][1] > _SHORTEST:
        phones.append((phones[-1][1], end, SILENCE))
    words: list[tuple[float, float, str]] = []
    first = 0
    for word in sentence.words:
        a, b = phones[place[first]][0], phones[place[first + len(word.phones) - 1]][1]
        at = words[-1][1] if words else start
        words += [(at, a, "")] if a > at else []
        words.append((a, b, word.spoken))
        first += len(word.phones)
    if phones[-1][1] > words[-1][1]:
        words.append((words[-1][1], phones[-1][1], ""))
    return Alignment([Tier("phones", phones), Tier("words", words)])
