"""A small language model of one text, for a recogniser that is to hear where the text is said."""

from collections import Counter
from collections.abc import Sequence
from math import log10

DISCOUNT = 0.3
"""What is taken from each count for words that may follow otherwise."""
_RARE = 1e-9


def trigrams(words: Sequence[str]) -> str:
    """A model of words and of which two precede them, in the ARPA format.

    Absolute discounting: ``P(w | h) = (n(h w) - D + D N(h) P(w | h')) / n(h)``, where ``N(h)`` are the
    different words after ``h`` and ``h'`` is ``h`` without its first word. A sound may begin and
    end with any word.

    **Source**: H. Ney, U. Essen, R. Kneser, "On structuring probabilistic dependences in stochastic
    language modelling", Computer Speech and Language 8, 1994, section 3.

    Args:
        words: the text, at least one word, names without spaces.
    """
    ones, twos, threes = Counter(words), _grams(words, 2), _grams(words, 3)
    total = len(words) + len(ones) + 1
    single = {word: (count + 1) / total for word, count in ones.items()}
    after, kinds = _heads(twos)
    after2, kinds2 = _heads(threes)

    def double(first: str, second: str) -> float:
        return (max(twos[first, second] - DISCOUNT, 0) + DISCOUNT * kinds[first,] * single[second]) / after[first,]

    rows = [[f"-99 <s> {0:.4f}", f"{_log(1 / total):.4f} </s>"], [], []]
    for word in sorted(ones):
        back = DISCOUNT * kinds[word,] / after[word,] if after[word,] else 1.0
        rows[0].append(f"{_log(single[word]):.4f} {word} {_log(back):.4f}")
    for pair in sorted(twos):
        back = DISCOUNT * kinds2[pair] / after2[pair] if after2[pair] else 1.0
        rows[1].append(f"{_log(double(*pair)):.4f} {' '.join(pair)} {_log(back):.4f}")
    for three, count in sorted(threes.items()):
        pair = three[:2]
        own = (count - DISCOUNT + DISCOUNT * kinds2[pair] * double(*three[1:])) / after2[pair]
        rows[2].append(f"{_log(own):.4f} {' '.join(three)}")
    return _written(rows)


def _grams(words: Sequence[str], order: int) -> Counter[tuple[str, ...]]:
    return Counter(tuple(words[k : k + order]) for k in range(len(words) - order + 1))


def _heads(grams: Counter[tuple[str, ...]]) -> tuple[Counter[tuple[str, ...]], Counter[tuple[str, ...]]]:
    """How often each sequence but its last word is followed, and by how many different words."""
    counts, kinds = Counter[tuple[str, ...]](), Counter[tuple[str, ...]]()
    for gram, count in grams.items():
        counts[gram[:-1]] += count
        kinds[gram[:-1]] += 1
    return counts, kinds


def _log(probability: float) -> float:
    return log10(max(probability, _RARE))


def _written(rows: list[list[str]]) -> str:
    known = [(order, lines) for order, lines in enumerate(rows, 1) if lines]
    parts = ["\\data\\", *(f"ngram {order}={len(lines)}" for order, lines in known)]
    for order, lines in known:
        parts += ["", f"\\{order}-grams:", *lines]
    return "\n".join([*parts, "", "\\end\\", ""])
