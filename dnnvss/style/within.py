"""Movement that stays within what the talker showed: a smooth limit, and what keys ask beyond it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.curves.constraints import Constraints, hold
from dnnvss.face.base import Gauge

OVER = 0.05
"""Share of a range by which movement may pass its ends, in the limit: within it the bend is smooth."""
_SAME = 0.01  # share of OVER of a range by which two trajectories may differ and pass it alike
_ROUNDS = 3
"""Between coefficients and gauges; each spoils a little of the other."""


@dataclass(frozen=True)
class Reach:
    """The least and greatest values that a talker's measured frames have.

    Args:
        low, high: of each coefficient, (D,).
        gauges: those of the face that are limited, by name.
        spans: the same of each of these gauges, by name.
    """

    low: np.ndarray
    high: np.ndarray
    gauges: Mapping[str, Gauge]
    spans: Mapping[str, tuple[float, float]]

    def widened(self, factor: float) -> "Reach":
        """The ranges ``factor`` times as wide about their middles: what an exaggerating dial asks for."""
        if factor == 1:
            return self
        low, high = _wider(self.low, self.high, factor)
        least, most = (np.array([span[end] for span in self.spans.values()]) for end in (0, 1))
        ends = zip(*(side.tolist() for side in _wider(least, most, factor)), strict=True)
        return Reach(low, high, self.gauges, dict(zip(self.spans, ends, strict=True)))

    def limited(self, x: np.ndarray) -> np.ndarray:
        """The trajectory (T, D) inside the ranges, in the dtype of ``x``; itself, bit for bit, where it is inside.

        A value ``v`` beyond the end ``b`` of a range of width ``r`` becomes ``b + d (1 - exp((b - v) / d))`` with ``d =
        OVER r``, which joins the unbent part with the same slope. A gauge is brought to its value by the change of the
        coefficients that is least in their ranges' measure.
        """
        if not self._beyond(x):
            return x
        bent = np.asarray(x, float)
        for _ in range(_ROUNDS):
            bent = _bent(bent, self.low, self.high)
            for name, (low, high) in self.spans.items():
                gauge = self.gauges[name]
                value = gauge(bent)
                step = self._way(gauge)
                bent = bent + (_bent(value, low, high) - value)[:, None] * step
        return bent.astype(x.dtype)

    def constraints(self, x: np.ndarray, beside: np.ndarray | None = None) -> list[Constraints]:
        """Soft constraints for the frames of a trajectory (T, D) that pass a range by more than :data:`OVER` of it.

        Args:
            x: the trajectory.
            beside: another (T, D): frames that pass the range no further than it does are left alone.
        """
        over = OVER * (self.high - self.low)
        found = []
        far = _past(x, self.low, self.high, over)
        if beside is not None:
            far &= _excess(x, self.low, self.high) > _excess(beside, self.low, self.high) + _SAME * over
        for d in np.flatnonzero(far.any(axis=0) & (over > 0)):
            found.append(hold(np.flatnonzero(far[:, d]), np.eye(len(over))[d], low=self.low[d], high=self.high[d],
                              softness=over[d] / 2, label=f"range of coefficient {d + 1}"))
        for name, (low, high) in self.spans.items():
            gauge, margin = self.gauges[name], OVER * (high - low)
            value = gauge(x)
            out = _past(value, low, high, margin)
            if beside is not None:
                out &= _excess(value, low, high) > _excess(gauge(beside), low, high) + _SAME * margin
            frames = np.flatnonzero(out)
            if len(frames) and margin > 0:
                found.append(hold(frames, gauge.vector, gauge.constant, low=low, high=high, softness=margin / 2,
                                  label=f"range of {name}"))
        return found

    def range_of(self, name: str, names: Sequence[str]) -> tuple[float, float] | None:
        """The range of a gauge or, among ``names``, of a coefficient; None where it is not known."""
        if name in self.spans:
            return self.spans[name]
        if name in names:
            return float(self.low[names.index(name)]), float(self.high[names.index(name)])
        return None

    def _beyond(self, x: np.ndarray) -> bool:
        outside = (x > self.high) | (x < self.low)
        return bool(outside.any()) or any(bool(((v < a) | (v > b)).any()) for v, (a, b) in
                                          ((self.gauges[n](x), span) for n, span in self.spans.items()))

    def _way(self, gauge: Gauge) -> np.ndarray:
        """The change of the coefficients (D,) that moves a gauge by 1."""
        weight = np.maximum(self.high - self.low, 1e-12) ** 2 * gauge.vector
        return weight / max(float(weight @ gauge.vector), 1e-300)


def reach_of(trajectories: Sequence[np.ndarray], gauges: Mapping[str, Gauge]) -> Reach:
    """What measured trajectories (T, D) reach; at least one frame."""
    ends = [(x.min(axis=0), x.max(axis=0)) for x in trajectories if len(x)]
    low, high = np.min([a for a, _ in ends], axis=0), np.max([b for _, b in ends], axis=0)
    spans = {}
    for name, gauge in gauges.items():
        values = [gauge(x) for x in trajectories if len(x)]
        spans[name] = (float(min(v.min() for v in values)), float(max(v.max() for v in values)))
    return Reach(np.asarray(low, float), np.asarray(high, float), dict(gauges), spans)


def _excess(values: np.ndarray, low: np.ndarray | float, high: np.ndarray | float) -> np.ndarray:
    """By how much values lie outside a range; 0 inside."""
    return np.maximum(np.maximum(values - high, low - values), 0)


def _past(values: np.ndarray, low: np.ndarray | float, high: np.ndarray | float, margin: np.ndarray | float
          ) -> np.ndarray:
    """Whether values lie outside a range by more than a margin."""
    return np.asarray(_excess(values, low, high) > margin)


def _wider(low: np.ndarray, high: np.ndarray, factor: float) -> tuple[np.ndarray, np.ndarray]:
    middle, half = (low + high) / 2, (high - low) / 2
    return middle - factor * half, middle + factor * half


def _bent(values: np.ndarray, low: np.ndarray | float, high: np.ndarray | float) -> np.ndarray:
    """Values whose parts beyond a range approach :data:`OVER` of its width, with the slope 1 at its ends."""
    room = np.maximum(OVER * (np.asarray(high) - low), 1e-12)
    above, below = np.maximum(values - high, 0), np.maximum(low - values, 0)
    inside = np.clip(values, low, high)
    return inside - room * np.expm1(-above / room) + room * np.expm1(-below / room)
