"""Where the words of a text stand among the words that were heard."""

from collections.abc import Sequence

import numpy as np

OTHER, SKIP = 1.0, 0.75
"""Cost of a word heard for another one, and of a word that only one side has."""
_WHOLE = 4_000_000  # places of a table that is held as a whole


def matched(text: Sequence[int], heard: Sequence[int]) -> np.ndarray:
    """Which word of a text (n,) each heard word (m,) stands for, (m,) int64, rising; -1 where for none.

    The cheapest of all ways to make one sequence of the other; memory grows with their length, not with its
    square.

    **Source**: D. Hirschberg, "A linear space algorithm for computing maximal common subsequences",
    Communications of the ACM 18(6), 1975.
    """
    found = np.full(len(heard), -1, np.int64)
    waiting = [(0, len(text), 0, len(heard))]
    wanted, said = np.asarray(text, np.int64), np.asarray(heard, np.int64)
    while waiting:
        a, b, c, d = waiting.pop()
        if a == b or c == d:
            continue
        if (b - a + 1) * (d - c + 1) <= _WHOLE or d - c == 1:
            part = _whole(wanted[a:b], said[c:d])
            found[c:d] = np.where(part >= 0, part + a, -1)
            continue
        middle = (c + d) // 2
        ahead = _costs(wanted[a:b], said[c:middle])
        behind = _costs(wanted[a:b][::-1], said[middle:d][::-1])[::-1]
        split = a + int((ahead + behind).argmin())
        waiting += [(a, split, c, middle), (split, b, middle, d)]
    return found


def _row(above: np.ndarray, text: np.ndarray, word: int) -> np.ndarray:
    """The costs (n + 1,) to have heard one word more."""
    made = above + SKIP
    made[1:] = np.minimum(made[1:], above[:-1] + np.where(text == word, 0.0, OTHER))
    steps = SKIP * np.arange(len(made))
    return np.asarray(np.minimum.accumulate(made - steps) + steps)


def _costs(text: np.ndarray, heard: np.ndarray) -> np.ndarray:
    """The costs (n + 1,) to turn each beginning of the text into what was heard."""
    costs = SKIP * np.arange(len(text) + 1)
    for word in heard:
        costs = _row(costs, text, int(word))
    return costs


def _whole(text: np.ndarray, heard: np.ndarray) -> np.ndarray:
    """:func:`matched` by one table of all costs."""
    table = np.empty((len(heard) + 1, len(text) + 1))
    table[0] = SKIP * np.arange(len(text) + 1)
    for k, word in enumerate(heard, 1):
        table[k] = _row(table[k - 1], text, int(word))
    found = np.full(len(heard), -1, np.int64)
    k, n = len(heard), len(text)
    while k and n:
        step = 0.0 if text[n - 1] == heard[k - 1] else OTHER
        if np.isclose(table[k, n], table[k - 1, n - 1] + step):
            k, n = k - 1, n - 1
            found[k] = n
        elif np.isclose(table[k, n], table[k - 1, n] + SKIP):
            k -= 1
        else:
            n -= 1
    return found


def trusted(text: Sequence[int], heard: Sequence[int], places: np.ndarray, reach: int = 4) -> np.ndarray:
    """Which heard words (m,) bool lie where text and sound agree.

    Of the words around one, ``reach`` to either side, at least half must be the same as in the text, or of those to one
    side three quarters, and their places there must not lie far apart: single words that agree by chance do not count.
    """
    said, wanted = np.asarray(heard, np.int64), np.asarray(text, np.int64)
    same = places >= 0
    same[same] = wanted[places[same]] == said[same]
    good = np.zeros(len(said), bool)
    for k in np.flatnonzero(places >= 0):
        near = slice(max(int(k) - reach, 0), int(k) + reach + 1)
        close, middle = same[near] & (np.abs(places[near] - places[k]) <= 2 * reach), int(k) - near.start
        good[k] = any(side.sum() >= max(3, share * len(side)) for side, share in (
            (close, 0.5), (close[: middle + 1], 0.75), (close[middle:], 0.75)))
    return good if len(said) > 2 else same


def settled(places: np.ndarray, heard: Sequence[int], pauses: np.ndarray) -> np.ndarray:
    """The same matches (m,), with what the text does not have between the longest pauses.

    Where the words before such a stretch are also its last ones, or those behind it its first, or nearly so, it can as
    well lie a few words earlier or later: ``lay`` of *lay red* is not said before a sentence that is left out.

    Args:
        places: as :func:`matched` gives them.
        heard: the words (m,).
        pauses: (m + 1,) seconds of silence before each heard word, and behind the last.
    """
    found, start = places.copy(), 0
    while start < len(found):
        if found[start] >= 0:
            start += 1
            continue
        end = start
        while end < len(found) and found[end] < 0:
            end += 1
        shifts = _shifts(found, heard, start, end)
        best = max(shifts, key=lambda s: (np.minimum(pauses[[start + s, end + s]], _SILENT).sum() - WORTH * shifts[s],
                                          -abs(s)))
        kept = [int(k) for k in found[start + min(best, 0) : end + max(best, 0)] if k >= 0]
        found[start + min(best, 0) : end + max(best, 0)] = -1
        if best < 0:
            found[end + best : end] = kept
        elif best > 0:
            found[start : start + best] = kept
        start = end + max(best, 0)
    return found


_SILENT, WORTH = 1.0, 0.6
"""Seconds of a pause beyond which a longer one tells no more, and that are worth a word that was heard otherwise."""
_OTHERS = 2


def _shifts(places: np.ndarray, heard: Sequence[int], start: int, end: int) -> dict[int, int]:
    """By how many words a stretch that stands for nothing can be moved, and how many words would then be others."""
    found, others, k = {0: 0}, 0, 0
    while start - k > 0 and places[start - k - 1] >= 0 and others <= _OTHERS:
        others += heard[start - k - 1] != heard[end - k - 1]
        k += 1
        found[-k] = others
    others, k = 0, 0
    while end + k < len(heard) and places[end + k] >= 0 and others <= _OTHERS:
        others += heard[start + k] != heard[end + k]
        k += 1
        found[k] = others
    return found
