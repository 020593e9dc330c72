"""The linguistic tree of an utterance: for each segment of its phones tier, where it stands on every level."""

from dataclasses import dataclass
from difflib import SequenceMatcher

import numpy as np

from dnnvss.phones import SILENCE, SILENCES, VOWELS, phone_id
from dnnvss.text.sentence import spoken_words, with_stress
from dnnvss.text.syllables import syllable_starts
from dnnvss.text.tokens import word_set
from dnnvss.timing import Alignment

LONGEST = 12
"""Most words of a phrase."""

_SHORTEST = 3  # words of a phrase that length alone makes
_MATCHED = 512  # words of text and tier that are looked at together; further apart they are not matched

_JOINING = word_set("and but or nor so because that which who when while if where after before although though unless "
                    "until as than to in on at by for with from of into over about")


@dataclass(frozen=True)
class LinguisticTree:
    """Indices, positions and counts over the N segments of the tier ``phones``; every array has shape (N,), int64.

    An index or position is counted from 0 and is -1 in silence; a count of what a level holds is 0 in silence. Words
    without phones of their own are left out, so indices have no holes.

    Args:
        syllable, word, phrase: index of the unit in the utterance.
        phone_in_syllable, phones_in_syllable: position of the phone in its syllable, and the syllable's phones.
        phone_in_word, phones_in_word: the same for the word.
        syllable_in_word, syllables_in_word: position of the syllable in its word, and the word's syllables.
        syllable_in_phrase, syllables_in_phrase: the same for the phrase.
        word_in_phrase, words_in_phrase: position of the word in its phrase, and the phrase's words.
        vowel: True for the nucleus of a syllable.
        stress: stress of the phone's syllable, 1 primary, 2 secondary, 0 none, -1 in silence. Tiers carry no stress: it
            is what the letters and the phones of the word make likely, weak words having none.
        phones, syllables, words, phrases: numbers of spoken phones, syllables, words and phrases of the utterance.
    """

    syllable: np.ndarray
    word: np.ndarray
    phrase: np.ndarray
    phone_in_syllable: np.ndarray
    phones_in_syllable: np.ndarray
    phone_in_word: np.ndarray
    phones_in_word: np.ndarray
    syllable_in_word: np.ndarray
    syllables_in_word: np.ndarray
    syllable_in_phrase: np.ndarray
    syllables_in_phrase: np.ndarray
    word_in_phrase: np.ndarray
    words_in_phrase: np.ndarray
    vowel: np.ndarray
    stress: np.ndarray
    phones: int
    syllables: int
    words: int
    phrases: int


def linguistic_tree(alignment: Alignment, text: str) -> LinguisticTree:
    """Return the tree of an utterance: a function of its alignment and text alone.

    Words come from the tier ``words`` (the label ``""`` is a pause), syllables from their phones by maximal onset.
    A phrase ends where a ``sil`` stands between words, and at a comma, semicolon, colon, full stop, dash or the like
    after a word of the text; words of text and tier are matched in order, and where they do not agree the punctuation
    is ignored. A phrase of more than :data:`LONGEST` words is cut near its middle, rather before a joining word.

    Args:
        alignment: with tiers ``phones`` (the 41 labels) and ``words``.
        text: the words as written; may be empty.

    Raises:
        DnnvssError: a tier is missing, or a label of ``phones`` is unknown.
    """
    labels = alignment["phones"].labels
    for label in labels:
        phone_id(label)
    spoken = np.array([label not in SILENCES for label in labels])
    owner = _owners(alignment, spoken)
    word = _renumbered(owner)
    syllable = _syllables(labels, word)
    phrase = _phrases(alignment, text, owner, word)
    stress = _stress(alignment, owner, word, syllable)
    return _counted(syllable, word, phrase, np.array([label in VOWELS for label in labels]), stress)


def phrase_ends(alignment: Alignment, text: str) -> np.ndarray:
    """Return for each segment of the tier ``phones`` whether punctuation of the text ends a phrase after its word (N,).

    Words of text and tier are matched in order, so that words that only one of them has (*a hundred and one* of *101*)
    change nothing elsewhere.
    """
    labels = alignment["phones"].labels
    owner = _owners(alignment, np.array([label not in SILENCES for label in labels]))
    return np.isin(owner, sorted(_punctuated(alignment["words"].labels, text)))


def _owners(alignment: Alignment, spoken: np.ndarray) -> np.ndarray:
    """Return for each phone the index (N,) of its segment in the words tier by its midpoint, -1 for silence.

    A spoken phone inside a pause belongs to the nearest word; where the tier has no word, to the pause itself.
    """
    phones, words = alignment["phones"], alignment["words"]
    middles = phones.middles
    named = np.array([i for i, label in enumerate(words.labels) if label.strip()] or range(len(words)))
    starts, ends = words.edges[:-1][named], words.edges[1:][named]
    last = np.searchsorted(starts, middles, side="right") - 1  # of those that have begun
    near = np.clip(last[:, None] + np.arange(-1, 2), 0, len(named) - 1)
    distance = np.maximum(np.maximum(starts[near] - middles[:, None], middles[:, None] - ends[near]), 0.0)
    nearest = near[np.arange(len(near)), distance.argmin(axis=1)]
    return np.where(spoken, named[nearest], -1)


def _renumbered(owner: np.ndarray) -> np.ndarray:
    """Return owners numbered 0, 1, 2... in order, -1 kept."""
    kept = np.unique(owner[owner >= 0])
    return np.where(owner >= 0, np.searchsorted(kept, owner), -1)


def _runs(unit: np.ndarray) -> list[np.ndarray]:
    """The phones of each unit (word or phrase), in order."""
    spoken = np.flatnonzero(unit >= 0)
    return np.split(spoken, np.flatnonzero(np.diff(unit[spoken])) + 1) if len(spoken) else []


def _syllables(labels: tuple[str, ...], word: np.ndarray) -> np.ndarray:
    """Return the index (N,) of each phone's syllable, -1 in silence."""
    begins, syllable = np.zeros(len(word), int), np.full(len(word), -1)
    for members in _runs(word):
        begins[members[syllable_starts([labels[i] for i in members])]] = 1
    spoken = word >= 0
    syllable[spoken] = np.cumsum(begins[spoken]) - 1
    return syllable


def _stress(alignment: Alignment, owner: np.ndarray, word: np.ndarray, syllable: np.ndarray) -> np.ndarray:
    """Return the stress (N,) of each phone's syllable."""
    labels, names, syllables = alignment["phones"].labels, alignment["words"].labels, syllable.tolist()
    stress = np.full(len(word), -1)
    for members in _runs(word):
        name = names[owner[members[0]]].strip().lower()
        stressed = with_stress(name, tuple(labels[i] for i in members))
        digits = {syllables[i]: int(p[-1]) for i, p in zip(members, stressed, strict=True) if p[-1].isdigit()}
        stress[members] = [digits.get(syllables[i], 0) for i in members]
    return stress


def _phrases(alignment: Alignment, text: str, owner: np.ndarray, word: np.ndarray) -> np.ndarray:
    """Return the index (N,) of each phone's phrase, -1 in silence."""
    ends = _punctuated(alignment["words"].labels, text)
    phrase, current, previous, silent = np.full(len(word), -1), 0, -1, False
    for i, label in enumerate(alignment["phones"].labels):
        if word[i] < 0:
            silent = silent or label == SILENCE
            continue
        if previous >= 0 and word[i] != word[previous] and (silent or owner[previous] in ends):
            current += 1
        phrase[i], previous, silent = current, i, False
    names = alignment["words"].labels
    first = {int(word[run[0]]): names[owner[run[0]]].strip().lower() for run in _runs(word)}
    cuts = [cut for run in _runs(phrase) for cut in _cuts(np.unique(word[run]).tolist(), first)]
    return np.where(phrase >= 0, phrase + np.searchsorted(cuts, word, side="right"), -1)


def _cuts(words: list[int], names: dict[int, str]) -> list[int]:
    """Return the words of a phrase before which it is cut, in order, so that no part is too long."""
    if len(words) <= LONGEST:
        return []
    middle = len(words) // 2  # a joining word counts for three places, so further away none can be the best
    places = range(max(_SHORTEST, middle - 4), min(len(words) - _SHORTEST, middle + 4) + 1)
    at = min(places, key=lambda k: abs(k - len(words) / 2) - 3 * (names[words[k]] in _JOINING))
    return [*_cuts(words[:at], names), words[at], *_cuts(words[at:], names)]


def _punctuated(labels: tuple[str, ...], text: str) -> set[int]:
    """Return the segments of the words tier after which the text has punctuation that ends a phrase."""
    tier = [(i, label.strip().lower()) for i, label in enumerate(labels) if label.strip()]
    written = spoken_words(text)
    pairs = _matched([w for _, w in tier], [w for w, _ in written])
    return {tier[a][0] for a, b in pairs if written[b][1]}


def _matched(tier: list[str], written: list[str]) -> list[tuple[int, int]]:
    """Positions of words that are the same in both, in order; a few hundred words of each are compared at a time."""
    a, b, half, pairs = 0, 0, _MATCHED // 2, []
    while a < len(tier) and b < len(written):
        ours, theirs = tier[a : a + _MATCHED], written[b : b + _MATCHED]
        found = _pairs(ours, theirs)
        step = (len(ours), len(theirs))
        if a + len(ours) < len(tier) or b + len(theirs) < len(written):  # words to come may change the second half
            found = [pair for pair in found if max(pair) < half]
            last = found[-1] if found else (0, 0)
            step = (last[0] + 1, last[1] + 1) if min(last) >= half // 2 else (half, half)
        pairs += [(a + i, b + j) for i, j in found]
        a, b = a + step[0], b + step[1]
    return pairs


def _pairs(ours: list[str], theirs: list[str]) -> list[tuple[int, int]]:
    """Positions of words that are the same in two rows, in order."""
    if ours == theirs:
        return [(i, i) for i in range(len(ours))]
    blocks = SequenceMatcher(None, ours, theirs, autojunk=False).get_matching_blocks()
    return [(a + k, b + k) for a, b, n in blocks for k in range(n)]


def _inside(unit: np.ndarray, outer: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the position of each ``unit`` in its ``outer`` unit and the outer unit's count, each (N,).

    Both are numbered in order, so an outer unit holds the units from that of its first phone to that of its last.
    """
    position, count = np.full(len(unit), -1), np.zeros(len(unit), int)
    spoken = outer >= 0
    inner, place = unit[spoken], outer[spoken]
    first = inner[np.searchsorted(place, place, side="left")]
    last = inner[np.searchsorted(place, place, side="right") - 1]
    position[spoken], count[spoken] = inner - first, last - first + 1
    return position, count


def _counted(syllable: np.ndarray, word: np.ndarray, phrase: np.ndarray, vowel: np.ndarray,
             stress: np.ndarray) -> LinguisticTree:
    spoken = word >= 0
    phone = np.where(spoken, np.cumsum(spoken) - 1, -1)
    phone_in_syllable, phones_in_syllable = _inside(phone, syllable)
    phone_in_word, phones_in_word = _inside(phone, word)
    syllable_in_word, syllables_in_word = _inside(syllable, word)
    syllable_in_phrase, syllables_in_phrase = _inside(syllable, phrase)
    word_in_phrase, words_in_phrase = _inside(word, phrase)
    return LinguisticTree(
        syllable, word, phrase, phone_in_syllable, phones_in_syllable, phone_in_word, phones_in_word,
        syllable_in_word, syllables_in_word, syllable_in_phrase, syllables_in_phrase, word_in_phrase, words_in_phrase,
        vowel, stress, int(spoken.sum()), int(syllable.max(initial=-1)) + 1, int(word.max(initial=-1)) + 1,
        int(phrase.max(initial=-1)) + 1,
    )  # fmt: skip
