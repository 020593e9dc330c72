"""What is learnt of a talker's movement: variance, rest, and how far the lips go on the phones of a rule."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, check_arrays, read_declared
from dnnvss.curves.variance import STILL
from dnnvss.errors import DnnvssError
from dnnvss.face.base import APERTURE, LOWER_LIP, WIDTH, Face, Gauge
from dnnvss.phones import BILABIALS, LABIODENTALS
from dnnvss.style.rules import PhoneRule, closure, level, phone_extremes, silent_frames, teeth_contact
from dnnvss.style.within import Reach, reach_of
from dnnvss.timing import FrameClock, Tier


@dataclass(frozen=True)
class LipRule:
    """A setting of a style that holds a gauge at the talker's own level on some phones.

    Args:
        gauge: the name of what is held; a face without it does without the rule.
        phones: on which it is held.
        said: the phones in words.
        rule: level to rule.
        usual: the share of all frames of speech that lie below the level of a talker of whom nothing else is known.
        beside: softness, as a share of the gauge's range, in a phone in which an artist holds something else.
    """

    gauge: str
    phones: tuple[str, ...]
    said: str
    rule: Callable[[float], PhoneRule]
    usual: float
    beside: float = 0.0


_BESIDE = 0.2
LIP_RULES = {"closures": LipRule(APERTURE, BILABIALS, "p, b or m", closure, 0.05),
             "contacts": LipRule(LOWER_LIP, LABIODENTALS, "f or v", teeth_contact, 0.1, _BESIDE)}
"""Setting of a style to its rule."""
_LIMITED = (APERTURE, LOWER_LIP, WIDTH)
"""Gauges that stay within what the talker showed."""
_USUAL = 4.0
"""Phones that the usual level weighs as many as: a talker of ten clips has few of a kind, and each is off a little."""
_DOUBT = 1.0
"""Standard deviation of the logarithm of a model's variance over its talker's, before anything is measured."""
_SCATTER = 0.25
"""Variance of that logarithm between sentences, where there is but one."""
_FAINTEST = 1 / 9
"""A coefficient of which a model shows a smaller share of the variance is mostly noise: its gain stops at 3."""
_OPEN = 0.25
"""Share of the aperture's range above the closed level from which a silent mouth is open and not at rest."""
_REMEDY = "Train the run again"
_ARRAYS = {"natural": Held(("D",)), "rest": Held(("D",), finite=False), "rest_deviation": Held(("D",)),
           "gauges": Held(("gauges",), "U"), "own": Held(("D",), optional=True),
           "low": Held(("D",), optional=True), "high": Held(("D",), optional=True)}
_LEAST = 1e-3
"""Least deviation at rest, as a share of that in speech: a coefficient may stand still in silence."""
RAMP = 0.1
"""Seconds of silence beside speech in which the face is on its way: the dial fades out, and rest is not measured."""


@dataclass(frozen=True)
class Talker:
    """What is learnt from the talker's measured trajectories, for the dial, the lips and the face at rest.

    Args:
        natural: variance of each coefficient within an utterance's speech, geometric mean over utterances, (D,).
        rest: mean parameters in silence with the mouth closed, (D,); with an open one where it never closed; NaN where
            there was no silence.
        rest_deviation: their standard deviation there, (D,).
        gauges: those of the face that rules hold, by name: ``aperture`` and ``lower_lip``, where it has them.
        levels: gauge to the value that half of the talker's phones of its rule reach, e.g. the aperture on p, b and m;
            NaN where there were none. Few phones are shrunk towards what is usual in all of the talker's speech.
        own: variance of the model's own trajectories, as ``natural``, or None: then each utterance is scaled by its
            own. Few sentences are shrunk towards ``natural``, in which the dial changes nothing.
        reach: what the measured frames reach; None where it was not kept.
    """

    natural: np.ndarray
    rest: np.ndarray
    rest_deviation: np.ndarray
    gauges: Mapping[str, Gauge]
    levels: Mapping[str, float]
    own: np.ndarray | None = None
    reach: Reach | None = None

    @classmethod
    def of(
        cls, references: Sequence[np.ndarray], tiers: Sequence[Tier], clock: FrameClock, face: Face,
        valid: Sequence[np.ndarray] | None = None,
    ) -> "Talker":
        """Return what the training utterances tell.

        Args:
            references: measured trajectories (T, D).
            tiers: the phones tier of each.
            clock: of the trajectories.
            face: what the trajectories move.
            valid: frames (T,) of each that were measured; all where None.

        Raises:
            DnnvssError: no utterance, or none with speech.
        """
        known = [np.ones(len(x), bool) for x in references] if valid is None else list(valid)
        natural = _typical(speech_variances(references, tiers, clock, known))
        silent = [silent_frames(tier, clock, len(x), RAMP, RAMP) & own
                  for x, tier, own in zip(references, tiers, known, strict=True)]
        at_rest = np.concatenate([x[mask] for x, mask in zip(references, silent, strict=True)]).astype(float)
        if len(at_rest) < 2:
            at_rest = np.full((1, len(natural)), np.nan)
        gauges = {name: face.gauges[name] for name in _LIMITED if name in face.gauges}
        reach = reach_of([x[own] for x, own in zip(references, known, strict=True)], gauges)
        levels = {rule.gauge: _level(rule, gauges[rule.gauge], references, tiers, clock, known)
                  for rule in LIP_RULES.values() if rule.gauge in gauges}
        spread = np.fmax(at_rest.std(axis=0), np.maximum(_LEAST * np.sqrt(natural), 1e-6))  # NaN without silence
        return cls(natural, _closed(at_rest, reach, levels).mean(axis=0), spread, gauges, levels, reach=reach)

    def held(self, rule: LipRule) -> PhoneRule:
        """A rule at this talker's level."""
        low, high = self.reach.spans.get(rule.gauge, (0.0, 0.0)) if self.reach else (0.0, 0.0)
        return replace(rule.rule(self.levels[rule.gauge]), beside=rule.beside * (high - low))

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
                clock: FrameClock, valid: Sequence[np.ndarray] | None = None) -> "Talker":
        """Return the talker with ``own``, from what the model generates for held-out utterances beside what was
        measured.

        The ratio of the two variances is taken utterance by utterance, so that what happens to be said does not count.
        Its logarithm is shrunk to 0 by ``d / (d + s / n)``: ``n`` utterances, ``s`` their variance, ``d`` its variance
        among models before anything is known (an empirical Bayes estimate, James and Stein 1961). A ratio under
        :data:`_FAINTEST` counts as that. An utterance in which a coefficient of the talker stands still, as a curve of
        a rig may, tells no ratio of it; where none tells one, as where none holds speech, it is 1.
        """
        shown, true = (_variances(x, tiers, clock, valid) for x in (predicted, references))
        told = true > STILL * self.natural
        count = told.sum(axis=0)
        ratios = np.where(told, np.log(shown / true), 0.0)
        mean = ratios.sum(axis=0) / np.maximum(count, 1)
        off = (np.where(told, ratios - mean, 0.0) ** 2).sum(axis=0)
        scatter = np.where(count > 1, off / np.maximum(count - 1, 1), _SCATTER)
        certain = _DOUBT**2 / (_DOUBT**2 + scatter / np.maximum(count, 1))
        return replace(self, own=self.natural * np.maximum(np.exp(certain * mean), _FAINTEST))

    def save(self, path: str | Path) -> Path:
        """Write ``.npz`` and return the path."""
        own = {} if self.own is None else {"own": self.own}
        if self.reach:
            spans = {f"span_{name}": np.array(span) for name, span in self.reach.spans.items()}
            own |= {"low": self.reach.low, "high": self.reach.high, **spans}
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
        if unknown := [name for name in names if name not in _LIMITED]:
            raise DnnvssError(f"has a gauge {unknown[0]!r}, which no rule holds", file=path, remedy=_REMEDY)
        gauge, text, level = Held((len(a["natural"]) + 1,)), Held((), "U"), Held((), "f", finite=False)
        ruled = [name for name in names if name in {rule.gauge for rule in LIP_RULES.values()}]
        for name in names:
            held = {f"gauge_{name}": gauge, f"unit_{name}": text}
            held |= {f"level_{name}": level} if name in ruled else {}
            held |= {f"span_{name}": Held((2,))} if "low" in a else {}
            check_arrays(a, held, path, _REMEDY)
        if not (a["natural"] > 0).all() or not (a.get("own", a["natural"]) > 0).all():
            raise DnnvssError("holds variances that are not above 0", file=path, remedy=_REMEDY)
        rows = {name: a[f"gauge_{name}"] for name in names}
        gauges = {n: Gauge(n, row[:-1], float(row[-1]), str(a[f"unit_{n}"])) for n, row in rows.items()}
        levels = {name: float(a[f"level_{name}"]) for name in ruled}
        reach = _reach(a, gauges, path) if "low" in a else None
        return cls(a["natural"], a["rest"], a["rest_deviation"], gauges, levels, a.get("own"), reach)


def _reach(arrays: Mapping[str, np.ndarray], gauges: Mapping[str, Gauge], path: str | Path) -> Reach:
    """The ranges among the arrays of a file.

    Raises:
        DnnvssError: some are missing or empty.
    """
    check_arrays(dict(arrays), {"high": Held(arrays["low"].shape)}, path, _REMEDY)
    spans = {name: (float(arrays[f"span_{name}"][0]), float(arrays[f"span_{name}"][1])) for name in gauges}
    if (arrays["low"] > arrays["high"]).any() or any(low > high for low, high in spans.values()):
        raise DnnvssError("holds ranges that are empty", file=path, remedy=_REMEDY)
    return Reach(arrays["low"], arrays["high"], gauges, spans)


def _level(rule: LipRule, gauge: Gauge, references: Sequence[np.ndarray], tiers: Sequence[Tier], clock: FrameClock,
           known: Sequence[np.ndarray]) -> float:
    """What half of the talker's phones of a rule reach, few of them shrunk to what is usual; NaN without any."""
    tracks = [np.where(own, gauge(x), np.nan) for x, own in zip(references, known, strict=True)]
    least = [phone_extremes(t, clock, rule.phones, x) for x, t in zip(tracks, tiers, strict=True)]
    reached = np.concatenate([e[np.isfinite(e)] for e in least]) if least else np.zeros(0)
    if not len(reached):
        return float("nan")
    spoken = np.concatenate([x[~silent_frames(t, clock, len(x))] for x, t in zip(tracks, tiers, strict=True)])
    usual = float(np.nanquantile(spoken, rule.usual))
    return (len(reached) * level([reached]) + _USUAL * usual) / (len(reached) + _USUAL)


def _closed(at_rest: np.ndarray, reach: Reach, levels: Mapping[str, float]) -> np.ndarray:
    """The silent frames (n, D) in which the mouth is closed; all of them where it never is, or nothing tells."""
    if APERTURE not in reach.spans or np.isnan(levels.get(APERTURE, np.nan)):
        return at_rest
    low, high = reach.spans[APERTURE]
    closed = reach.gauges[APERTURE](at_rest) <= levels[APERTURE] + _OPEN * (high - low)
    return at_rest[closed] if closed.any() else at_rest


def speech_variances(trajectories: Sequence[np.ndarray], tiers: Sequence[Tier], clock: FrameClock,
                     valid: Sequence[np.ndarray] | None = None) -> np.ndarray:
    """Return the variance of each coefficient within the speech of each utterance, shape (utterances, D), above zero.

    Frames that are not ``valid`` (T,) of each take no part; an utterance without two frames of speech is left out.

    Raises:
        DnnvssError: no utterance holds two frames of speech.
    """
    values = _variances(trajectories, tiers, clock, valid)
    if not len(values):
        raise DnnvssError("no utterance holds speech, so its variance is not known", remedy="Check the phones tiers")
    return values


def _variances(trajectories: Sequence[np.ndarray], tiers: Sequence[Tier], clock: FrameClock,
               valid: Sequence[np.ndarray] | None) -> np.ndarray:
    """As :func:`speech_variances`, without a row where no utterance holds speech."""
    known = [np.ones(len(x), bool) for x in trajectories] if valid is None else valid
    cut = [np.asarray(x, float)[own & ~silent_frames(t, clock, len(x))]
           for x, t, own in zip(trajectories, tiers, known, strict=True)]
    values = [x.var(axis=0) for x in cut if len(x) > 1]
    columns = trajectories[0].shape[1] if len(trajectories) else 0
    return np.maximum(np.reshape(values, (len(values), columns)), np.finfo(float).tiny)


def _typical(values: np.ndarray) -> np.ndarray:
    """Return the geometric mean over utterances (D,): ratios of variances are as often half as they are double."""
    return np.exp(np.log(values).mean(axis=0))
