"""The codes of a whole corpus: joined, kept on disk, opened without reading."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.features.codes import FrameCodes
from dnnvss.features.sources import array_fields
from dnnvss.features.table import FeatureTable
from dnnvss.records import read_record

_INDEX = "codes.json"
_REMEDY = "Remove the folder and encode the corpus again"


@dataclass(frozen=True)
class _Index:
    """What lies in the folder of a store."""

    rate: str
    ids: tuple[str, ...]
    table: Mapping[str, Any]
    rows: Mapping[str, int]
    keys: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class CodeStore(FrameCodes):
    """Frame codes of many utterances in flat arrays; frames are numbered through all of them.

    Random batches mix utterances freely: windows and contexts see each utterance's own frames only.

    Args:
        ids: the utterances in order.
    """

    ids: tuple[str, ...] = ()

    @classmethod
    def join(cls, utterances: Mapping[str, FrameCodes] | Iterable[tuple[str, FrameCodes]]) -> "CodeStore":
        """Return the store of utterances by id, in order; a store among them brings its own ids.

        Raises:
            DnnvssError: no utterance, an id twice, or codes of different tables or rates.
        """
        pairs = list(utterances.items() if isinstance(utterances, Mapping) else utterances)
        parts = [c for _, c in pairs]
        ids = tuple(i for name, c in pairs for i in (c.ids if isinstance(c, CodeStore) else (name,)))
        if not parts or len(set(ids)) != len(ids):
            raise DnnvssError("a code store needs at least one utterance, each once",
                              remedy="Check the list of utterances")
        table, rate, keys = parts[0].table, parts[0].rate, parts[0].keys
        for name, part in pairs:
            if part.table != table or part.rate != rate or part.keys != keys:
                raise DnnvssError("codes of different feature tables or frame rates cannot be joined", utterance=name,
                                  remedy="Encode all utterances with one configuration")
        shared = [name for name in parts[0].sources if all(name in part.sources for part in parts)]
        declared = array_fields(shared, table.settings)
        first = {"frame": _starts([len(p) for p in parts])}
        for name, own in declared.items():
            if own.axis not in first:
                first[own.axis] = _starts([len(p.arrays[name]) for p in parts])
        arrays = {name: _joined([p.arrays[name] for p in parts], first.get(own.points_to))
                  for name, own in declared.items()}
        return cls(table, arrays, rate, keys, ids=ids)

    def save(self, folder: str | Path) -> Path:
        """Write one ``.npy`` an array and, last, the index without which it is no store; return the folder."""
        folder = Path(folder)
        files.remove(folder / _INDEX)
        for name, array in self.arrays.items():
            with files.replacing(folder / f"{name}.npy") as temporary:
                np.save(temporary, array)
        files.write_json(folder / _INDEX, {"rate": self.rate, "ids": self.ids, "table": self.table.describe(),
                                           "keys": dict(self.keys),
                                           "rows": {name: len(a) for name, a in self.arrays.items()}})
        return folder

    @classmethod
    def open(cls, folder: str | Path, table: FeatureTable | None = None) -> "CodeStore":
        """Return a saved store, its arrays mapped from disk: nothing is read before it is asked for.

        Args:
            folder: written by :meth:`save`.
            table: the columns to serve; those with which it was saved if left out.

        Raises:
            DnnvssError: the folder holds no whole store, or not what the table asks for.
        """
        folder = Path(folder)
        index = read_record(_Index, folder / _INDEX, "Encode the corpus first")
        arrays = {}
        for name, rows in index.rows.items():
            path = files.inside(folder, f"{name}.npy")
            arrays[name] = files.read(path, lambda p: np.load(p, mmap_mode="r", allow_pickle=False), _REMEDY)
            if len(arrays[name]) != rows:
                raise DnnvssError(f"has {len(arrays[name])} rows, not {rows}", file=path, remedy=_REMEDY)
        # A plain view of the map: the subclass np.memmap makes each small index slower.
        arrays = {name: np.asarray(a) for name, a in arrays.items()}
        store = cls(FeatureTable.from_description(index.table), arrays, index.rate, dict(index.keys), ids=index.ids)
        return store if table is None else store.with_table(table)


def _starts(rows: Sequence[int]) -> np.ndarray:
    """The row (U,) at which each part begins once an array is joined."""
    return np.cumsum([0, *rows[:-1]])


def _joined(arrays: list[np.ndarray], shifts: Any) -> np.ndarray:
    if shifts is None:
        return np.concatenate(arrays)
    return np.concatenate([a + np.asarray(s, a.dtype) for a, s in zip(arrays, shifts, strict=True)])
