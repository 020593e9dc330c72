"""Frame codes: utterances as small integers, served as active columns and numbers for any frames."""

from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.features.table import FeatureTable
from dnnvss.features.view import View, library


@dataclass(frozen=True)
class FrameCodes:
    """The features of T frames of one utterance or many, never as the expanded columns.

    All methods index and calculate whole batches at once. On tensors (see :meth:`to`) they return tensors of the same
    device, with the same numbers.

    Args:
        table: which columns are asked for; :meth:`with_table` asks the same arrays for others.
        arrays: as declared in :mod:`dnnvss.features.fields`.
        rate: frames a second, as text.
    """

    table: FeatureTable
    arrays: dict[str, Any]
    rate: str = "100"
    _constants: dict[Any, Any] = field(default_factory=dict, repr=False, compare=False)

    def __len__(self) -> int:
        """The number of frames T."""
        return len(self.arrays["phone"])

    @property
    def utterances(self) -> int:
        """The number of utterances."""
        return len(self.arrays["utterance_start"])

    @property
    def has_visemes(self) -> bool:
        """Whether dynamic visemes are among the arrays."""
        return "viseme" in self.arrays

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
        phone = self.arrays["phone"]
        return {} if isinstance(phone, np.ndarray) else {"device": phone.device}

    def _view(self, frames: Any) -> View:
        if isinstance(self.arrays["phone"], np.ndarray):
            return View(self.arrays, np.asarray(frames, dtype=np.int64), self._constants)
        torch = library(self.arrays["phone"])
        return View(self.arrays, torch.as_tensor(frames, dtype=torch.int64, **self._on), self._constants)

    def with_table(self, table: FeatureTable) -> Self:
        """Return the same arrays, asked for other columns.

        Raises:
            DnnvssError: the table needs dynamic visemes and there are none, or there are more than it has columns for.
        """
        check_units(table, self.arrays)
        return replace(self, table=table, _constants={})

    def to(self, device: Any) -> Self:
        """Return the codes with their arrays as tensors on a device (``"cpu"``, ``"cuda"``)."""
        import torch  # here: codes serve synthesis without torch too

        def tensor(array: Any) -> Any:
            if isinstance(array, np.ndarray):
                array = array.astype(np.int32) if array.dtype == np.uint16 else np.array(array)  # torch lacks uint16
            return torch.as_tensor(array, device=device)

        return replace(self, arrays={name: tensor(a) for name, a in self.arrays.items()}, _constants={})


def check_units(table: FeatureTable, arrays: dict[str, Any]) -> None:
    """Return quietly if the arrays hold what the table asks for.

    Raises:
        DnnvssError: dynamic visemes are missing, or their numbers are too high.
    """
    if not table.uses_visemes:
        return
    first = next(block.name for block in table.blocks if block.family == "dv")
    if "viseme" not in arrays:
        raise DnnvssError(f"feature block {first!r} needs dynamic visemes, and there are none",
                          remedy="Encode alignments with a tier 'visemes', or choose labels without dynamic visemes")
    highest = int(arrays["viseme_code"].max())
    if highest >= table.settings.units:
        raise DnnvssError(f"dynamic viseme {highest} is outside the table's {table.settings.units} units",
                          remedy=f"Set labels.units to at least {highest + 1}")


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
