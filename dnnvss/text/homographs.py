"""Words that are written alike and spoken differently: told apart by part of speech (HanTa) and by the words around."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files as package_files
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.phones import VOWELS
from dnnvss.text.derive import past, plural
from dnnvss.text.lexicon import dictionary
from dnnvss.text.tokens import word_set

Phones = tuple[str, ...]
Rules = tuple[tuple[str, Phones], ...]

_WINDOW = 6
_NEGATED = word_set("cannot can't couldn't won't wouldn't shouldn't don't doesn't didn't mustn't")
_ASKED = word_set("please let's")
_CLASSES = {"N": ("N",), "J": ("AJ", "AV")}


@dataclass(frozen=True)
class Reading:
    """The pronunciation chosen for a homograph, with stress, the rule that chose it, and what is doubtful."""

    phones: Phones
    rule: str
    doubt: str = ""


@lru_cache(maxsize=1)
def _table() -> dict[str, Rules]:
    text = (package_files("dnnvss.text") / "data" / "homographs.tsv").read_text(encoding="utf-8")
    found: dict[str, list[tuple[str, Phones]]] = {}
    for line in text.splitlines():
        if line and not line.startswith("# "):
            word, condition, phones = line.split("\t")
            found.setdefault(word, []).append((condition, tuple(phones.split())))
    return {word: tuple(rules) for word, rules in found.items()}


@lru_cache(maxsize=1024)
def rules_of(word: str) -> Rules:
    """Return the rules of a word or of the stem that it is inflected from; none for a word that is no homograph."""
    table = _table()
    if word in table:
        return table[word]
    for stem, ending in _stems(word):
        rules = table.get(stem, ())
        if len({phones for _, phones in rules}) < 2:
            continue
        if ending == "s":
            return tuple((condition, _weak(plural(phones))) for condition, phones in rules)
        verb = next((phones for condition, phones in rules if condition == "V"), None)
        if verb is None and word in dictionary():
            return ()
        verb = verb or next(p for c, p in rules if c.startswith("V") or c == "*")
        return (("*", _weak(past(verb)) if ending == "ed" else (*verb, "IH0", "NG")),)
    return ()


def _weak(phones: Phones) -> Phones:
    """Return phones in which a vowel without a digit, which an ending brought, is unstressed."""
    return tuple(p + "0" if p in VOWELS else p for p in phones)


def _stems(word: str) -> list[tuple[str, str]]:
    found = []
    for ending in ("s", "ed", "ing"):
        if word.endswith(ending) and len(word) > len(ending) + 2:
            stem = word[: -len(ending)]
            found.append((stem, ending))
            if ending != "s":
                found.append((stem + "e", ending))
            elif word.endswith("ies"):
                found.append((word[:-3] + "y", ending))
            elif word.endswith(("ses", "xes", "ches", "shes")):
                found.append((word[:-2], ending))
            if stem[-1] == stem[-2] and ending != "s":
                found.append((stem[:-1], ending))
    return found


@lru_cache(maxsize=1)
def _tagger() -> Any:
    try:
        from HanTa.HanoverTagger import HanoverTagger
    except ImportError as error:
        raise DnnvssError("the package HanTa, which tells parts of speech, is not installed",
                          remedy="Install it: pip install 'HanTa>=1.1.2'") from error
    return HanoverTagger("morphmodel_en.pgz")


def tags(words: Sequence[str]) -> list[str]:
    """Return the C5 part-of-speech tag of each word of a sentence; punctuation may stand among the words."""
    pieces: list[str] = []
    first: list[int] = []
    for word in words:
        first.append(len(pieces))
        short = re.fullmatch(r"(.+)(n't|'s|'ll|'re|'ve|'d|'m)", word)
        pieces += [short[1], short[2]] if short else [word]
    tagged = _tagger().tag_sent(pieces)
    return [tagged[i][2] for i in first]


def choose(words: Sequence[str], index: int, tag: Sequence[str], variant: str = "en_us") -> Reading | None:
    """Return the pronunciation of the word at ``index`` in its sentence, None if it is no homograph.

    Args:
        words: the words of the sentence in lower case, punctuation among them.
        index: which of them.
        tag: their tags, from :func:`tags`.
        variant: rows with the condition ``gb`` hold for ``en_gb`` only.
    """
    senses: set[Phones] = set()
    for condition, phones in rules_of(words[index]):
        held = {part: _holds(part, words, index, tag, variant) for part in condition.split("&")}
        if all(held.values()):
            doubt = "told by no word around it: the commonest was taken" if senses - {phones} else ""
            kinds = "+".join(part.partition("=")[0] for part in held if part != "*")
            return Reading(phones, f"{tag[index]}, {kinds or 'default'}", doubt if condition == "*" else "")
        if "near=" in condition and all(held[part] for part in held if not part.startswith("near=")):
            senses.add(phones)  # the same part of speech in another sense
    return None


def _holds(condition: str, words: Sequence[str], index: int, tag: Sequence[str], variant: str) -> bool:
    kind, _, argument = condition.partition("=")
    if condition == "gb":
        return variant == "en_gb"
    wanted = argument.split("/")
    if condition == "*":
        return True
    if kind == "near":
        around = [*words[max(index - _WINDOW, 0) : index], *words[index + 1 : index + 1 + _WINDOW]]
        return any(w.startswith(stem) if len(stem) > 3 else w == stem for w in around for stem in wanted)
    if kind in ("next", "prev"):
        at = index + (1 if kind == "next" else -1)
        return (words[at] if 0 <= at < len(words) else ".") in wanted
    if kind == "nextN":
        return index + 1 < len(words) and tag[index + 1].startswith(("NN", "NP", "AJ"))
    if kind == "V":
        return (tag[index].startswith("VV") and not _nominal(words, index, tag)) or _verbal(words, index, tag)
    return tag[index].startswith(_CLASSES.get(kind, (kind,)))


def _verbal(words: Sequence[str], index: int, tag: Sequence[str]) -> bool:
    """Return whether a word stands right after a modal or the *to* of an infinitive, where a verb does."""
    return index > 0 and (tag[index - 1] in ("VM0", "TO0") or words[index - 1] in _NEGATED | _ASKED)


def _nominal(words: Sequence[str], index: int, tag: Sequence[str]) -> bool:
    """Return whether a word stands right after an article or possessive, where no verb can, whatever its tag."""
    return index > 0 and (words[index - 1] in ("a", "an", "the", "every", "each") or tag[index - 1] == "DPS")
