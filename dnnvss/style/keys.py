"""An artist's keys: values and ranges at times, written as CSV or JSON, edited, and held in the next synthesis."""

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.curves.constraints import Constraints, hold
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Gauge
from dnnvss.formats.numbers import comma_number
from dnnvss.formats.rows import table_rows
from dnnvss.timing import FrameClock, Tier

_LARGEST = 1e9
_REMEDY = "Write one key a line with the columns time, name, low, high (and end, softness, phone, index, position)"


@dataclass(frozen=True)
class Key:
    """What a gauge must measure at a time.

    A key with a phone is anchored to it: ``index`` is the segment's place in the phones tier and ``position`` the share
    of its duration, so that the key finds its place again when the sentence is spoken faster or by another engine.
    ``time`` is then where it stood when it was written.

    Args:
        time: seconds from the start of the utterance.
        name: of the gauge: ``aperture``, ``width``, or a coefficient such as ``aam01``.
        low, high: the range; equal for a value; infinite for no bound.
        end: seconds; the key holds from ``time`` to ``end``. None for a single frame.
        softness: 0 holds it; a positive number in the gauge's unit gives way.
        phone: label of the phone that it is anchored to, or None.
        index: the segment's place in the tier.
        position: 0 at the phone's start, 1 at its end.
    """

    time: float
    name: str
    low: float
    high: float
    end: float | None = None
    softness: float = 0.0
    phone: str | None = None
    index: int | None = None
    position: float | None = None


_COLUMNS = tuple(f.name for f in fields(Key))


def sample_keys(
    trajectory: np.ndarray,
    clock: FrameClock,
    gauges: Mapping[str, Gauge],
    tier: Tier | None,
    positions: Sequence[float] = (0.5,),
) -> list[Key]:
    """Return keys that describe a trajectory (T, D): the value of each gauge in each phone.

    Args:
        trajectory: (T, D).
        clock: its clock.
        gauges: name to gauge.
        tier: the phones tier, to which the keys are anchored; where None, each tenth of a second counts as a phone and
            nothing is anchored.
        positions: shares of each phone's duration at which keys are set.
    """
    if tier is None:
        ends = [*np.arange(1, int(10 * clock.seconds(len(trajectory)) + 1e-9)) / 10, clock.seconds(len(trajectory))]
        tenths = Tier("tenths", zip([0.0, *ends[:-1]], ends, [""] * len(ends), strict=True))
        made = sample_keys(trajectory, clock, gauges, tenths, positions)
        return [replace(key, phone=None, index=None, position=None) for key in made]
    keys = []
    values = {name: f(trajectory) for name, f in gauges.items()}
    for index, segment in enumerate(tier):
        for position in positions:
            time = segment.start - tier.start + position * segment.duration
            frame = _frame(time, clock, len(trajectory))
            for name, track in values.items():
                value = round(float(track[frame]), 6)
                anchor = {"phone": segment.label, "index": index, "position": position}
                keys.append(Key(round(time, 6), name, value, value, **anchor))  # type: ignore[arg-type]
    return keys


def key_constraints(
    keys: Sequence[Key], gauges: Mapping[str, Gauge], clock: FrameClock, frames: int, tier: Tier | None = None
) -> Constraints:
    """Return keys as constraints on a trajectory of ``frames`` frames.

    Args:
        keys: from :func:`sample_keys` or :func:`read_keys`.
        gauges: name to gauge, at least those that the keys name.
        clock: the trajectory clock.
        frames: T.
        tier: the phones tier of this synthesis; anchored keys move with their phones. Where None, all keys keep their
            times.

    Raises:
        DnnvssError: a name that is not known, a phone that is not where the key was anchored, or a time behind the end.
    """
    if not gauges:
        raise DnnvssError("keys need gauges to hold", remedy="Give the aperture or the coefficients by name")
    parts = [Constraints.none(len(next(iter(gauges.values())).vector))]
    for key in keys:
        if key.name not in gauges:
            raise DnnvssError(f"key at {key.time:g} s: nothing is named {key.name!r}",
                              remedy=f"Use one of: {', '.join(gauges)}")
        time = key_time(key, tier)
        if not -1e-9 <= time <= clock.seconds(frames) + 1e-9:
            length, anchor = clock.seconds(frames), f" (position {key.position} in phone {key.index}, {key.phone})"
            raise DnnvssError(f"key {key.name!r} at {time:g} s{'' if key.index is None else anchor} lies outside the "
                              f"utterance of {length:g} s",
                              remedy="Move it, or anchor it to a phone" if key.index is None else
                              "Give a position from 0, the phone's start, to 1, its end")
        first = _frame(time, clock, frames)
        last = first if key.end is None else _frame(time + key.end - key.time, clock, frames)
        gauge = gauges[key.name]
        parts.append(hold(np.arange(first, max(first, last) + 1), gauge.vector, gauge.constant, low=key.low,
                          high=key.high, softness=key.softness, label=f"key {key.name} at {time:.2f} s"))
    return Constraints.joined(parts)


def key_time(key: Key, tier: Tier | None) -> float:
    """Seconds at which a key stands in a synthesis: where its phone is now, else where it was written.

    Raises:
        DnnvssError: another phone is where the key was anchored.
    """
    return key.time if tier is None or key.index is None else _anchored(key, tier)


def coefficients(names: Sequence[str]) -> dict[str, Gauge]:
    """A gauge for each coefficient, by its name."""
    return {name: Gauge(name, row, 0.0, unit="") for name, row in zip(names, np.eye(len(names)), strict=True)}


def _frame(time: float, clock: FrameClock, frames: int) -> int:
    """Return the frame whose interval holds a time, the last one at the very end."""
    return min(max(int(np.floor(time * float(clock.rate) + 1e-9)), 0), frames - 1)


def _anchored(key: Key, tier: Tier) -> float:
    found = tier.labels[key.index] if key.index is not None and 0 <= key.index < len(tier) else None
    if found is None or (key.phone is not None and found != key.phone):
        raise DnnvssError(f"key {key.name!r} is anchored to {key.phone!r}, phone {key.index}, which is {found!r} now",
                          remedy="Say the same words, or take phone, index and position out of the key")
    segment = tier[key.index or 0]
    return segment.start - tier.start + (0.5 if key.position is None else key.position) * segment.duration


def write_keys(path: str | Path, keys: Sequence[Key]) -> Path:
    """Write keys as ``.csv`` or ``.json`` and return the path; infinite bounds are left empty.

    Raises:
        DnnvssError: another suffix.
    """
    rows = [{name: _written(getattr(key, name)) for name in _COLUMNS} for key in keys]
    if check_keys_file(path) == ".json":
        return files.write_json(path, rows)
    text = io.StringIO()
    writer = csv.DictWriter(text, _COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return files.write_text(path, text.getvalue())


def read_keys(path: str | Path) -> list[Key]:
    """Return the keys in a ``.csv`` or ``.json`` file. ``value`` may stand for equal ``low`` and ``high``.

    Raises:
        DnnvssError: the file is missing or damaged, or a line lacks what it needs; the message gives the line.
    """
    if check_keys_file(path) == ".json":
        rows = files.read_json(path, _REMEDY)
        if not isinstance(rows, list):
            raise DnnvssError("holds no list of keys", file=path, remedy=_REMEDY)
    else:
        rows = files.read(path, _table, _REMEDY)
    keys = []
    for number, row in enumerate(rows, start=1):
        try:
            keys.append(_parsed({k: v for k, v in row.items() if v not in (None, "")}))
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError) as error:
            raise DnnvssError(f"key {number} cannot be read ({type(error).__name__}: {error})", file=path,
                              remedy=_REMEDY) from error
    return keys


def _table(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV by the names of their columns; decimals behind a point."""
    rows, number = table_rows(files.read_text(path, _REMEDY))
    (_, head), *rest = rows or [(1, [])]
    for place, row in rest:
        if len(row) > len(head):
            raise DnnvssError(f"line {place} has {len(row)} cells, and there are {len(head)} columns", file=path,
                              remedy=_REMEDY)
    points = number is comma_number
    named = (zip(head, row, strict=False) for _, row in rest)
    return [{name: re.sub(r"(?<=\d),(?=\d)", ".", cell) if points else cell for name, cell in row} for row in named]


def check_keys_file(path: str | Path) -> str:
    """The suffix of a file of keys.

    Raises:
        DnnvssError: it is another one.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in (".csv", ".json"):
        raise DnnvssError(f"keys cannot be kept as {suffix or 'a file without suffix'}", file=path,
                          remedy="Name it .csv or .json")
    return suffix


def _written(value: Any) -> Any:
    return None if isinstance(value, float) and np.isinf(value) else value


def _parsed(row: dict[str, Any]) -> Key:
    if unknown := set(row) - {*_COLUMNS, "value"}:
        raise ValueError(f"unknown column {sorted(unknown)[0]!r}")
    if not {"value", "low", "high"} & set(row):
        raise ValueError("it has neither a value nor a bound")
    if not all(isinstance(row.get(name, ""), str) for name in ("name", "phone")):
        raise ValueError("name and phone are texts")
    value = row.get("value")
    low, high = (_number(row.get(side, none if value is None else value), side)
                 for side, none in (("low", -np.inf), ("high", np.inf)))
    if low > high:
        raise ValueError(f"low is {low:g} and high {high:g}")
    times = {name: _finite(row[name], name) for name in ("end", "position") if name in row}
    softness = _finite(row.get("softness", 0.0), "softness")
    if softness < 0:
        raise ValueError(f"softness is {softness:g}")
    index = _finite(row["index"], "index") if "index" in row else None
    if index is not None and (index < 0 or index != int(index)):
        raise ValueError(f"index is {index:g}, which is no place in a tier")
    return Key(_finite(row["time"], "time"), row["name"], low, high, softness=softness, phone=row.get("phone"),
               index=None if index is None else int(index), **times)


def _number(value: Any, name: str) -> float:
    """A number as a cell or as JSON holds it, infinite ones among them."""
    if isinstance(value, bool) or not isinstance(value, int | float | str) or not str(value).isascii():
        raise ValueError(f"{name} is {value!r}")
    if np.isnan(number := float(value)):
        raise ValueError(f"{name} is no number")
    return number


def _finite(value: Any, name: str) -> float:
    if not abs(number := _number(value, name)) < _LARGEST:
        raise ValueError(f"{name} is {number:g}")
    return number
