"""Which utterances train, choose and test: taken from files where they are given, else drawn by a fixed rule."""

import hashlib
from collections import defaultdict
from collections.abc import Callable, Collection
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError

NAMES = ("train", "val", "test")


def read_splits(folder: Path) -> dict[str, list[str]]:
    """Return the ids in each ``*.txt`` of a folder by the name of the file; nothing if there is no folder."""
    return {p.stem: files.read(p, lambda q: q.read_text("utf-8").split(), "Give one id a line")
            for p in sorted(folder.glob("*.txt"))}


def usable(splits: dict[str, list[str]], kept: Collection[str]) -> bool:
    """True if train, val and test are all there and each names at least one utterance that was kept."""
    return all(any(i in kept for i in splits.get(name, [])) for name in NAMES)


def draw(
    ids: Collection[str], val: float, test: float, stratum: Callable[[str], str] = lambda i: ""
) -> dict[str, list[str]]:
    """Return train, val and test ids, spread evenly over strata, at least one id in each.

    The ids are taken stratum by stratum, in the order of a hash of the id; every ``1 / test``-th goes to the test split
    and likewise for val. The result depends on nothing but the ids.

    Raises:
        DnnvssError: fewer than three ids.
    """
    if len(ids) < 3:
        raise DnnvssError(f"{len(ids)} utterances cannot be split into train, val and test",
                          remedy="Give at least three")
    groups = defaultdict(list)
    for name in sorted(ids, key=lambda i: hashlib.sha256(i.encode()).digest()):
        groups[stratum(name)].append(name)
    ordered = [name for key in sorted(groups) for name in groups[key]]
    count = {"test": max(1, round(test * len(ordered))), "val": max(1, round(val * len(ordered)))}
    taken: dict[str, list[str]] = {}
    rest = ordered
    for name in ("test", "val"):
        chosen = {int((k + 0.5) * len(rest) / count[name]) for k in range(count[name])}
        taken[name] = sorted(rest[k] for k in chosen)
        rest = [i for k, i in enumerate(rest) if k not in chosen]
    return {"train": sorted(rest), "val": taken["val"], "test": taken["test"]}
