"""From a prediction to the trajectory that is shown: the steps of this room in their order, by settings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.curves.constraints import Constraints, constrain
from dnnvss.curves.mlpg import mlpg
from dnnvss.curves.variance import articulate, dial
from dnnvss.curves.windows import STATIC_DELTA_DELTA2, Windows
from dnnvss.errors import DnnvssError
from dnnvss.face.aam.model import ActiveAppearanceModel
from dnnvss.style.rules import (
    BILABIALS,
    LABIODENTALS,
    Gauge,
    closure,
    level,
    lower_lip,
    measure,
    phone_extremes,
    rest_in_silence,
    silent_frames,
    teeth_contact,
)
from dnnvss.timing import FrameClock, Tier

_LEAST = 1e-3
"""Least deviation at rest, as a share of that in speech: a coefficient may stand still in silence."""
_RAMP = 0.1
"""Seconds over which the articulation dial fades out towards silence, where the face rests."""


@dataclass(frozen=True)
class Talker:
    """What is learnt from the talker's measured trajectories, for the dial, the lips and the face at rest.

    Args:
        natural: variance of each coefficient within an utterance's speech, geometric mean over utterances, (D,).
        rest: mean parameters in silence, (D,); NaN where there was none.
        rest_deviation: their standard deviation there, (D,).
        aperture, lower_lip: functionals of the parameters.
        closed: the aperture that half of the talker's p, b and m reach; NaN where there were none.
        raised: the place of the lower lip that half of the talker's f and v reach; NaN where there were none.
        own: variance of the model's own trajectories, as ``natural``, or None: then each utterance is scaled by its
            own.
    """

    natural: np.ndarray
    rest: np.ndarray
    rest_deviation: np.ndarray
    aperture: Gauge
    lower_lip: Gauge
    closed: float
    raised: float
    own: np.ndarray | None = None

    @classmethod
    def of(
        cls, references: Sequence[np.ndarray], tiers: Sequence[Tier], clock: FrameClock, model: ActiveAppearanceModel
    ) -> "Talker":
        """Return what the training utterances tell.

        Args:
            references: measured trajectories (T, D).
            tiers: the phones tier of each.
            clock: of the trajectories.
            model: the face.

        Raises:
            DnnvssError: no utterance, or none with speech.
        """
        natural = _typical(speech_variances(references, tiers, clock))
        silent = [silent_frames(tier, clock, len(x), _RAMP, _RAMP) for x, tier in zip(references, tiers, strict=True)]
        at_rest = np.concatenate([x[mask] for x, mask in zip(references, silent, strict=True)]).astype(float)
        if len(at_rest) < 2:
            at_rest = np.full((1, len(natural)), np.nan)
        aperture, lip = Gauge(model.aperture.vector, model.aperture.constant), lower_lip(model)

        def reached(gauge: Gauge, phones: tuple[str, ...]) -> float:
            tracks = [measure(gauge, x) for x in references]
            least = [phone_extremes(t, clock, phones, x) for x, t in zip(tracks, tiers, strict=True)]
            return level(least) if sum(map(len, least)) else float("nan")

        spread = np.maximum(at_rest.std(axis=0), np.maximum(_LEAST * np.sqrt(natural), 1e-6))
        return cls(natural, at_rest.mean(axis=0), spread, aperture, lip,
                   reached(aperture, BILABIALS), reached(lip, LABIODENTALS))

    @property
    def unknown(self) -> dict[str, str]:
        """The settings of a style that have no effect with this talker, and what was missing in the recordings."""
        missing = {"closures": (self.closed, "p, b or m"), "contacts": (self.raised, "f or v"),
                   "rest": (self.rest.sum(), "silence")}
        return {name: what for name, (value, what) in missing.items() if np.isnan(value)}

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
        gauges = {name: np.append(gauge.vector, gauge.constant)
                  for name, gauge in (("aperture", self.aperture), ("lower_lip", self.lower_lip))}
        return files.write_arrays(path, natural=self.natural, rest=self.rest, rest_deviation=self.rest_deviation,
                                  levels=np.array([self.closed, self.raised]), **gauges, **own)

    @classmethod
    def load(cls, path: str | Path) -> "Talker":
        """Return what :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing or damaged.
        """
        a = files.read_arrays(path, "Train the run again")
        try:
            aperture, lip = (Gauge(a[name][:-1], float(a[name][-1])) for name in ("aperture", "lower_lip"))
            closed, raised = (float(v) for v in a["levels"])
            return cls(a["natural"], a["rest"], a["rest_deviation"], aperture, lip, closed, raised, a.get("own"))
        except KeyError as error:
            raise DnnvssError(f"lacks {error}", file=path, remedy="Train the run again") from error


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


@dataclass(frozen=True)
class Style:
    """How trajectories are generated; the default is plain MLPG, bit for bit.

    Args:
        articulation: the dial: 0 flat, 1 the talker's natural variance, above 1 exaggerated; None leaves MLPG's.
        groups: name of a group to its coefficients, for ``by_group``.
        by_group: another dial for the coefficients of a group.
        closures: whether the lips must close on p, b and m.
        contacts: whether the lower lip must reach the teeth on f and v.
        rest: whether silence pulls the face to rest.
        anticipation, release: seconds of silence before and after speech in which the face is left free.

    Raises:
        DnnvssError: a dial or a time that is negative or not a number.
    """

    articulation: float | None = None
    groups: Mapping[str, Sequence[int]] = field(default_factory=dict)
    by_group: Mapping[str, float] = field(default_factory=dict)
    closures: bool = False
    contacts: bool = False
    rest: bool = False
    anticipation: float = 0.15
    release: float = 0.15

    def __post_init__(self) -> None:
        numbers = {"articulation": self.articulation, "anticipation": self.anticipation, "release": self.release,
                   **{f"by_group.{name}": value for name, value in self.by_group.items()}}
        for name, value in numbers.items():
            if value is not None and (isinstance(value, str) or not 0 <= value < np.inf):
                raise DnnvssError(f"style.{name}={value}", remedy="Give a number, 0 or more")

    @property
    def plain(self) -> bool:
        """Whether the style changes nothing of what MLPG gives."""
        return not (self.by_group or self.closures or self.contacts or self.rest) and self.articulation is None


def generate(
    mean: np.ndarray,
    variance: Any,
    tier: Tier,
    clock: FrameClock,
    talker: Talker,
    style: Style | None = None,
    windows: Windows = STATIC_DELTA_DELTA2,
    constraints: Constraints | None = None,
) -> np.ndarray:
    """Return the trajectory (T, D) of a prediction in a style, in the dtype of ``mean``.

    Rest in silence joins the prediction, MLPG makes it smooth, the dial scales speech about its mean (fading out
    towards silence), and closures, contacts and the caller's constraints are held in one last solve. What the talker
    never showed (:attr:`Talker.unknown`) is left out. Where a constraint of the caller forbids a closure or a contact,
    e.g. a key that opens the mouth on a p, the caller's wins.

    Args:
        mean, variance: the prediction; variance broadcasts to (T, W, D).
        tier: the phones tier.
        clock: the trajectory clock.
        talker: what was learnt from the talker.
        style: the settings; plain MLPG where None.
        windows: the streams.
        constraints: more to hold, e.g. an artist's keys.

    Raises:
        DnnvssError: constraints that contradict one another, or a prediction that MLPG refuses.
    """
    style = style or Style()
    frames, columns = len(mean), mean.shape[2]
    unknown = talker.unknown
    if style.rest and "rest" not in unknown:
        dtype = mean.dtype
        mean, variance = rest_in_silence(mean, variance, tier, clock, talker.rest, talker.rest_deviation,
                                         style.anticipation, style.release)
        mean = mean.astype(dtype)
    x = mlpg(mean, variance, windows)
    if style.articulation is not None or style.by_group:
        base = 1.0 if style.articulation is None else style.articulation
        setting = dial(columns, base, style.groups, **style.by_group)
        x = articulate(x, setting, talker.natural, talker.own, ~silent_frames(tier, clock, frames),
                       fade=speech_weight(tier, clock, frames))
    held = [] if constraints is None else [constraints]
    own = Constraints.none(columns) if constraints is None else constraints
    if style.closures and "closures" not in unknown:
        held.append(closure(talker.closed).constraints(tier, clock, talker.aperture, frames, own))
    if style.contacts and "contacts" not in unknown:
        held.append(teeth_contact(talker.raised).constraints(tier, clock, talker.lower_lip, frames, own))
    return constrain(x, variance, Constraints.joined(held), windows) if held else x


def speech_weight(tier: Tier, clock: FrameClock, frames: int, ramp: float = _RAMP) -> np.ndarray:
    """Return (T,) weights: 1 in speech, falling to 0 over ``ramp`` seconds of silence by half a cosine."""
    speech = ~silent_frames(tier, clock, frames)
    if not speech.any():
        return np.zeros(frames)
    at = np.flatnonzero(speech)
    after = np.searchsorted(at, np.arange(frames))
    gap = np.minimum(np.abs(np.arange(frames) - at[np.minimum(after, len(at) - 1)]),
                     np.abs(np.arange(frames) - at[np.maximum(after - 1, 0)]))
    return 0.5 + 0.5 * np.cos(np.pi * np.minimum(gap / max(ramp * float(clock.rate), 1.0), 1.0))
