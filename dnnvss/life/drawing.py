"""A life for an utterance: movements that the talker made in like places of speech, drawn by chance from a seed."""

from dataclasses import dataclass, replace
from zlib import crc32

import numpy as np

from dnnvss.life.tracks import Life, Tracks
from dnnvss.timing import FrameClock

_TRIED = 80
"""Places of the recordings that are compared where a new stretch begins."""
_JOIN = 0.4
"""Seconds over which one stretch gives way to the next."""
_BACK = 1.0
"""Time constant in seconds by which the head comes back from where another stretch had left it."""
_LEAST = 2.0
"""Seconds of a stretch that are compared with what is to be said, and that it lasts at least."""
_ALIKE = 4.0
"""What frames in another context cost, beside joins in deviations."""
_LEAD, _TAIL = 0.12, 0.5
"""Seconds before a blink begins, and after the lids are half open again, in which its own frames are shown."""
_MIX_IN, _MIX_OUT = 0.08, 0.3
"""Seconds over which these come and go."""


@dataclass(frozen=True)
class Moves:
    """How eyes and head move.

    Args:
        eyes: how far the eyes are told as they look, and the coefficients of their part model (F, 1 + K), see
            :class:`~dnnvss.life.tracks.Tracks`.
        head: (F, 4), see :class:`~dnnvss.life.tracks.Tracks`.
        blinks: frames, whole or not, at which blinks begin.
    """

    eyes: np.ndarray
    head: np.ndarray
    blinks: np.ndarray

    def at(self, source: FrameClock, target: FrameClock, frames: int) -> "Moves":
        """The same at another frame rate, by straight lines, which no lid overshoots.

        Args:
            source: the clock of these movements.
            target: the clock of the result.
            frames: how many of it.
        """
        own, wanted = source.centres(len(self.eyes)), target.centres(frames)
        eyes, head = (np.stack([np.interp(wanted, own, column).astype(np.float32) for column in track.T], axis=1)
                      for track in (self.eyes, self.head))
        return Moves(eyes, head, self.blinks * float(target.rate / source.rate))

    def part(self, which: slice) -> "Moves":
        """The movements of some of the frames."""
        return replace(self, eyes=self.eyes[which], head=self.head[which])


def draw_moves(life: Life, context: np.ndarray, seed: int, text: str = "", share: float = 1.0) -> Moves:
    """Movements for an utterance, the same for the same seed and text.

    Between blinks eyes, brows and head move as in recorded stretches that are chosen by chance among those whose place
    in speech is alike and which join well (**source**: motion fragments, Edge, Sanchez Lorenzo and Maddock 2004).
    Blinks come at the talker's rates (:class:`~dnnvss.life.blinks.BlinkRates`), each as one that was recorded.

    Args:
        life: of the talker.
        context: code (F,) of each frame, at the recordings' rate.
        seed: of chance.
        text: what is said, so that one seed gives other sentences other lives.
        share: 0 a still face, 1 as lively as the talker: how far eyes and head go, and how often the eyes blink.
    """
    frames, tracks = len(context), life.tracks
    stretches, blinks = (np.random.default_rng([seed, crc32(text.encode()), part]) for part in range(2))
    eyes, head = (np.zeros((frames, n), np.float32) for n in (1 + tracks.eyes.shape[1], 4))
    for start, at in _stretches(tracks, context, stretches):
        length = min(_left(tracks, at), frames - start)
        weight = (np.ones(length) if start == 0 else _ramp(length, _JOIN * tracks.rate))[:, None]
        here, there = slice(start, start + length), slice(at, at + length)
        eyes[here] += weight * (tracks.awake[there] - eyes[here])
        moved = _continued(tracks, there, head[start] if start else None)
        head[here] += weight * (moved - head[here])
    eyes *= share
    head *= share
    begun = life.rates.draw(context, tracks.rate, blinks, share) if tracks.recorded else np.array([], int)
    for frame in begun:
        _blink(eyes, tracks, int(frame), blinks)
    return Moves(eyes, head, begun)


def _continued(tracks: Tracks, there: slice, now: np.ndarray | None) -> np.ndarray:
    """The head in a stretch of the recordings (n, 4), begun where it is ``now`` (4,), and led back to where it was."""
    head = tracks.head[there]
    if now is None:
        return head
    return head + (now - head[0]) * np.exp(-np.arange(len(head)) / (_BACK * tracks.rate))[:, None]


def _left(tracks: Tracks, at: int) -> int:
    """Frames that the clip of a frame has from it on."""
    return int(tracks.edges[np.searchsorted(tracks.edges, at, side="right")]) - at


def _ramp(length: int, rise: float) -> np.ndarray:
    """Weights (length,) that rise smoothly to 1."""
    x = np.clip((np.arange(length) + 1) / max(rise, 1.0), 0, 1)
    return x * x * (3 - 2 * x)


def _stretches(tracks: Tracks, context: np.ndarray, random: np.random.Generator) -> list[tuple[int, int]]:
    """Pairs of frames, of the utterance and of the recordings, from which on the one goes as the other."""
    least, join = max(2, round(_LEAST * tracks.rate)), max(1, round(_JOIN * tracks.rate))
    longest = int(np.diff(tracks.edges).max())
    found: list[tuple[int, int]] = []
    start, now = 0, None
    while start < len(context):
        need = min(least, len(context) - start, longest)
        at = _best(tracks, context[start : start + need], now, random)
        found.append((start, at))
        step = max(1, _left(tracks, at) - join)
        start, now = start + step, at + step
    return found


def _best(tracks: Tracks, context: np.ndarray, now: int | None, random: np.random.Generator) -> int:
    """The best of some places of the recordings to go on from, by how alike speech is there and how eyes join."""
    left = np.concatenate([np.arange(clip.stop - clip.start, 0, -1) for clip in tracks])
    free = np.flatnonzero(left >= len(context))
    places = random.choice(free, min(_TRIED, len(free)), replace=False)
    codes = tracks.context[places[:, None] + np.arange(len(context))]
    cost = _ALIKE * (codes != context).mean(axis=1)
    if now is not None:
        now = min(now, len(tracks.opening) - 1)
        spread = np.maximum(tracks.awake.std(axis=0), 1e-9)
        cost += np.sqrt((((tracks.awake[places] - tracks.awake[now]) / spread) ** 2).mean(axis=1))
    return int(places[cost.argmin()])


def _blink(eyes: np.ndarray, tracks: Tracks, frame: int, random: np.random.Generator) -> None:
    """Lay a recorded blink, chosen by chance, over the eyes' movement (F, 1 + K), its first shut frame at ``frame``."""
    recorded, shut, weight = _recorded_blink(tracks, int(random.integers(len(tracks.recorded))))
    at = frame - shut + np.arange(len(recorded))
    inside = (at >= 0) & (at < len(eyes))
    eyes[at[inside]] += weight[inside, None] * (recorded[inside] - eyes[at[inside]])


def _recorded_blink(tracks: Tracks, which: int) -> tuple[np.ndarray, int, np.ndarray]:
    """The eyes (n, 1 + K) in a recorded blink, its first shut frame among them, and how much it counts (n,)."""
    clip, index = tracks.recorded[which]
    own, rate = tracks.blinks[list(tracks).index(clip)], tracks.rate
    blink = own[index]
    free = own[index - 1].last + 1 if index else 0
    stop = own[index + 1].first if index + 1 < len(own) else clip.stop - clip.start
    first, last = max(blink.first - round(_LEAD * rate), free), min(blink.last + round(_TAIL * rate), stop - 1)
    place = np.arange(last - first + 1)
    rise = (place + 1) / max(_MIX_IN * rate, 1.0)
    fall = (len(place) - place) / max(min(_MIX_OUT * rate, last - blink.last), 1.0)
    weight = np.clip(np.minimum(rise, fall), 0, 1)
    eyes = np.column_stack([tracks.whole[clip], tracks.eyes[clip]])[first : last + 1]
    return eyes, blink.first - first, weight**2 * (3 - 2 * weight)
