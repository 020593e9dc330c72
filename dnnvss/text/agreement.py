"""Whether a text is what an alignment says."""

from collections.abc import Iterable
from difflib import SequenceMatcher
from typing import NamedTuple

from dnnvss.text.sentence import spoken_words

OTHER = 0.5
"""Share of words in common below which two texts are of different sentences."""

_UNKNOWN = {"<unk>", "spn", "<spn>", "unk", "[unk]", "[noise]", "<noise>", "[laughter]", "<laugh>"}


class Agreement(NamedTuple):
    """How well words agree with a text.

    Args:
        share: of the words in common, from 0 to 1.
        written, aligned: the first stretch in which they differ, empty where they do not.
    """

    share: float
    written: str = ""
    aligned: str = ""


def agreement(text: str, words: Iterable[str], variant: str = "en_us") -> Agreement:
    """How well the words of an alignment agree with a text, both as they are spoken.

    Args:
        text: as written; numbers and abbreviations count as the words that they are.
        words: labels of the tier of words; silences and words that an aligner did not know do not count.
        variant: of English.
    """
    labels = [w for w in words if w.strip() and w.strip().lower() not in _UNKNOWN]
    said, wanted = (_bare(words, variant) for words in (" ".join(labels), text))
    if not said or "".join(said) == "".join(wanted):
        return Agreement(1.0)
    matcher = SequenceMatcher(None, wanted, said, autojunk=False)
    first = next((a, b, c, d) for tag, a, b, c, d in matcher.get_opcodes() if tag != "equal")
    common = sum(block.size for block in matcher.get_matching_blocks())
    share = common / max(len(wanted), len(said))
    return Agreement(share, " ".join(wanted[first[0]: first[1]]), " ".join(said[first[2]: first[3]]))


def _bare(text: str, variant: str) -> list[str]:
    """The words that are spoken, those of a compound one by one, without apostrophes."""
    spoken = [word.replace("'", "") for word, _ in spoken_words(text, variant)]
    return [part for word in spoken for part in word.split("-") if part]
