"""Blinks: found in how far the eyes are open, and how often they come where."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.life.contexts import CONTEXTS

SINCE = (0.5, 1.0, 2.0)
"""Seconds since the last blink at which its pull on the next changes."""
CLOSEST = 0.2
"""Seconds from one blink's beginning in which no other begins: the lids are still moving."""
LONGEST = 0.8
"""Seconds; eyes that stay shut for longer do not blink."""
_SHUT_SHARE = 0.5
"""Percentile of the opening that is that of shut eyes: a talker's eyes are shut in 2 to 10 % of all frames."""
_LEAST_CLOSING = 0.3
"""How far eyes close in a blink at least, of their opening."""
_LOWERED, _SHUT = 0.1, 0.5
"""How far lids come down until they begin to count as shut, and wholly do, as shares of the way to half shut."""
_PRIOR = 2.0
"""Blinks that the usual rate weighs as many as in each context."""


@dataclass(frozen=True)
class Blink:
    """A blink in a track.

    Args:
        first, last: frames in which the eyes are more shut than open, the last included.
        seconds: between the two times at which the lids are half way, between frames by a straight line.
    """

    first: int
    last: int
    seconds: float


def blink_threshold(opening: np.ndarray) -> float | None:
    """Half way between open (1) and shut, from openings (F,) of many clips; None where eyes were never seen to shut."""
    known = opening[np.isfinite(opening)]
    if not len(known):
        return None
    shut = float(np.percentile(known, _SHUT_SHARE))
    return None if shut > 1 - _LEAST_CLOSING else (1 + shut) / 2


def shut_share(opening: np.ndarray, threshold: float | None) -> np.ndarray:
    """How far eyes count as shut (F,): 0 while they are open, rising smoothly to 1 well before half shut."""
    if threshold is None:
        return np.zeros(len(opening))
    x = np.clip(((1 - opening) / (1 - threshold) - _LOWERED) / (_SHUT - _LOWERED), 0, 1)
    return np.asarray(x * x * (3 - 2 * x))


def find_blinks(opening: np.ndarray, threshold: float, rate: float) -> list[Blink]:
    """The blinks of a clip.

    Args:
        opening: of the eyes (F,), 1 for open.
        threshold: between open and shut.
        rate: frames a second.
    """
    shut = np.concatenate([[0], (opening < threshold).astype(int), [0]])
    starts, stops = np.flatnonzero(np.diff(shut) == 1), np.flatnonzero(np.diff(shut) == -1) - 1
    found = []
    for first, last in zip(starts, stops, strict=True):
        if first == 0 or last == len(opening) - 1:
            continue  # begun before the clip, or not over with it: how long it lasts is not known
        down = _crossing(opening[first - 1], opening[first], threshold)
        up = _crossing(opening[last + 1], opening[last], threshold)
        seconds = (last - first + down + up) / rate
        if seconds <= LONGEST:
            found.append(Blink(int(first), int(last), float(seconds)))
    return found


def _crossing(outside: float, inside: float, threshold: float) -> float:
    """How far before the inner of two frames, in frames, a straight line crosses the threshold."""
    return float((threshold - inside) / max(outside - inside, 1e-9))


@dataclass(frozen=True)
class BlinkRates:
    """Blinks a second, by context and by time since the last blink: a product of two factors.

    Args:
        context: blinks a second (C,) in each of :data:`~dnnvss.life.contexts.CONTEXTS`.
        since: factor (S + 1,) between the times of :data:`SINCE`; the last also where no blink is known. Before
            :data:`CLOSEST` no blink begins.

    **Source**: a piecewise constant hazard, fitted by turns as marginals of counts and exposures (Deming and Stephan,
    Annals of Mathematical Statistics 11, 1940).
    """

    context: np.ndarray
    since: np.ndarray

    @classmethod
    def fit(cls, clips: Sequence[tuple[np.ndarray, list[Blink]]], rate: float) -> "BlinkRates":
        """The rates that clips show.

        Args:
            clips: context (F,) of the frames of each, and its blinks.
            rate: frames a second.
        """
        count, exposure = (np.zeros((len(CONTEXTS), len(SINCE) + 1)) for _ in range(2))
        for context, blinks in clips:
            since = _since(len(context), blinks, rate)
            awake = np.ones(len(context), bool)
            for blink in blinks:
                awake[blink.first + 1 : max(blink.last + 1, blink.first + round(CLOSEST * rate))] = False
                count[context[blink.first], since[blink.first]] += 1
            np.add.at(exposure, (context[awake], since[awake]), 1 / rate)
        usual = count.sum() / max(exposure.sum(), 1e-9)
        context, since = np.full(len(count), usual), np.ones(count.shape[1])
        for _ in range(20):
            context = (count.sum(1) + _PRIOR) / (exposure @ since + _PRIOR / max(usual, 1e-9))
            since = (count.sum(0) + _PRIOR) / (context @ exposure + _PRIOR)
        return cls(context, since)

    def draw(self, context: np.ndarray, rate: float, random: np.random.Generator, share: float = 1.0) -> np.ndarray:
        """Frames at which blinks begin, in rising order.

        Args:
            context: of each frame (F,).
            rate: frames a second.
            random: where chance comes from.
            share: of the talker's rate.
        """
        begun: list[int] = []
        chance = random.random(len(context))
        for frame, code in enumerate(context):
            since = np.inf if not begun else (frame - begun[-1]) / rate
            if since < CLOSEST:
                continue
            hazard = self.context[code] * self.since[np.searchsorted(SINCE, since, side="right")] * share
            if chance[frame] < 1 - np.exp(-hazard / rate):
                begun.append(frame)
        return np.array(begun, dtype=int)


def _since(frames: int, blinks: list[Blink], rate: float) -> np.ndarray:
    """Which factor of the time since the last blink's beginning holds at each frame (F,)."""
    last = np.full(frames, -np.inf)
    for blink in blinks:
        last[blink.first + 1 :] = blink.first
    return np.searchsorted(SINCE, (np.arange(frames) - last) / rate, side="right")
