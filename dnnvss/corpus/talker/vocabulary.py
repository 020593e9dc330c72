"""The talker's words: how each is spoken and where the grammar may use it."""

from collections import defaultdict
from functools import cache
from pathlib import Path

_TABLE = Path(__file__).with_name("vocabulary.tsv")


@cache
def _rows() -> list[tuple[str, tuple[str, ...], tuple[str, ...]]]:
    lines = _TABLE.read_text(encoding="utf-8").splitlines()
    cells = [line.split("\t") for line in lines if line and not line.startswith("#")]
    return [(word, tuple(classes.split(",")), tuple(phones.split())) for word, classes, phones in cells]


@cache
def spoken_forms() -> dict[str, tuple[str, ...]]:
    """Return every word of the talker with its phones, stress digits kept: ``{"boat": ("B", "OW1", "T")}``."""
    return {word: phones for word, _, phones in _rows()}


@cache
def word_classes() -> dict[str, tuple[str, ...]]:
    """Return the words of each class that the grammar draws from: ``{"place": ("beach", "bridge", ...)}``."""
    classes: dict[str, list[str]] = defaultdict(list)
    for word, names, _ in _rows():
        for name in names:
            classes[name].append(word)
    return {name: tuple(words) for name, words in classes.items() if name != "-"}
