"""Letters to phones by the recurrent network that ships in the g2p-en wheel, run without importing that package.

Importing g2p-en would try to download taggers; its weights need nothing but numpy. The network is a GRU encoder that
reads the letters and a GRU decoder that spells the phones; its vowels carry stress.
"""

from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from dnnvss.archives import read_arrays
from dnnvss.errors import DnnvssError
from dnnvss.phones.inventory import CONSONANTS, VOWELS

_REMEDY = "Install the package again: pip install 'g2p-en>=2.1'"
_LETTERS = {letter: index for index, letter in enumerate("abcdefghijklmnopqrstuvwxyz", start=3)}
_UNKNOWN_LETTER, _END_OF_WORD, _START, _STOP = 1, 2, 2, 3


def _symbols() -> tuple[str, ...]:
    """Return the decoder's 74 symbols: four markers, then phones and stressed vowels in alphabetical order."""
    stressed = {f"{vowel}{stress}" for vowel in VOWELS for stress in "012"}
    return ("", "", "", "", *sorted(stressed | set(CONSONANTS) | {"UW"}))


SYMBOLS = _symbols()
_CODES = {symbol: code for code, symbol in enumerate(SYMBOLS) if symbol}


@lru_cache(maxsize=1)
def _weights() -> dict[str, np.ndarray]:
    spec = find_spec("g2p_en")
    if spec is None or not spec.submodule_search_locations:
        raise DnnvssError("the package g2p-en, which pronounces unknown words, is not installed", remedy=_REMEDY)
    return read_arrays(Path(spec.submodule_search_locations[0]) / "checkpoint20.npz", _REMEDY)


def _step(side: str, x: np.ndarray, h: np.ndarray) -> np.ndarray:
    """Return the next hidden state (256,) of the ``enc`` or ``dec`` GRU for the input row ``x`` (256,)."""
    w = _weights()
    from_input = w[f"{side}_w_ih"] @ x + w[f"{side}_b_ih"]
    from_state = w[f"{side}_w_hh"] @ h + w[f"{side}_b_hh"]
    n = len(h)
    reset, update = np.split(1 / (1 + np.exp(-(from_input[: 2 * n] + from_state[: 2 * n]))), 2)
    return (1 - update) * np.tanh(from_input[2 * n :] + reset * from_state[2 * n :]) + update * h


def _encoded(word: str) -> np.ndarray:
    """Return the encoder's last state (256,) after the letters of a word."""
    table = _weights()["enc_emb"]
    h = np.zeros(table.shape[1], table.dtype)
    for code in [*(_LETTERS.get(letter, _UNKNOWN_LETTER) for letter in word.lower()), _END_OF_WORD]:
        h = _step("enc", table[code], h)
    return h


def _decoded(h: np.ndarray, previous: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the decoder's next state (256,) and log-probabilities of the symbols (74,)."""
    w = _weights()
    h = _step("dec", w["dec_emb"][previous], h)
    logits = w["fc_w"] @ h + w["fc_b"]
    logits = logits - logits.max()
    return h, logits - np.log(np.exp(logits).sum())


@lru_cache(maxsize=4096)
def spell(word: str, beam: int = 4) -> tuple[tuple[str, ...], float]:
    """Return the likeliest phones of a word, with stress digits, and their mean log-probability a symbol.

    Args:
        word: letters; others than a to z are read as an unknown letter.
        beam: number of partial spellings kept.
    """
    alive: list[tuple[float, tuple[int, ...], np.ndarray]] = [(0.0, (_START,), _encoded(word))]
    finished: list[tuple[float, tuple[int, ...]]] = []
    for _ in range(2 * len(word) + 4):
        grown = []
        for score, codes, h in alive:
            h, log_p = _decoded(h, codes[-1])
            grown += [(score + float(log_p[c]), (*codes, int(c)), h) for c in np.argsort(-log_p)[: beam + 1]]
        grown.sort(key=lambda entry: -entry[0] / len(entry[1]))
        finished += [(score / (len(codes) - 1), codes[1:-1]) for score, codes, _ in grown[:beam] if codes[-1] == _STOP]
        alive = [entry for entry in grown if entry[1][-1] > _STOP][:beam]
        if not alive or len(finished) >= beam:
            break
    if not finished:
        finished = [(score / (len(codes) - 1), codes[1:]) for score, codes, _ in alive]
    score, best = max(finished, key=lambda entry: entry[0], default=(-np.inf, ()))
    return tuple("UW1" if SYMBOLS[c] == "UW" else SYMBOLS[c] for c in best), float(score)


@lru_cache(maxsize=4096)
def likelihood(word: str, phones: tuple[str, ...]) -> float:
    """Return the mean log-probability a symbol with which the network spells given phones, to compare with `spell`'s.

    Args:
        word: the letters.
        phones: phones without stress digits; each vowel has its likeliest.
    """
    h, previous, total = _encoded(word), _START, 0.0
    for phone in phones:
        h, log_p = _decoded(h, previous)
        codes = [_CODES[phone + d] for d in ("0", "1", "2")] if phone in VOWELS else [_CODES[phone]]
        previous = max(codes, key=lambda code: log_p[code])
        total += float(log_p[previous])
    return (total + float(_decoded(h, previous)[1][_STOP])) / (len(phones) + 1)


@lru_cache(maxsize=4096)
def stress(word: str, phones: tuple[str, ...]) -> tuple[str, ...]:
    """Return ``phones`` with a stress digit on each vowel, exactly one of them primary (none in a word without vowel).

    The lexicon that is installed has no stress. The decoder is made to spell the given phones, and at each vowel its
    likeliest digit is taken; the vowel with the best odds for primary stress gets it.

    Args:
        word: the letters.
        phones: phones without digits (digits that are there are replaced).
    """
    bare = [phone.rstrip("012") for phone in phones]
    vowels = [i for i, phone in enumerate(bare) if phone in VOWELS]
    if len(vowels) < 2:
        return tuple(f"{phone}1" if phone in VOWELS else phone for phone in bare)
    h, previous, odds, digits = _encoded(word), _START, {}, {}
    for i, phone in enumerate(bare):
        h, log_p = _decoded(h, previous)
        if phone in VOWELS:
            none, primary, secondary = (float(log_p[_CODES[f"{phone}{d}"]]) for d in "012")
            odds[i] = primary - max(none, secondary)
            digits[i] = "2" if secondary > none else "0"
            previous = _CODES[phone + ("1" if odds[i] > 0 else digits[i])]
        else:
            previous = _CODES[phone]
    digits[max(odds, key=lambda i: odds[i])] = "1"
    return tuple(phone + digits.get(i, "") for i, phone in enumerate(bare))
