"""The moments at which the mouth arrives at a shape and turns to the next, and how far it gets.

**Source**: neighbouring targets are blended by dominance as in Cohen and Massaro, "Modeling coarticulation in synthetic
visual speech", 1993, sections 3 and 4.
"""

from dataclasses import dataclass, replace

import numpy as np

from dnnvss.corpus.talker.targets import GLIDES, LIPS, TARGETS, Target, shape_centre
from dnnvss.phones import SILENCES
from dnnvss.timing import Segment, Tier

_FORM = np.array([name not in ("jaw", "opening") for name in LIPS])  # the columns that lip_weight rules
_JAW_REACH = (0.045, 0.040)  # seconds over which a target is felt before and after its phone
_FORM_REACH = (0.095, 0.060)
_OWN = 0.4  # share of the blend at an anchor; the rest is the centre of its shape
_SETTLE = 0.035  # time constant of arriving: shorter movements undershoot
_LEAST, _LEAST_BESIDE_CLOSURE = 0.095, 0.062  # seconds between two anchors
_DECLINE = 0.16  # share of an excursion that is lost from the start of a phrase to its end
_EFFORT_SD, _COMMON_SD, _OWN_SD = 0.05, 0.06, 0.06  # of the log of an excursion: a sentence's, an anchor's, a column's
_TIME_SD, _CLOSURE_TIME_SD = 0.08, 0.05  # of when a target is reached, as a share of its phone


@dataclass(frozen=True)
class Anchor:
    """A target in time.

    Args:
        begin, end: when the mouth is in it, seconds; the same unless it is held (silences, double closures).
        target: what is asked for.
        place: where in the phrase it lies, 0 to 1.
    """

    begin: float
    end: float
    target: Target
    place: float = 0.0

    @property
    def time(self) -> float:
        """The middle, in seconds."""
        return (self.begin + self.end) / 2

    @property
    def shape(self) -> str:
        """The mouth shape that it counts as."""
        return self.target.shape

    @property
    def fixed(self) -> bool:
        """Whether it is always reached: closures, tucked lips and silences."""
        return self.target.salience >= 1 or self.target.shape == "rest"


def targets_in_time(phones: Tier, random: np.random.Generator) -> list[Anchor]:
    """Return the targets of all phones in order; a diphthong that travels has two, a silence is held.

    Where in its phone a target is reached varies by chance, less for closures than for vowels.
    """
    found: list[Anchor] = []
    begin = phones.start
    for s in phones:
        if s.label in SILENCES:
            found.append(_silence(s, phones))
            begin = s.end
            continue
        end = _phrase_end(s, phones)
        place = (s.start - begin) / (end - begin)
        if s.label in GLIDES:
            first, second = (TARGETS[name] for name in GLIDES[s.label])
            found.append(_point(s, 0.32, first, place, random))
            found.append(_point(s, 0.84, second._replace(salience=0.5), place, random))
        else:
            target = TARGETS[s.label]
            found.append(_point(s, 0.42 if target.salience >= 1 else 0.5, target, place, random))
    return found


def _point(s: Segment, share: float, target: Target, place: float, random: np.random.Generator) -> Anchor:
    sd = _CLOSURE_TIME_SD if target.salience >= 1 else _TIME_SD
    time = s.start + (share + sd * float(np.clip(random.normal(), -2, 2))) * s.duration
    return Anchor(time, time, target, place)


def _phrase_end(s: Segment, phones: Tier) -> float:
    return next((p.start for p in phones if p.start >= s.end and p.label in SILENCES), phones.end)


def _silence(s: Segment, phones: Tier) -> Anchor:
    """Return the rest of a silence; the mouth closes into it and leaves it before the sound begins."""
    begin = s.start if s.start == phones.start else s.start + min(0.12, 0.4 * s.duration)
    end = s.end if s.end == phones.end else s.end - min(0.14, 0.4 * s.duration)
    return Anchor(begin, end, TARGETS[s.label])


def separated(targets: list[Anchor]) -> list[Anchor]:
    """Return those at which the mouth has time to turn; neighbours of one shape become one anchor."""
    kept: list[Anchor] = []
    candidates = [t for t in targets if t.shape]
    for one in sorted(candidates, key=lambda t: (-t.fixed, -t.target.salience, t.time)):
        if one.fixed or all(_room(one, other) for other in kept):
            kept.append(one)
    merged: list[Anchor] = []
    for one in sorted(kept, key=lambda t: t.time):
        if merged and merged[-1].shape == one.shape:
            merged[-1] = _joined(merged[-1], one)
        else:
            merged.append(one)
    return merged


def _room(one: Anchor, other: Anchor) -> bool:
    least = _LEAST_BESIDE_CLOSURE if other.fixed and one.target.salience >= 0.4 else _LEAST
    return max(other.begin - one.time, one.time - other.end) >= least


def _joined(one: Anchor, two: Anchor) -> Anchor:
    """Return one anchor for two of a shape: closures are held from the first to the last, others meet by salience."""
    if one.fixed and two.fixed:
        return replace(one, end=two.end)
    a, b = one.target.salience, two.target.salience
    time = (a * one.time + b * two.time) / (a + b)
    return replace(one if a >= b else two, begin=time, end=time)


def poses(anchors: list[Anchor], targets: list[Anchor], random: np.random.Generator) -> np.ndarray:
    """Return the lips (K, 6) at each anchor.

    The blend of all targets by dominance, drawn towards the centre of the anchor's shape, scaled by effort, by decline
    over the phrase and by chance, and short of the target where there is little time to reach it.
    """
    effort = np.exp(random.normal(0, _EFFORT_SD))
    wanted = np.empty((len(anchors), len(LIPS)))
    for k, anchor in enumerate(anchors):
        centre = shape_centre(anchor.shape)
        chance = np.exp(random.normal(0, _COMMON_SD) + random.normal(0, _OWN_SD, len(LIPS)))
        decline = 1 + _DECLINE * (0.4 - anchor.place)
        pose = centre + _OWN * (_blended(anchor.time, targets) - centre)
        wanted[k] = 0 if anchor.shape == "rest" else pose * effort * decline * chance
    return _undershot(anchors, wanted)


def _blended(time: float, targets: list[Anchor]) -> np.ndarray:
    """Return the mean of all targets (6,), each weighted by its dominance at ``time``."""
    distance = np.array([min(time - t.begin, 0) + max(time - t.end, 0) for t in targets])
    values = np.array([t.target.lips for t in targets])
    means = []
    for (before, after), kind in ((_JAW_REACH, "jaw_weight"), (_FORM_REACH, "lip_weight")):
        reach = np.where(distance < 0, before, after)
        weight = np.array([getattr(t.target, kind) for t in targets]) * np.exp(-np.abs(distance) / reach)
        means.append(weight @ values / weight.sum())
    return np.where(_FORM, means[1], means[0])


def _undershot(anchors: list[Anchor], wanted: np.ndarray) -> np.ndarray:
    reached = wanted.copy()
    for k in range(1, len(anchors) - 1):
        if not anchors[k].fixed:
            gap = min(anchors[k].begin - anchors[k - 1].end, anchors[k + 1].begin - anchors[k].end)
            share = 1 - np.exp(-gap / _SETTLE)
            reached[k] = (wanted[k - 1] + wanted[k + 1]) / 2 * (1 - share) + wanted[k] * share
    return reached
