"""Edited curves as keys: what an artist changed in a spreadsheet or another tool, and nothing else.

Each curve is a gauge of the face, or moves gauges by known amounts, so that a changed value becomes
a value that a gauge is held to. The change is added to what the run says now; it comes and goes over
the easing, in keys that give way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.style.keys import Key
from dnnvss.timing import FrameClock, Tier

MOST_KEYS = 20_000
_SAME = 2e-5
"""Share of a curve's size by which a cell may differ and be the same, as files round."""


@dataclass(frozen=True)
class Change:
    """How a curve was changed.

    Args:
        name: of the gauge.
        now: what it measures (F,) without the change.
        wanted: what it is to measure (F,).
        size: by which changes are judged: what the curve moves in all.
    """

    name: str
    now: np.ndarray
    wanted: np.ndarray
    size: float

    @property
    def changed(self) -> np.ndarray:
        """Frames (F,) bool that were edited."""
        return np.abs(self.wanted - self.now) > _SAME * max(self.size, 1e-9)


def edited_keys(
    changes: Sequence[Change], clock: FrameClock, tier: Tier | None, easing: float = 0.08
) -> list[Key]:
    """Keys that hold what was edited, a frame each, anchored to the phones they fall into.

    Round each run of edited frames the first and the last difference fade, as the half of a cosine, over the easing;
    keys there give way the more the further they are.

    Args:
        changes: of gauges.
        clock: of the curves.
        tier: the phones tier, so that keys find their places when the same words are spoken at other times.
        easing: seconds.

    Raises:
        DnnvssError: more than :data:`MOST_KEYS`.
    """
    keys: list[Key] = []
    reach = round(easing * float(clock.rate))
    for change in changes:
        held = np.flatnonzero(change.changed)
        for run in np.split(held, np.flatnonzero(np.diff(held) > 1) + 1) if len(held) else []:
            keys += [_key(change, k, change.wanted[k], 0.0, clock, tier) for k in run.tolist()]
            for edge, step in ((run[0], -1), (run[-1], 1)):
                keys += _eased(change, int(edge), step, reach, clock, tier)
    if len(keys) > MOST_KEYS:
        raise DnnvssError(
            f"{len(keys):,} values were edited, and {MOST_KEYS:,} keys are the most",
            remedy="Edit fewer curves or frames, or export at a lower rate",
        )
    return keys


def _eased(
    change: Change, edge: int, step: int, reach: int, clock: FrameClock, tier: Tier | None
) -> list[Key]:
    """Keys that give way, beside an edge of edited frames."""
    keys, changed = [], change.changed
    difference = change.wanted[edge] - change.now[edge]
    for away in range(1, reach):
        k = edge + step * away
        if not 0 <= k < len(changed) or changed[k]:
            break
        share = 0.5 + 0.5 * np.cos(np.pi * away / reach)
        softness = max(change.size, abs(difference)) * (1 - share + 0.05)
        keys.append(_key(change, k, change.now[k] + share * difference, softness, clock, tier))
    return keys


def _key(
    change: Change, k: int, value: float, softness: float, clock: FrameClock, tier: Tier | None
) -> Key:
    time = float(clock.centres(k + 1)[k])
    value, softness = round(float(value), 6), round(float(softness), 6)
    found = (
        next((i for i, s in enumerate(tier) if s.start <= time + tier.start < s.end), None)
        if tier
        else None
    )
    if tier is None or found is None:
        return Key(round(time, 6), change.name, value, value, softness=softness)
    segment = tier[found]
    position = (time + tier.start - segment.start) / segment.duration
    return Key(
        round(time, 6),
        change.name,
        value,
        value,
        softness=softness,
        phone=segment.label,
        index=found,
        position=round(position, 6),
    )


def changes_of(
    edited: Mapping[str, np.ndarray],
    told: Mapping[str, np.ndarray],
    gauges: Mapping[str, np.ndarray],
    moves: Mapping[str, Mapping[str, float]],
) -> list[Change]:
    """What was changed of each gauge.

    Args:
        edited: curves (F,) by name, as they came back.
        told: the same curves as they are said without the edits; curves that only one of the two has are left.
        gauges: what each gauge measures now (F,).
        moves: curve to the gauges that it moves, and by how much for a change of 1; a gauge moves itself.

    Raises:
        DnnvssError: no curve is known, or the edited ones have other numbers of frames.
    """
    lower = {name.lower(): name for name in told}
    wanted = {name: track.copy() for name, track in gauges.items()}
    sizes = {name: float(np.ptp(track)) if len(track) else 0.0 for name, track in gauges.items()}
    known = 0
    for name, track in edited.items():
        own = lower.get(name.lower())
        if own is None:
            continue
        known += 1
        if len(track) != len(told[own]):
            raise DnnvssError(
                f"{name} has {len(track)} frames, and what is said now has {len(told[own])}",
                remedy="Give the text, times and rate that the curves were exported with",
            )
        difference = track - told[own]
        difference = np.where(
            np.abs(difference) > _SAME * max(float(np.abs(told[own]).max()), 1e-9), difference, 0
        )
        if own not in moves and own in wanted:  # a curve that is shown as 0 below 0 is wanted where it was put
            wanted[own] = np.where(difference != 0, track, wanted[own])
        for gauge, share in moves.get(own, {}).items():
            if gauge in wanted:
                wanted[gauge] += share * difference
    if not known:
        raise DnnvssError(
            f"none of the curves {', '.join(list(edited)[:5])} is known here",
            remedy=f"Use some of {', '.join(list(told)[:8])}",
        )
    return [Change(name, gauges[name], wanted[name], sizes[name]) for name in gauges]
