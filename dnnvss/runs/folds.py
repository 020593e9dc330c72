"""Leaving some sentences out in turn: how a corpus is evaluated whose test split would be a sentence or two."""

import hashlib
from collections.abc import Sequence

from dnnvss.phones.contexts import spoken_seconds
from dnnvss.systems import Example

Examples = dict[str, list[Example]]
"""Of the splits ``train``, ``val`` and ``test``."""

FAIR = 8
"""Test sentences that are enough for a mean and its interval."""
LARGE = 10 * 60
"""Seconds of speech from which a corpus is evaluated on its test split in any case: fits are dear, test splits long."""
_FEW = 12


def fold_count(examples: Examples) -> int:
    """In how many parts the sentences of a corpus are left out in turn; 0 where its test split is fair.

    Up to twelve sentences are left out one by one (in ten parts at most), more of them in five parts.
    """
    sentences = [e for part in examples.values() for e in part]
    if len(examples["test"]) >= FAIR or speech(sentences) >= LARGE or len(sentences) < 3:
        return 0
    return min(len(sentences), 10) if len(sentences) <= _FEW else 5


def fewest_folds(sentences: int) -> int:
    """The fewest parts that leave a sentence to train on and another to validate on."""
    return 2 if sentences > 3 else 3


def folded(sentences: Sequence[Example], count: int) -> list[Examples]:
    """The examples of each part: ``test`` is what is left out, ``val`` a tenth of the others, ``train`` the rest.

    Args:
        sentences: all that are dealt out, by a hash of their ids.
        count: parts, at least :func:`fewest_folds`.
    """
    everything = shuffled(sentences)
    return [_fold(everything, k, count) for k in range(count)]


def shuffled(examples: Sequence[Example]) -> list[Example]:
    """The examples in the order of a hash of their ids."""
    return sorted(examples, key=lambda e: hashlib.sha256(e.id.encode()).digest())


def speech(examples: Sequence[Example]) -> float:
    """How many seconds are spoken in examples."""
    return spoken_seconds(e.alignment for e in examples)


def _fold(everything: list[Example], k: int, count: int) -> Examples:
    rest = [e for i, e in enumerate(everything) if i % count != k]
    held = max(1, len(rest) // 10)
    return {"train": rest[held:], "val": rest[:held], "test": everything[k::count]}
