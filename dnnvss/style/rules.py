"""Ready-made constraints from phones: lips that close, lips at the teeth, a mouth at rest in silence."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from dnnvss.curves.constraints import Constraints, hold
from dnnvss.curves.equations import precision_of
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Gauge
from dnnvss.phones import BILABIALS, LABIODENTALS, SILENCES
from dnnvss.timing import FrameClock, Tier


@dataclass(frozen=True)
class PhoneRule:
    """A range that a gauge must lie in while some phones last.

    Args:
        name: a word for messages.
        phones: labels of the phones tier.
        low, high: the range, in the gauge's unit.
        part: from where to where in the phone, as shares of its duration. The frames whose centres lie in it are held,
            and at least the one nearest to its middle.
        softness: 0 holds it, a positive number in the gauge's unit gives way.
        beside: the softness in a phone in which the caller holds something else: a lower lip at the teeth would pull
            the upper one up under a key that opens the mouth.
    """

    name: str
    phones: tuple[str, ...]
    low: float = -np.inf
    high: float = np.inf
    part: tuple[float, float] = (0.25, 0.75)
    softness: float = 0.0
    beside: float = 0.0

    def constraints(self, tier: Tier, clock: FrameClock, gauge: Gauge, frames: int,
                    first: Constraints | None = None) -> Constraints:
        """Return the constraints of an utterance of ``frames`` frames; labels say phone and time.

        Args:
            tier: the phones tier.
            clock: the trajectory clock.
            gauge: what is measured.
            frames: T.
            first: constraints that come first: a phone in which one of them, or the hard ones of a frame together, ask
                the gauge, in whatever unit, for values outside the rule's range is left to them, and where one asks for
                anything the rule is as soft as ``beside`` says.
        """
        held, soft, labels = [np.zeros(0, np.int64)], [np.zeros(0)], list[str]()
        for segment, at in phone_frames(tier, clock, self.phones, frames, self.part):
            if first is not None and len(first) and self._forbidden(first, gauge, at):
                continue
            others = first is not None and bool(np.isin(first.frames, at).any())
            held.append(at)
            soft.append(np.full(len(at), max(self.softness, self.beside if others else 0.0)))
            labels += [f"{self.name} on {segment.label} at {segment.start:.2f} s"] * len(at)
        return hold(np.concatenate(held), gauge.vector, gauge.constant, low=self.low, high=self.high,
                    softness=np.concatenate(soft), label=labels)

    def _forbidden(self, first: Constraints, gauge: Gauge, at: np.ndarray) -> bool:
        there = np.isin(first.frames, at) & (first.streams == 0)
        for frame in np.unique(first.frames[there]):
            own = np.flatnonzero(there & (first.frames == frame))
            for rows in (own[first.softness[own] == 0], *own[:, None]):
                least, most = _implied(first, rows, gauge)
                if least > self.high or most < self.low:
                    return True
        return False


def _implied(constraints: Constraints, rows: np.ndarray, gauge: Gauge) -> tuple[float, float]:
    """The range in which some constraints of one frame together hold a gauge; all numbers where they leave it free."""
    if not len(rows):
        return -np.inf, np.inf
    vectors = constraints.vectors[rows]
    shares = np.linalg.lstsq(vectors.T, gauge.vector, rcond=None)[0]
    if np.abs(shares @ vectors - gauge.vector).max() > 1e-9 * np.abs(gauge.vector).max():
        return -np.inf, np.inf
    counts = np.abs(shares) > 1e-9 * np.abs(shares).max()
    ends = shares[counts] * np.stack([constraints.low[rows], constraints.high[rows]])[:, counts]
    return float(ends.min(axis=0).sum() + gauge.constant), float(ends.max(axis=0).sum() + gauge.constant)


def closure(closed: float, **changes: object) -> PhoneRule:
    """Return the rule that the aperture is at most ``closed`` in the middle of p, b and m."""
    return PhoneRule("lip closure", BILABIALS, high=closed, **changes)  # type: ignore[arg-type]


def teeth_contact(raised: float, **changes: object) -> PhoneRule:
    """Return the rule that the lower lip is at ``raised`` or higher in the middle of f and v."""
    return PhoneRule("lip at teeth", LABIODENTALS, high=raised, **changes)  # type: ignore[arg-type]


def phone_frames(
    tier: Tier, clock: FrameClock, phones: Iterable[str], frames: int, part: tuple[float, float] = (0.0, 1.0)
) -> list[tuple]:
    """Return (segment, frames) of every segment with one of the labels; frames lie in a part of it, one at least.

    Args:
        tier: the phones tier; its start is frame 0.
        clock: the trajectory clock.
        phones: labels.
        frames: T; what lies behind is left out.
        part: shares of the duration.
    """
    wanted, found = set(phones), []
    for segment in tier:
        if segment.label not in wanted:
            continue
        begin, end = (segment.start - tier.start + share * segment.duration for share in part)
        # frame i is in when its centre (i + 0.5) / rate is: edges of half-open intervals of centres
        first, last = (int(np.ceil(t * float(clock.rate) - 0.5 - 1e-9)) for t in (begin, end))
        middle = int(0.5 * (begin + end) * float(clock.rate))
        inside = np.arange(first, last) if last > first else np.array([middle])
        inside = inside[(inside >= 0) & (inside < frames)]
        if len(inside):
            found.append((segment, inside))
    return found


def phone_extremes(
    tier: Tier, clock: FrameClock, phones: Iterable[str], values: np.ndarray, lowest: bool = True
) -> np.ndarray:
    """Return the least (or greatest) of ``values`` (T,) within each segment with one of the labels, shape
    (segments,)."""
    pick = np.min if lowest else np.max
    return np.array([pick(values[at]) for _, at in phone_frames(tier, clock, phones, len(values))])


def level(extremes: Sequence[np.ndarray] | np.ndarray, share: float = 0.5) -> float:
    """Return the value that a share of the talker's own phones stay below, from :func:`phone_extremes` of many
    utterances.

    Raises:
        DnnvssError: the talker never spoke such a phone.
    """
    values = np.concatenate([np.ravel(e) for e in extremes]) if len(extremes) else np.zeros(0)
    if not len(values):
        raise DnnvssError("the talker never spoke a phone of this kind, so its level is not known",
                          remedy="Give the level as a number, or leave the rule out")
    return float(np.quantile(values, share))


def rest_in_silence(
    mean: np.ndarray,
    variance: np.ndarray,
    tier: Tier,
    clock: FrameClock,
    rest: np.ndarray,
    deviation: np.ndarray | float,
    anticipation: float = 0.15,
    release: float = 0.15,
) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and variance (T, W, D) in which silence pulls the face to rest; :func:`mlpg` then joins both.

    In each frame of silence the static stream is joined with an observation of ``rest`` of the given deviation, and
    the other streams with observations of no movement whose deviation has the same ratio to their own. The mouth stays
    free for ``release`` seconds after speech and ``anticipation`` seconds before it.

    Args:
        mean, variance: the prediction; variance broadcasts to (T, W, D).
        tier: the phones tier.
        clock: the trajectory clock.
        rest: (D,), the talker's rest, e.g. the mean over silent training frames.
        deviation: the softness of the pull in parameter units, a number or (D,).
        anticipation, release: seconds.

    Raises:
        DnnvssError: a deviation or a variance that is not positive.
    """
    at = silent_frames(tier, clock, len(mean), anticipation, release)
    return pulled_to_rest(mean, variance, at, rest, deviation)


def pulled_to_rest(mean: np.ndarray, variance: np.ndarray, at: np.ndarray, rest: np.ndarray,
                   deviation: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance (T, W, D) as :func:`rest_in_silence` gives them.

    Args:
        mean, variance, rest, deviation: as there.
        at: (T,) bool, the frames that are pulled.
    """
    pull = np.broadcast_to(np.asarray(deviation, float), mean.shape[2:])
    if not (pull > 0).all():
        raise DnnvssError(f"a pull to rest of deviation {pull.min()} was asked for", remedy="Give a positive deviation")
    mean = np.array(mean, dtype=float)
    precision_of(variance, mean.shape)  # names a variance that cannot be used
    variance = np.array(np.broadcast_to(variance, mean.shape), dtype=float)
    trust = 1.0 / (1.0 + pull**2 / variance[at, 0])  # the share of the pull in the joined observation
    for w in range(mean.shape[1]):
        target = rest if w == 0 else 0.0
        mean[at, w] = (1 - trust) * mean[at, w] + trust * target
        variance[at, w] = trust * pull**2 if w == 0 else variance[at, w] * np.where(trust < 1, 1 - trust, 1.0)
    return mean, variance


def silent_frames(
    tier: Tier, clock: FrameClock, frames: int, anticipation: float = 0.0, release: float = 0.0
) -> np.ndarray:
    """Return (T,) bool, the frames of silence less ``release`` seconds after speech and ``anticipation`` before it."""
    mask = np.zeros(frames, dtype=bool)
    for silent, row in groupby(tier, key=lambda segment: segment.label in SILENCES):
        segments = list(row)  # a short pause and a silence behind it are one
        start = segments[0].start + (release if segments[0] is not tier[0] else 0.0)
        end = segments[-1].end - (anticipation if segments[-1] is not tier[-1] else 0.0)
        if silent and end > start:
            first, last = clock.edges(np.array([start, end]) - tier.start)
            mask[max(first, 0) : last] = True
    return mask
