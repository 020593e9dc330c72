"""Which utterances train, choose and test: taken from files where they are given, else drawn by a fixed rule."""

import hashlib
from collections import defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path

from dnnvss.corpus import SPLITS, check_apart, split_files
from dnnvss.errors import DnnvssError


def read_splits(folder: Path) -> dict[str, list[str]]:
    """Return the ids in each ``*.txt`` of a folder by the name of the file; nothing if there is no folder.

    Raises:
        DnnvssError: a file cannot be read, or train, val and test (of one variant) share utterances.
    """
    splits = split_files(folder)
    check_apart(splits, folder)
    return splits


def lacking(splits: Mapping[str, Sequence[str]], kept: Collection[str]) -> tuple[str, ...]:
    """Return which of train, val and test are not there or name no utterance that was kept."""
    return tuple(name for name in SPLITS if not any(i in kept for i in splits.get(name, ())))


def completed(splits: Mapping[str, Sequence[str]], kept: Collection[str], val: float, test: float,
              stratum: Callable[[str], str] = lambda i: "") -> dict[str, list[str]]:
    """Return the splits as given, and of train, val and test those drawn that name no utterance that was kept.

    They are drawn from the utterances that none of the others names, so that what is given stays as it is.

    Args:
        splits: ids by name of the split, as given.
        kept: ids of all utterances.
        val, test: shares of the utterances.
        stratum: what the drawn splits are to be even in.

    Raises:
        DnnvssError: too few utterances are left to draw from.
    """
    missing = lacking(splits, kept)
    given = {i for name in SPLITS if name not in missing for i in splits[name]}
    rest = [i for i in kept if i not in given]
    if given and len(rest) < len(missing):
        raise DnnvssError(f"too few utterances are left for {' and '.join(missing)}: the other splits name all but "
                          f"{len(rest)} of {len(kept)}", remedy="Give files of all of train, val and test, or none")
    drawn = draw(rest, val * len(kept) / len(rest), test * len(kept) / len(rest), stratum, missing) if missing else {}
    return {name: list(ids) for name, ids in splits.items()} | drawn


def draw(ids: Collection[str], val: float, test: float, stratum: Callable[[str], str] = lambda i: "",
         names: Collection[str] = SPLITS) -> dict[str, list[str]]:
    """Return train, val and test ids, or only some of them, spread evenly over strata, at least one id in each.

    The ids are taken stratum by stratum, in the order of a hash of the id; every ``1 / test``-th goes to the test split
    and likewise for val; train has the rest. The result depends on nothing but the ids.

    Args:
        ids: to draw from.
        val, test: shares of the ids.
        stratum: what the splits are to be even in.
        names: which of the splits are wanted.

    Raises:
        DnnvssError: fewer ids than splits.
    """
    if len(ids) < len(names):
        raise DnnvssError(f"{len(ids)} utterances cannot be split into train, val and test",
                          remedy="Give at least three")
    groups = defaultdict(list)
    for name in sorted(ids, key=lambda i: hashlib.sha256(i.encode()).digest()):
        groups[stratum(name)].append(name)
    rest = [name for key in sorted(groups) for name in groups[key]]
    total, taken = len(rest), {}
    for k, (name, share) in enumerate(wanted := [(n, s) for n, s in (("test", test), ("val", val)) if n in names]):
        spared = len(wanted) - 1 - k + ("train" in names)
        count = min(max(1, round(share * total)), len(rest) - spared)
        chosen = {int((j + 0.5) * len(rest) / count) for j in range(count)}
        taken[name] = sorted(rest[j] for j in chosen)
        rest = [i for j, i in enumerate(rest) if j not in chosen]
    return {name: sorted(rest) if name == "train" else taken[name] for name in SPLITS if name in names}
