"""Reads takes: Live Link Face's CSV, any CSV of named curves, and the JSON that we write."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.export.take import Take
from dnnvss.export.timecode import TimeCode
from dnnvss.formats.curves import read_curves
from dnnvss.formats.drop_frame import has_drop_frame, labels_of
from dnnvss.records import read_record
from dnnvss.timing import FrameClock

_RATES = ("24", "25", "29.97", "30", "48", "50", "59.94", "60", "100", "119.88", "120", "240")
_NEAR = 2e-4
"""Share by which a rate may miss one of the usual ones and be that."""
_MOST_FRAMES, _MOST_VALUES = 2_000_000, 50_000_000
"""Of a take: frames, and values of all its curves; hours of a face."""
_MOST_BYTES = 500_000_000
_SLOWEST = 0.1
"""Frames a second of a take at least."""
_JITTER = 0.1
"""Frames by which a step between time stamps may differ from a whole number and be one."""
_REMEDY = "Give the CSV of Live Link Face, a CSV with a name over each curve, or what export_rig=take.json wrote"
_ASIDE = ("timecode", "frame", "frames", "seconds")


@dataclass(frozen=True, kw_only=True)
class _Written:
    """The JSON of a take."""

    format: str
    version: int
    rate: str
    timecode: str
    timecodes: tuple[str, ...]
    seconds: tuple[float, ...]
    names: tuple[str, ...]
    frames: tuple[tuple[float, ...], ...]
    about: dict[str, object]


def read_take(path: Path, rate: FrameClock | None = None, made_at: FrameClock | None = None) -> Take:
    """The take in a ``.csv`` or ``.json`` file, at a constant rate.

    Args:
        path: the file.
        rate: frames a second wanted; those of the file where None. Between its frames, curves are straight lines. Time
            codes that count to the whole number beside a rate such as 29.97, or to a multiple, are those of that rate.
        made_at: what the frames were at, where that is known and no rate is wanted; it tells 29.97 from 30 likewise.

    Raises:
        DnnvssError: another kind of file, a damaged one, one whose times tell no rate where none is given, or too many
            frames.
    """
    match path.suffix.lower():
        case ".json":
            take = _from_json(path)
        case ".csv":
            take = _from_csv(path, rate, made_at)
        case other:
            raise DnnvssError(
                f"a take is not read from {other or 'a folder'}", file=path, remedy=_REMEDY
            )
    return take if rate is None else at_rate(take, rate, path)


def at_rate(take: Take, clock: FrameClock, path: Path | None = None) -> Take:
    """A take at another frame rate: straight lines between its frames.

    Raises:
        DnnvssError: there would be too many frames.
    """
    if clock == take.clock:
        return take
    count = max(1, clock.edge(take.clock.seconds(take.frames)))
    _check_size(count, len(take.curves), path)
    at = np.array([clock.seconds(k) for k in range(count)])
    curves = {name: np.interp(at, take.seconds, track) for name, track in take.curves.items()}
    return Take(curves, clock, take.start.counted(take.clock, clock), take.head, take.about)


def _check_size(frames: int, curves: int, path: Path | None) -> None:
    """Refuse a take that is far too long for its curves."""
    if frames > _MOST_FRAMES or frames * curves > _MOST_VALUES:
        raise DnnvssError(
            f"{frames:,} frames of {curves} curves are too many",
            file=path,
            remedy="Give a lower rate, or a shorter take",
        )


def _from_json(path: Path) -> Take:
    if path.is_file() and path.stat().st_size > _MOST_BYTES:
        raise DnnvssError(
            f"is larger than {_MOST_BYTES // 10**6} MB", file=path, remedy="Give a shorter take"
        )
    held = read_record(_Written, path, _REMEDY)
    table = [row for row in held.frames if len(row) == len(held.names)]
    if held.format != "dnnvss-take" or not table or len(table) < len(held.frames):
        raise DnnvssError("is no take, or a frame of it lacks a curve", file=path, remedy=_REMEDY)
    _check_size(len(table), len(held.names), path)
    values = np.array(table, float)
    if not np.isfinite(values).all():
        raise DnnvssError("holds a value that is no number", file=path, remedy=_REMEDY)
    clock = FrameClock.from_setting(held.rate, "rate")
    start = TimeCode.from_setting(held.timecode, "timecode")
    return Take(dict(zip(held.names, values.T, strict=True)), clock, start)


def _from_csv(path: Path, rate: FrameClock | None, made_at: FrameClock | None) -> Take:
    known = rate or made_at
    held = read_curves(path, known.rate if known else None)
    names = [name for name in held.names if name.lower() not in _ASIDE]
    values = held.values[:, [held.names.index(name) for name in names]]
    if not np.isfinite(values).all():
        name = names[int(np.argmax(~np.isfinite(values).all(axis=0)))]
        raise DnnvssError(
            f"the curve {name!r} has gaps", file=path, remedy="Fill them, or leave the column out"
        )
    if held.times is None:
        if rate is None:
            raise DnnvssError(
                "has no times", file=path, remedy="Give the frame rate, or a column of times"
            )
        return Take(dict(zip(names, values.T, strict=True)), rate)
    times = held.since(known.rate if known else None)
    if rate is None and len(times) > 1 and not _SLOWEST * np.median(np.diff(times)) <= 1:
        raise DnnvssError(
            f"its frames lie {np.median(np.diff(times)):g} s apart",
            file=path,
            remedy="Give the frame rate, or times in seconds",
        )
    own = _usual(times) if len(times) > 1 else known or FrameClock(held.counted or 30)
    clock = rate or own
    count = max(1, clock.edge(float(times[-1]) + own.seconds(1)))
    _check_size(count, len(names), path)
    places = times * float(clock.rate)
    steps = np.diff(places)
    whole = np.concatenate([[0.0], np.cumsum(np.round(steps))])
    even = (
        np.abs(steps - np.round(steps)).max(initial=0) < _JITTER
        and np.round(steps).min(initial=1) > 0
    )
    if even and np.abs(places - whole).max() < 1:
        places = whole  # a frame stays as it is where stamps are even
        count = max(1, clock.edge(clock.seconds(int(whole[-1])) + own.seconds(1)))
    at = np.arange(count)
    curves = {
        name: np.interp(at, places, track) for name, track in zip(names, values.T, strict=True)
    }
    if held.first:
        start = TimeCode.from_setting(held.first, "timecode").counted(own, clock)
    else:
        start = _start(held.times[0], clock, held.drop)
    return Take(curves, clock, start)


def _usual(times: np.ndarray) -> FrameClock:
    """The rate of times: a usual one that is near, else what they are on average."""
    steps = np.diff(times)
    mean = float(np.round(steps / np.median(steps)).sum()) / float(times[-1])
    clocks = [FrameClock(rate) for rate in _RATES]
    nearest = min(clocks, key=lambda c: abs(float(c.rate) / mean - 1))
    near = abs(float(nearest.rate) / mean - 1) < _NEAR
    return nearest if near else FrameClock(float(f"{mean:.6g}"))


def _start(seconds: float, clock: FrameClock, drop: bool) -> TimeCode:
    """The time code of a moment since midnight, drop-frame where the rate has that and it is wanted."""
    if drop and has_drop_frame(clock.rate):
        base, frames = round(clock.rate), np.array([math.floor(seconds * float(clock.rate) + 1e-6)])
        whole, frame = divmod(int(labels_of(frames, base)[0]), base)
        return TimeCode(whole // 3600 % 24, whole // 60 % 60, whole % 60, frame, drop=True)
    whole = math.floor(seconds)  # before midnight where it is negative
    base = max(1, round(float(clock.rate)))
    frame = min(int((seconds - whole) * base + 1e-6), base - 1)
    return TimeCode(whole // 3600 % 24, whole // 60 % 60, whole % 60, frame)
