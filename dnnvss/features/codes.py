"""Frame codes: utterances as small arrays, served as active columns and numbers for any frames."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.features.sources import SOURCES
from dnnvss.features.table import FeatureTable
from dnnvss.features.view import View, library


@dataclass(frozen=True)
class FrameCodes:
    """The features of T frames of one utterance or many, never as the expanded columns.

    All methods index and calculate whole batches at once. On tensors (see :meth:`to`) they return tensors of the same
    device, with the same numbers.

    Args:
        table: which columns are asked for; :meth:`with_table` asks the same arrays for others.
        arrays: as the feature sources declare them; only a source finds its own by name.
        rate: frames a second, as text.
        keys: what the numbers of a source depend on, by its name; nothing where they are codes.
    """

    table: FeatureTable
    arrays: dict[str, Any]
    rate: str = "100"
    keys: Mapping[str, str] = field(default_factory=dict)
    _constants: dict[Any, Any] = field(default_factory=dict, repr=False, compare=False)

    def __len__(self) -> int:
        """The number of frames T."""
        return self._count

    @cached_property
    def _count(self) -> int:
        return int(self.arrays["utterance_start"][-1]) + int(self.arrays["utterance_frames"][-1])

    @property
    def utterances(self) -> int:
        """The number of utterances."""
        return len(self.arrays["utterance_start"])

    @cached_property
    def sources(self) -> tuple[str, ...]:
        """The feature sources whose arrays are here."""
        return tuple(name for name, source in SOURCES.items()
                     if all(array in self.arrays for array in source.fields(self.table.settings)))

    def active(self, frames: Any) -> Any:
        """Return the binary columns that are 1, int32 (B, A), in table order with gaps.

        Columns are counted among binary columns; unused places hold ``table.binary_width``, so that a matrix with one
        row more than columns, the last row zero, turns the codes into the first layer's sum. No column comes twice.

        Args:
            frames: indices of frames (B,), any integer type; ``A`` is ``table.active_width``.
        """
        view = self._view(frames)
        out = view.xp.empty((len(view.frames), self.table.active_width), dtype=view.xp.int32, **self._on)
        place, start, pad = 0, 0, self.table.binary_width
        for block in self.table.blocks:
            if block.kind == "binary":
                out[:, place : place + block.slots] = block.fill(view, start, pad)
                place, start = place + block.slots, start + block.width
        return out

    def numeric(self, frames: Any) -> Any:
        """Return the numeric columns, float32 (B, N), not normalised.

        Args:
            frames: indices of frames (B,), any integer type; ``N`` is ``table.numeric_width``.
        """
        view = self._view(frames)
        out = view.xp.empty((len(view.frames), self.table.numeric_width), dtype=view.xp.float32, **self._on)
        place = 0
        for block in self.table.blocks:
            if block.kind == "numeric":
                out[:, place : place + block.slots] = block.fill(view, 0, 0)
                place += block.slots
        return out

    @property
    def _on(self) -> dict[str, Any]:
        start = self.arrays["utterance_start"]
        return {} if isinstance(start, np.ndarray) else {"device": start.device}

    def _view(self, frames: Any) -> View:
        start = self.arrays["utterance_start"]
        if isinstance(start, np.ndarray):
            return View(self.arrays, np.asarray(frames, dtype=np.int64), self._constants)
        torch = library(start)
        return View(self.arrays, torch.as_tensor(frames, dtype=torch.int64, **self._on), self._constants)

    def with_table(self, table: FeatureTable) -> Self:
        """The same arrays, asked for other columns.

        Raises:
            DnnvssError: a source that the table reads is not among them, or they cannot serve its columns.
        """
        made = replace(self, table=table, _constants={})
        made.check()
        return made

    def check(self) -> None:
        """Hold the arrays to what the table asks for.

        Raises:
            DnnvssError: a source that the table reads is not among them, or they cannot serve its columns.
        """
        table, settings = self.table, self.table.settings
        for name in table.sources:
            source = SOURCES[name]
            if name not in self.sources:
                first = next(block.name for block in table.blocks if name in block.reads)
                raise DnnvssError(f"feature block {first!r} {source.absent[0]}", remedy=source.absent[1])
            if self.keys.get(name, "") != source.key(settings):
                raise DnnvssError(f"{table.title}: its {name} were worked out with other settings "
                                  f"({self.keys.get(name)}, not {source.key(settings)})",
                                  remedy="Encode the recordings again")
            source.check(settings, self.arrays)

    def to(self, device: Any) -> Self:
        """Return the codes with their arrays as tensors on a device (``"cpu"``, ``"cuda"``)."""
        import torch  # here: codes serve synthesis without torch too

        def tensor(array: Any) -> Any:
            if isinstance(array, np.ndarray):
                array = array.astype(np.int32) if array.dtype == np.uint16 else np.array(array)  # torch lacks uint16
            return torch.as_tensor(array, device=device)

        return replace(self, arrays={name: tensor(a) for name, a in self.arrays.items()}, _constants={})


def expand(codes: FrameCodes, frames: Any = None) -> np.ndarray:
    """Return the dense matrix (T, C), float32, with columns in the order of ``codes.table.columns``.

    For tests and for other tools; training and synthesis never need it. Numeric columns are not normalised.

    Args:
        codes: of one utterance or many, as NumPy arrays.
        frames: indices (T,); all frames if left out.
    """
    frames = np.arange(len(codes)) if frames is None else np.asarray(frames)
    table = codes.table
    columns = np.append(table.binary_columns, table.width)  # padding goes to a column beyond the last, cut off below
    dense = np.zeros((len(frames), table.width + 1), dtype=np.float32)
    dense[np.arange(len(frames))[:, None], columns[codes.active(frames)]] = 1
    dense[:, table.numeric_columns] = codes.numeric(frames)
    return dense[:, :-1]
