"""What a run has heard: how its training sounds lie, so that a sound unlike all of them is told."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, read_declared
from dnnvss.errors import DnnvssError
from dnnvss.features import CodeStore, FeatureTable, FrameCodes, NumericScaler
from dnnvss.features.sources import SOURCES
from dnnvss.timing import FrameClock

_AROUND = 0.1
"""Seconds over which distances are averaged: a click is no strange sound."""
_SHARE = 0.999
"""Share of the training frames whose distance is usual."""
_CHUNK = 4096
_REMEDY = "Train the run again"
_HELD = {"mean": Held(("N",)), "deviation": Held(("N",)), "usual": Held(())}


@dataclass(frozen=True)
class Heard:
    """How the columns of the sound lie over the training frames.

    Args:
        scaler: mean and deviation of each of N columns.
        usual: the mean square of scaled columns that 99.9 % of the training frames stay below,
            averaged over 100 ms.
    """

    scaler: NumericScaler
    usual: float

    @classmethod
    def of(cls, codes: Iterable[FrameCodes], clock: FrameClock) -> "Heard | None":
        """What training utterances hold; None where their labels do not read the sound."""
        held = [made for each in codes if (made := of_sound(each)) is not None]
        if not held:
            return None
        store = CodeStore.join((str(k), each) for k, each in enumerate(held))
        known = cls(NumericScaler.fit(store), 1.0)
        distances = np.concatenate([known.strangeness(each, clock) for each in held])
        return cls(known.scaler, float(np.quantile(distances, _SHARE)))

    def strangeness(self, codes: FrameCodes, clock: FrameClock) -> np.ndarray:
        """How far the sound of each frame lies from what was heard (T,); beyond 1 it is unusual.

        The mean over columns of ``((x - m) / s)^2``, averaged over 100 ms, over what is usual.
        """
        heard = of_sound(codes)
        assert heard is not None, "codes without sound"
        parts = [np.square(self.scaler(rows)).mean(1, dtype=float) for rows in _rows(heard)]
        width = max(1, round(_AROUND * float(clock.rate)))
        distances = np.concatenate(parts)
        weights = np.convolve(np.ones(len(distances)), np.ones(width), "full")[: len(distances)]
        return np.convolve(distances, np.ones(width), "full")[: len(distances)] / weights / self.usual

    def save(self, path: Path) -> Path:
        """Write ``.npz`` and return the path."""
        return files.write_arrays(path, mean=self.scaler.mean, deviation=self.scaler.deviation,
                                  usual=np.array(self.usual))

    @classmethod
    def load(cls, path: Path) -> "Heard":
        """What :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing or damaged.
        """
        held = read_declared(path, _HELD, _REMEDY)
        if not (held["usual"] > 0 and (held["deviation"] > 0).all()):
            raise DnnvssError("holds deviations that are not above 0", file=path, remedy=_REMEDY)
        return cls(NumericScaler(held["mean"], held["deviation"]), float(held["usual"]))


def of_sound(codes: FrameCodes) -> FrameCodes | None:
    """The codes asked for their columns of sound at the frame alone; None where they have none."""
    table = codes.table
    kept = [b.name for b in table.blocks if b.kind == "numeric" and not b.name.endswith("_window")
            and all(SOURCES[name].needs == {"sound"} for name in b.reads)]
    return codes.with_table(FeatureTable(tuple(kept), table.settings)) if kept else None


def _rows(codes: FrameCodes) -> Iterator[np.ndarray]:
    for first in range(0, len(codes), _CHUNK):
        yield codes.numeric(np.arange(first, min(first + _CHUNK, len(codes))))
