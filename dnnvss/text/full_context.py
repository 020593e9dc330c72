"""HTS full-context labels: each phone with its neighbours and its place in syllable, word, phrase and utterance.

**Source**: K. Tokuda, H. Zen, A. W. Black, "An HMM-based speech synthesis system applied to English", IEEE Speech
Synthesis Workshop 2002; fields and signs as in ``lab_format.pdf`` of the HTS demonstration for English.
"""

from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.phones import SHORT_PAUSE, SILENCE
from dnnvss.text.tree import LinguisticTree, linguistic_tree
from dnnvss.timing import Alignment

_UNIT = 10_000_000
_NAMES = {SILENCE: "pau", SHORT_PAUSE: "ssil"}
_NONE = "xx"


def write_full_context(path: str | Path, alignment: Alignment, text: str) -> Path:
    """Write ``start end label`` a phone, times in 100 ns, and return the path; ``read_lab`` reads the phones back.

    Args:
        path: the file, by custom ``.lab``.
        alignment: with tiers ``phones`` and ``words``.
        text: the words as written; its punctuation makes the phrases.
    """
    rows = zip(alignment["phones"], full_context(alignment, text), strict=True)
    return files.write_text(path, "".join(f"{round(s.start * _UNIT)} {round(s.end * _UNIT)} {x}\n" for s, x in rows))


def full_context(alignment: Alignment, text: str) -> list[str]:
    """Return the label of every segment of the tier ``phones``.

    ``sil`` is written ``pau``, ``sp`` ``ssil``, other phones in lower case. What does not apply in a pause is ``xx``,
    and so are accent, part of speech, content words and boundary tone, of which nothing is known.
    """
    tree = linguistic_tree(alignment, text)
    names = ["x", "x", *(_NAMES.get(p, p.lower()) for p in alignment["phones"].labels), "x", "x"]
    units = _Units(tree)
    return [f"{names[i]}^{names[i + 1]}-{names[i + 2]}+{names[i + 3]}={names[i + 4]}" + units.label(i, names[2:-2])
            for i in range(len(tree.word))]


class _Units:
    """Counts of every syllable, word and phrase, and of those around a segment."""

    def __init__(self, tree: LinguisticTree) -> None:
        self.tree = tree
        spoken = np.flatnonzero(tree.word >= 0)
        self.first = {int(s): int(i) for i, s in reversed(list(zip(spoken, tree.syllable[spoken], strict=True)))}
        self.of = {level: {int(u): int(i) for i, u in zip(spoken, getattr(tree, level)[spoken], strict=True)}
                   for level in ("syllable", "word", "phrase")}

    def label(self, i: int, names: list[str]) -> str:
        """Return the label of segment ``i`` from ``@`` on; ``names`` are all phones."""
        t, spoken = self.tree, bool(self.tree.word[i] >= 0)

        def both(position: np.ndarray, count: np.ndarray, sign: str) -> str:
            return f"{position[i] + 1}{sign}{count[i] - position[i]}" if spoken else f"{_NONE}{sign}{_NONE}"

        own = self._syllable(i if spoken else None)
        nuclei = np.flatnonzero(t.vowel & (t.syllable == t.syllable[i]) & spoken)
        vowel = names[nuclei[0]] if len(nuclei) else "x"
        before, after = (self._neighbour(i, "syllable", step) for step in (-1, 1))
        words = [self._count(self._neighbour(i, "word", step), t.syllables_in_word) for step in (-1, 1)]
        phrases = [self._phrase(self._neighbour(i, "phrase", step)) for step in (-1, 1)]
        here = self._phrase(i) if spoken else (_NONE, _NONE)
        number = f"{t.phrase[i] + 1}={t.phrases - t.phrase[i]}" if spoken else f"{_NONE}={_NONE}"
        return (
            f"@{both(t.phone_in_syllable, t.phones_in_syllable, '_')}"
            f"/A:{'_'.join(self._syllable(before))}"
            f"/B:{'-'.join(own)}@{both(t.syllable_in_word, t.syllables_in_word, '-')}"
            f"&{both(t.syllable_in_phrase, t.syllables_in_phrase, '-')}#{self._stressed(i) if spoken else 'xx-xx'}"
            f"$xx-xx!{self._distance(i) if spoken else 'xx-xx'};xx-xx|{vowel}"
            f"/C:{'+'.join(self._syllable(after))}/D:xx_{words[0]}"
            f"/E:xx+{t.syllables_in_word[i] if spoken else _NONE}@{both(t.word_in_phrase, t.words_in_phrase, '+')}"
            f"&xx+xx#xx+xx/F:xx_{words[1]}/G:{'_'.join(phrases[0])}/H:{'='.join(here)}^{number}|xx"
            f"/I:{'='.join(phrases[1])}/J:{t.syllables}+{t.words}-{t.phrases}"
        )

    def _neighbour(self, i: int, level: str, step: int) -> int | None:
        """Return a segment of the unit before or after the one of segment ``i``; from a pause, of the nearest."""
        units = getattr(self.tree, level)
        if units[i] >= 0:
            return self.of[level].get(int(units[i]) + step)
        near = np.flatnonzero(units[:i] >= 0)[-1:] if step < 0 else i + np.flatnonzero(units[i:] >= 0)[:1]
        return int(near[0]) if len(near) else None

    def _syllable(self, i: int | None) -> tuple[str, str, str]:
        """Return stress, accent and number of phones of the syllable of segment ``i``."""
        if i is None:
            return _NONE, _NONE, _NONE
        return str(int(self.tree.stress[i] > 0)), _NONE, str(self.tree.phones_in_syllable[i])

    def _count(self, i: int | None, counts: np.ndarray) -> str:
        return _NONE if i is None else str(counts[i])

    def _phrase(self, i: int | None) -> tuple[str, str]:
        return self._count(i, self.tree.syllables_in_phrase), self._count(i, self.tree.words_in_phrase)

    def _stresses(self, i: int) -> tuple[np.ndarray, int]:
        """Return which syllables of the phrase are stressed, and the place of the syllable of segment ``i``."""
        t = self.tree
        rows = sorted({int(s) for s in t.syllable[t.phrase == t.phrase[i]]})
        return np.array([t.stress[self.first[s]] > 0 for s in rows]), rows.index(int(t.syllable[i]))

    def _stressed(self, i: int) -> str:
        stressed, here = self._stresses(i)
        return f"{stressed[:here].sum()}-{stressed[here + 1 :].sum()}"

    def _distance(self, i: int) -> str:
        """Return the syllables to the stressed one before and after, 0 where the phrase has none there."""
        stressed, here = self._stresses(i)
        before, after = np.flatnonzero(stressed[:here]), np.flatnonzero(stressed[here + 1 :])
        return f"{here - before[-1] if len(before) else 0}-{after[0] + 1 if len(after) else 0}"
