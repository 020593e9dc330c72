"""Takes of motion capture: markers in space, or the named curves of a rig, read at a constant rate."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from data_prep.stages import FOLDER
from dnnvss.errors import DnnvssError
from dnnvss.formats import Curves, marker_columns, read_curves, read_markers, write_npz
from dnnvss.formats.capture_csv import is_capture_csv
from dnnvss.formats.openface import Landmarks
from dnnvss.timing import FrameClock
from dnnvss.timing.rates import even_frames, rate_of

KINDS = (".c3d", ".trc", ".csv")
"""Kinds of takes; where an id has several, the first."""
READ, VERSION = "takes", 1
"""The stage that reads takes."""
_FEW, _LEAST, _WIDEST = 4, 15.0, 5000.0
"""Markers from which a take shows a face, and millimetres that those of a face and of a body span."""
_MOST = 100_000_000
"""Numbers of a take."""


@dataclass(frozen=True)
class Taken:
    """What is known of a take after it was read.

    Args:
        kind: ``markers`` or ``curves``.
        names: of its markers or curves.
        rate: frames a second, as text.
        frames: how many.
        lost: frames that the time stamps skip.
    """

    kind: str
    names: tuple[str, ...]
    rate: str
    frames: int
    lost: int = 0

    @property
    def notes(self) -> list[str]:
        """What is told of it."""
        return [f"{self.lost} frames were not taken ({self.kind} interpolated)"] if self.lost else []


def is_take(path: Path) -> bool:
    """Whether a file is a take by its name; word times and the like may be CSV too."""
    return path.suffix.lower() != ".csv" or not path.stem.lower().endswith("words")


def read_take(name: str, out: Path, path: Path, rate: str | None) -> dict[str, Any]:
    """What is known of a take, after writing it to ``out/.stages/takes/<id>.npz`` at a constant rate.

    Raises:
        DnnvssError: the file is damaged, its rate is not known, or it is far too long.
    """
    bare, known = path.suffix.lower() == ".csv" and not is_capture_csv(path), Fraction(rate) if rate else None
    if bare and marker_columns((curves := read_curves(path, known)).names) is None:
        points, valid, clock = _evened(curves, rate, path)
        kind, names, lost = "curves", curves.names, int((~valid).sum())
    else:
        found = read_markers(path)
        kind, names, points, lost = "markers", found.names, found.points, 0
        if found.rate is None and rate is None:
            raise _no_rate(path)
        clock = Fraction(rate) if rate else FrameClock(round(found.rate or 0.0, 3)).rate
        valid = np.isfinite(points).any(axis=(1, 2))
        _check_scale(points, path)
    if points.size > _MOST:
        raise DnnvssError(f"holds {len(points):,} frames of {len(names)}", file=path, utterance=name,
                          remedy="Cut it into takes of minutes")
    write_npz(out / FOLDER / READ / f"{name}.npz", Landmarks(points.astype(np.float32), valid))
    return {"kind": kind, "names": list(names), "rate": str(clock), "frames": len(points), "lost": lost}


def alike(known: Mapping[str, Taken], root: Path) -> tuple[Taken, dict[str, str]]:
    """What most takes are like, and why others do not fit.

    Args:
        known: id to what could be read.
        root: their folder.

    Raises:
        DnnvssError: none could be read, or there are markers and curves.
    """
    if not known:
        raise DnnvssError("none of its takes can be read", file=root, remedy="See the report, or read one alone")
    if len(kinds := {take.kind for take in known.values()}) > 1:
        one, two = (next(i for i, take in known.items() if take.kind == kind) for kind in sorted(kinds))
        raise DnnvssError(f"holds curves ({one}) and markers ({two})", file=root, remedy="Prepare them as two corpora")
    (names, rate), _ = Counter((take.names, take.rate) for take in known.values()).most_common(1)[0]
    odd = {}
    for i, take in known.items():
        if take.names != names:
            odd[i] = _otherwise(take, names)
        elif take.rate != rate:
            odd[i] = f"has {take.rate} frames a second, and most takes have {rate}"
    return next(take for i, take in known.items() if i not in odd), odd


def _otherwise(take: Taken, names: tuple[str, ...]) -> str:
    """Why a take does not fit those of other names."""
    lacks = [n for n in names if n not in take.names] or [n for n in take.names if n not in names]
    if lacks:
        return f"its {take.kind} are not those of the corpus: {', '.join(lacks[:4])}"
    return f"its {take.kind} come in another order"


def _check_scale(points: np.ndarray, path: Path) -> None:
    """Refuse markers (F, M, 3) that do not span what a head or a body does: they are in another unit."""
    seen = points[np.isfinite(points).all(axis=(1, 2))]
    if not len(seen) or points.shape[1] < _FEW:
        return
    span = float(np.median(np.ptp(seen, axis=1).max(axis=1)))
    if not _LEAST <= span <= _WIDEST:
        raise DnnvssError(f"its markers span {span:.3g} mm, which no face does", file=path,
                          remedy="Export them in millimetres, or with the unit that the file tells")


def _evened(curves: Curves, given: str | None, path: Path) -> tuple[np.ndarray, np.ndarray, Fraction]:
    """Curves (F, C, 1) at a constant rate, which of the frames were taken, and the rate."""
    values, valid = curves.values[..., None], np.isfinite(curves.values).all(axis=1)
    values = np.where(np.isfinite(values), values, 0.0)
    if curves.times is None or len(curves.times) < 2:
        if given is None:
            raise _no_rate(path)
        return values, valid, Fraction(given)
    known = Fraction(given) if given else None
    times = curves.since(known)
    rate = known or rate_of(times)
    index, taken = even_frames(times, rate)
    return values[index], valid[index] & taken, rate


def _no_rate(path: Path) -> DnnvssError:
    return DnnvssError("does not tell its frame rate", file=path, remedy="Give it: corpus.importer.rate=120")
