"""Which utterances train, choose and test: taken from files where they are given, else drawn by a fixed rule."""

import hashlib
import re
import unicodedata
from collections import defaultdict
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path, PurePosixPath

from dnnvss import files
from dnnvss.corpus import SPLITS, check_apart, split_files
from dnnvss.errors import DnnvssError


def given_splits(raw: Path) -> dict[str, list[str]]:
    """The ids in the splits that lie with recordings, in a folder ``splits`` there (``Splits``, ``split``).

    Raises:
        DnnvssError: as :func:`read_splits` does; lists of recordings that lie beside these and not in that folder.
    """
    inside = sorted(raw.iterdir())
    folders = [p for p in inside if p.is_dir() and p.name.casefold() in _FOLDERS]
    if folders:
        return read_splits(next((p for p in folders if p.name == _FOLDERS[0]), folders[0]))
    stems = [p.stem for p in inside]
    near = {_bare(p.name): p.stem for p in inside}
    for path in (p for p in inside if p.suffix.lower() == ".txt" and _role(p.stem) and stems.count(p.stem) == 1):
        lines = files.read_text(path, "Give one id a line").splitlines()
        if any(_named(line.strip(), near) for line in lines if line.strip()):
            raise DnnvssError("is a list of recordings, and lies beside them", file=path,
                              remedy=f"Put it into a folder {_FOLDERS[0]} there")
    return {}


_FOLDERS = ("splits", "split")
"""What the folder of splits is called, the usual name first."""


def read_splits(folder: Path) -> dict[str, list[str]]:
    """Return the ids in each ``*.txt`` of a folder by the name of the file; nothing if there is no folder.

    Raises:
        DnnvssError: a file cannot be read or is no list of ids, or train, val and test (of one variant) share
            utterances.
    """
    splits = {name: _unheaded(ids) for name, ids in split_files(folder).items()}
    for other in _strays(folder):
        raise DnnvssError("is no list of ids that is read", file=other,
                          remedy=f"Write {_ROLES[other.stem.lower()]}.txt there, an id a line")
    for name in list(splits):
        if (role := _role(name)) is not None and role not in splits:
            splits[role] = splits.pop(name)
            print(f"splits/{name}.txt is taken for {role}.txt")
    check_apart(splits, folder)
    return splits


_ROLES = {"train": "train", "val": "val", "test": "test", "training": "train", "dev": "val", "valid": "val",
          "validation": "val", "development": "val", "testing": "test", "eval": "test", "evaluation": "test",
          "trn": "train", "tst": "test", "devel": "val", "cv": "val"}
"""What corpora call their splits."""
_LISTED = re.compile(r"(?:(?:list|ids|filelist|split)[_-])?([a-z]+?)"
                     r"(?:[_-]?(?:list|ids|files|filelist|set|split|utts))?")
_HEADS = ("id", "ids", "utt_id", "utterance", "utterance_id", "file", "filename", "file_name", "name", "clip", "path")
"""What the first line of a column of ids may say."""
_LISTS = ("", ".csv", ".tsv", ".json", ".lst", ".list", ".scp", ".xlsx")


def _role(name: str) -> str | None:
    """Which of train, val and test the name of a file means (``dev``, ``Validation``, ``train_list``)."""
    match = _LISTED.fullmatch(name.lower())
    return _ROLES.get(match[1]) if match else None


def _unheaded(lines: list[str]) -> list[str]:
    """Lines of ids without the name of their column."""
    return lines[1:] if len(lines) > 1 and lines[0].lower() in _HEADS else lines


def _strays(folder: Path) -> list[Path]:
    """The files of a folder of splits that are meant to be splits and are not read."""
    if not folder.is_dir():
        return []
    read = {p.stem.lower() for p in folder.iterdir() if p.suffix.lower() == ".txt"}
    return sorted(p for p in folder.iterdir() if p.is_file() and p.suffix.lower() in _LISTS
                  and p.stem.lower() in _ROLES.keys() - read)


def resolved(splits: Mapping[str, Sequence[str]], ids: Collection[str]) -> tuple[dict[str, list[str]], list[str]]:
    """Splits whose ids are all those of recordings, and what is to be said of the others.

    A name with a suffix or a folder (``clips/a.mp4``), in another case or with accents stored in another way is that of
    its recording. A line may hold several, with a comma, semicolon, tab, bar or spaces between them, and more behind
    the first, or a number before it; one that begins with ``#`` is a remark.

    Args:
        splits: ids by name of the split, as given.
        ids: of all recordings.

    Raises:
        DnnvssError: two splits share a recording under two of its names.
    """
    near = {_bare(name): name for name in ids}
    near |= {name: name for name in ids}
    found: dict[str, list[str]] = {}
    notes: list[str] = []
    for split, names in splits.items():
        known = [_named(name, near) for name in names]
        found[split] = list(dict.fromkeys(k for row in known for k in row))
        unknown = [name for name, row in zip(names, known, strict=True) if not row and not name.startswith("#")]
        if unknown:
            shown = ", ".join(unknown[:5]) + (f" and {len(unknown) - 5} more" if len(unknown) > 5 else "")
            notes.append(f"splits/{split}.txt names what is no recording here: {shown}")
    check_apart(found, Path("splits"))
    return found, notes


def _named(line: str, near: Mapping[str, str]) -> list[str]:
    """The recordings that a line of a split names."""
    if (whole := near.get(line) or near.get(_bare(line))) is not None:
        return [whole]
    found: list[str] = []
    for signs in (r"[,;|\t]", r"[,;|\s]+"):
        parts = [bare for part in re.split(signs, line) if (bare := part.strip(" \"'[]()\u200b\ufeff"))]
        rows = [near.get(part) or near.get(_bare(part)) for part in parts]
        if len(rows) > 1 and parts[0].isdecimal() and rows[0] is None:
            rows = rows[1:]  # a number of the line
        known = [row for row in rows if row is not None]
        found = found or (known if len(known) == len(rows) else known[:1] if rows and rows[0] is not None else [])
    return found


def _bare(name: str) -> str:
    """A name without folder and suffix, in one case and form."""
    last = PurePosixPath(name.replace("\\", "/")).name
    stem = last.rsplit(".", 1)[0] if re.search(r"\.[A-Za-z0-9]{2,8}$", last) else last
    return unicodedata.normalize("NFC", stem).casefold()


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
