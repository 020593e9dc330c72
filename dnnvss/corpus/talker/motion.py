"""The movement of the articulators through a sentence, and the gestures that it is made of.

Between two anchors all of jaw and lips follow one minimum-jerk course, so that speed is nought at every anchor and
peaks once between. A gesture is that stretch: its boundaries are the minima of speed, and its class is the shape it
leaves and the shape it reaches (``closed>open``). A rest that is held is a gesture of its own.

**Source**: minimum jerk is Flash and Hogan, "The coordination of arm movements", 1985, equation 2.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dnnvss.corpus.talker.anchors import Anchor, poses, separated, targets_in_time
from dnnvss.corpus.talker.targets import LIPS, Articulators
from dnnvss.timing import Alignment, Tier

_LONGEST = 0.34  # seconds; a longer way is waited for in the shape it leaves
_REST_LEAST = 0.10  # seconds; a rest that is held for less is a point between two movements
_TONGUE_SD = 0.08  # of the log of a tongue target
_TREMOR, _TREMOR_BAND = 0.008, (0.5, 1.9)  # size (as articulators) and frequencies in Hz
_SWAY, _SWAY_BAND = np.array([4.0, 2.6, 0.5]), (0.06, 0.35)  # sway_x, sway_y, roll
_BLINK_EVERY, _LID = 3.2, 0.075  # seconds between blinks, and half the length of one


@dataclass(frozen=True)
class Motion:
    """The movement of a whole sentence, to be asked for at any time.

    Args:
        anchors: times (K,) in seconds at which the lips stand still in ``lips`` (K, 6); two of one shape bound a hold.
        tongue_times, tongue: the same for the tongue, (J,) and (J, 2).
        tremor: size, frequency in Hz and phase of three sines for each column of the lips, (3, 6, 3).
        sway: the same for ``sway_x``, ``sway_y`` and ``roll``, (3, 3, 3).
        blinks: times at which the eyes are shut.
    """

    anchors: np.ndarray
    lips: np.ndarray
    tongue_times: np.ndarray
    tongue: np.ndarray
    tremor: np.ndarray
    sway: np.ndarray
    blinks: np.ndarray

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the articulators at ``times`` (F,) in seconds, shape (F, 12), columns as in :class:`Articulators`."""
        times = np.asarray(times, dtype=float)
        lips = _course(times, self.anchors, self.lips)
        activity = np.clip(np.abs(lips).sum(axis=1, keepdims=True), 0.15, 1)
        activity = np.where(lips[:, [LIPS.index("opening")]] < 0, 0.15, activity)  # a closure stays closed
        tongue = _course(times, self.tongue_times, self.tongue)
        lid = np.exp(-(((times[:, None] - self.blinks) / _LID) ** 4)).sum(axis=1, keepdims=True).clip(0, 1)
        columns = [lips + activity * _sines(times, self.tremor), tongue, _sines(times, self.sway), lid]
        rows = np.concatenate(columns, axis=1)
        assert rows.shape[1] == len(Articulators._fields)
        return rows


def perform(alignment: Alignment, random: np.random.Generator) -> tuple[Motion, Tier]:
    """Return the movement of a sentence and its true gestures, the tier ``gestures`` over the span of the alignment.

    Labels are ``rest`` and ``FROM>TO`` with two of :data:`~dnnvss.corpus.talker.targets.SHAPES`.
    """
    targets = targets_in_time(alignment["phones"], random)
    anchors = separated(targets)
    waits = _waits(anchors)
    lips = poses(anchors, targets, random)
    tongue = np.array([t.target.tongue for t in targets]) * np.exp(random.normal(0, _TONGUE_SD, (len(targets), 1)))
    keys = [(time, row) for wait, row in zip(waits, lips, strict=True) for time in sorted(set(wait))]
    motion = Motion(
        anchors=np.array([time for time, _ in keys]),
        lips=np.stack([row for _, row in keys]),
        tongue_times=np.array([t.time for t in targets]),
        tongue=tongue,
        tremor=_oscillation(random, _TREMOR, len(LIPS), _TREMOR_BAND),
        sway=_oscillation(random, _SWAY[:, None], len(_SWAY), _SWAY_BAND),
        blinks=_blinks(random, alignment.end),
    )
    return motion, Tier("gestures", _gestures(anchors, waits, alignment.end))


def _waits(anchors: list[Anchor]) -> list[tuple[float, float]]:
    """Return for each anchor the interval in which the mouth stands still, so that no movement takes too long."""
    ends = [max(a.end, b.begin - _LONGEST) for a, b in pairwise(anchors)]
    return [(a.begin, end) for a, end in zip(anchors, [*ends, anchors[-1].end], strict=True)]


def _gestures(anchors: list[Anchor], waits: list[tuple[float, float]], end: float) -> list[tuple[float, float, str]]:
    """Return the segments between anchors; a held rest is one, and swallows a closure beside it, which nobody sees."""
    rows: list[tuple[float, float, str]] = []
    clock = 0.0
    for k, (anchor, (begin, finish)) in enumerate(zip(anchors, waits, strict=True)):
        still = anchor.shape == "rest" and finish - begin >= _REST_LEAST
        unseen = k > 0 and {anchors[k - 1].shape, anchor.shape} == {"rest", "closed"}
        arrival = begin if still else (begin + finish) / 2
        if k > 0:
            label = "rest" if unseen else f"{anchors[k - 1].shape}>{anchor.shape}"
            rows.append((clock, arrival, label))
        clock = arrival
        if still:
            rows.append((begin, finish, "rest"))
            clock = finish
    return _merged(rows, end)


def _merged(rows: list[tuple[float, float, str]], end: float) -> list[tuple[float, float, str]]:
    joined: list[tuple[float, float, str]] = []
    for begin, finish, label in rows:
        if joined and label == joined[-1][2] == "rest":
            joined[-1] = (joined[-1][0], finish, "rest")
        else:
            joined.append((begin, finish, label))
    joined[-1] = (joined[-1][0], end, joined[-1][2])
    return joined


def _course(times: np.ndarray, keys: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return values (F, A) on minimum-jerk courses between keys (K,) with values (K, A); held beyond the ends."""
    after = np.clip(np.searchsorted(keys, times, side="right"), 1, len(keys) - 1)
    start, length = keys[after - 1], keys[after] - keys[after - 1]
    s = np.clip((times - start) / length, 0, 1)[:, None]
    return values[after - 1] + (values[after] - values[after - 1]) * s**3 * (10 - 15 * s + 6 * s**2)


def _oscillation(
    random: np.random.Generator, size: float | np.ndarray, rows: int, band: tuple[float, float]
) -> np.ndarray:
    shape = (rows, 3)
    sizes = size / np.sqrt(1.5) * random.uniform(0.6, 1.4, shape)
    return np.stack([sizes, random.uniform(*band, shape), random.uniform(0, 2 * np.pi, shape)])


def _sines(times: np.ndarray, oscillation: np.ndarray) -> np.ndarray:
    size, frequency, phase = oscillation
    return (size * np.sin(2 * np.pi * frequency * times[:, None, None] + phase)).sum(axis=-1)


def _blinks(random: np.random.Generator, end: float) -> np.ndarray:
    times = np.cumsum(random.exponential(_BLINK_EVERY - 1, 8) + 1) - random.uniform(0, _BLINK_EVERY)
    return times[(times > 0.15) & (times < end - 0.15)]
