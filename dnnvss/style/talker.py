"""What is learnt of a talker's movement: variance, rest, and how far the lips go on the phones of a rule."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, check_arrays, read_declared
from dnnvss.errors import DnnvssError
from dnnvss.face.base import APERTURE, LOWER_LIP, Face, Gauge
from dnnvss.phones import BILABIALS, LABIODENTALS
from dnnvss.style.rules import PhoneRule, closure, level, phone_extremes, silent_frames, teeth_contact
from dnnvss.timing import FrameClock, Tier


@dataclass(frozen=True)
class LipRule:
    """A setting of a style that holds a gauge at the talker's own level on some phones.

    Args:
        gauge: the name of what is held; a face without it does without the rule.
        phones: on which it is held.
        said: the phones in words.
        rule: level to rule.
    """

    gauge: str
    phones: tuple[str, ...]
    said: str
    rule: Callable[[float], PhoneRule]


LIP_RULES = {"closures": LipRule(APERTURE, BILABIALS, "p, b or m", closure),
             "contacts": LipRule(LOWER_LIP, LABIODENTALS, "f or v", teeth_contact)}
"""Setting of a style to its rule."""
_REMEDY = "Train the run again"
_ARRAYS = {"natural": Held(("D",)), "rest": Held(("D",), finite=False), "rest_deviation": Held(("D",)),
           "gauges": Held(("gauges",), "U"), "own": Held(("D",), optional=True)}
_LEAST = 1e-3
"""Least deviation at rest, as a share of that in speech: a coefficient may stand still in silence."""
RAMP = 0.1
"""Seconds of silence beside speech in which the face is on its way: the dial fades out, and rest is not measured."""


@dataclass(frozen=True)
class Talker:
    """What is learnt from the talker's measured trajectories, for the dial, the lips and the face at rest.

    Args:
        natural: variance of each coefficient within an utterance's speech, geometric mean over utterances, (D,).
        rest: mean parameters in silence, (D,); NaN where there was none.
        rest_deviation: their standard deviation there, (D,).
        gauges: those of the face that rules hold, by name: ``aperture`` and ``lower_lip``, where it has them.
        levels: gauge to the value that half of the talker's phones of its rule reach, e.g. the aperture on p, b and m;
            NaN where there were none.
        own: variance of the model's own trajectories, as ``natural``, or None: then each utterance is scaled by its
            own.
    """

    natural: np.ndarray
    rest: np.ndarray
    rest_deviation: np.ndarray
    gauges: Mapping[str, Gauge]
    levels: Mapping[str, float]
    own: np.ndarray | None = None

    @classmethod
    def of(
        cls, references: Sequence[np.ndarray], tiers: Sequence[Tier], clock: FrameClock, face: Face
    ) -> "Talker":
        """Return what the training utterances tell.

        Args:
            references: measured trajectories (T, D).
            tiers: the phones tier of each.
            clock: of the trajectories.
            face: what the trajectories move.

        Raises:
            DnnvssError: no utterance, or none with speech.
        """
        natural = _typical(speech_variances(references, tiers, clock))
        silent = [silent_frames(tier, clock, len(x), RAMP, RAMP) for x, tier in zip(references, tiers, strict=True)]
        at_rest = np.concatenate([x[mask] for x, mask in zip(references, silent, strict=True)]).astype(float)
        if len(at_rest) < 2:
            at_rest = np.full((1, len(natural)), np.nan)
        held = [rule for rule in LIP_RULES.values() if rule.gauge in face.gauges]
        gauges = {rule.gauge: face.gauges[rule.gauge] for rule in held}

        def reached(rule: LipRule) -> float:
            tracks = [gauges[rule.gauge](x) for x in references]
            least = [phone_extremes(t, clock, rule.phones, x) for x, t in zip(tracks, tiers, strict=True)]
            return level(least) if sum(map(len, least)) else float("nan")

        spread = np.maximum(at_rest.std(axis=0), np.maximum(_LEAST * np.sqrt(natural), 1e-6))
        return cls(natural, at_rest.mean(axis=0), spread, gauges, {rule.gauge: reached(rule) for rule in held})

    @property
    def unknown(self) -> dict[str, str]:
        """The settings of a style that have no effect with this talker, and why."""
        reasons = {}
        for name, rule in LIP_RULES.items():
            if rule.gauge not in self.gauges:
                reasons[name] = f"this kind of face has no gauge {rule.gauge}"
            elif np.isnan(self.levels[rule.gauge]):
                reasons[name] = f"the talker's recordings hold no {rule.said}"
        return reasons | ({"rest": "the talker's recordings hold no silence"} if np.isnan(self.rest.sum()) else {})

    def knowing(self, predicted: Sequence[np.ndarray], references: Sequence[np.ndarray], tiers: Sequence[Tier],
                clock: FrameClock) -> "Talker":
        """Return the talker with ``own``, from what the model generates for held-out utterances beside what was
        measured.

        The ratio of the two variances is taken utterance by utterance, so that what happens to be said does not count.
        """
        ratio = _typical(speech_variances(predicted, tiers, clock) / speech_variances(references, tiers, clock))
        return replace(self, own=self.natural * ratio)

    def save(self, path: str | Path) -> Path:
        """Write ``.npz`` and return the path."""
        own = {} if self.own is None else {"own": self.own}
        gauges = {f"gauge_{name}": np.append(gauge.vector, gauge.constant) for name, gauge in self.gauges.items()}
        levels = {f"level_{name}": np.array(value) for name, value in self.levels.items()}
        units = {f"unit_{name}": np.array(gauge.unit) for name, gauge in self.gauges.items()}
        return files.write_arrays(path, natural=self.natural, rest=self.rest, rest_deviation=self.rest_deviation,
                                  gauges=np.array(list(self.gauges), dtype=str), **gauges, **levels, **units, **own)

    @classmethod
    def load(cls, path: str | Path) -> "Talker":
        """Return what :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing or damaged.
        """
        a = read_declared(path, _ARRAYS, _REMEDY, more=True)
        names = [str(name) for name in a["gauges"]]
        if unknown := [name for name in names if name not in {rule.gauge for rule in LIP_RULES.values()}]:
            raise DnnvssError(f"has a gauge {unknown[0]!r}, which no rule holds", file=path, remedy=_REMEDY)
        gauge, text, level = Held((len(a["natural"]) + 1,)), Held((), "U"), Held((), "f", finite=False)
        for name in names:
            held = {f"gauge_{name}": gauge, f"unit_{name}": text, f"level_{name}": level}
            check_arrays(a, held, path, _REMEDY)
        if not (a["natural"] > 0).all() or not (a.get("own", a["natural"]) > 0).all():
            raise DnnvssError("holds variances that are not above 0", file=path, remedy=_REMEDY)
        rows = {name: a[f"gauge_{name}"] for name in names}
        gauges = {n: Gauge(n, row[:-1], float(row[-1]), str(a[f"unit_{n}"])) for n, row in rows.items()}
        levels = {name: float(a[f"level_{name}"]) for name in names}
        return cls(a["natural"], a["rest"], a["rest_deviation"], gauges, levels, a.get("own"))


def speech_variances(trajectories: Sequence[np.ndarray], tiers: Sequence[Tier], clock: FrameClock) -> np.ndarray:
    """Return the variance of each coefficient within the speech of each utterance, shape (utterances, D), above zero.

    Raises:
        DnnvssError: no utterance holds two frames of speech.
    """
    cut = [np.asarray(x, float)[~silent_frames(t, clock, len(x))] for x, t in zip(trajectories, tiers, strict=True)]
    values = [x.var(axis=0) for x in cut if len(x) > 1]
    if not values:
        raise DnnvssError("no utterance holds speech, so its variance is not known", remedy="Check the phones tiers")
    return np.maximum(values, np.finfo(float).tiny)


def _typical(values: np.ndarray) -> np.ndarray:
    """Return the geometric mean over utterances (D,): ratios of variances are as often half as they are double."""
    return np.exp(np.log(values).mean(axis=0))
