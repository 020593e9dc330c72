"""From a prediction to the trajectory that is shown: the steps of this room in their order, by settings."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from dnnvss.curves.constraints import Constraints, constrain, equations_of
from dnnvss.curves.equations import NormalEquations
from dnnvss.curves.mlpg import mlpg
from dnnvss.curves.passages import at_once, cut, in_passages, rewritten
from dnnvss.curves.variance import articulate, dial, movement_of
from dnnvss.curves.windows import STATIC_DELTA_DELTA2, Windows
from dnnvss.settings import check_settings, setting
from dnnvss.style.rules import pulled_to_rest, silent_frames
from dnnvss.style.talker import LIP_RULES, RAMP, Talker
from dnnvss.style.within import Reach
from dnnvss.timing import FrameClock, Tier


@dataclass(frozen=True, kw_only=True)
class Dials:
    """What a style says of any face.

    Args:
        articulation: the dial: 0 flat, 1 the talker's natural variance, above 1 exaggerated; None leaves MLPG's.
        by_group: another dial for the coefficients of a group.
        closures: whether the lips must close on p, b and m.
        contacts: whether the lower lip must reach the teeth on f and v.
        rest: whether silence pulls the face to rest.
        within: whether coefficients and gauges stay within what the talker showed, with a dial above 1 in as many
            times that range; keys are obeyed beyond it.
        anticipation, release: seconds of silence before and after speech in which the face is left free.
        life: how far eyes, brows and head move beside speech, and how often the eyes blink: 0 not at all, 1 as the
            talker's do. It is drawn over the pictures and changes no parameter.
        seed: of the chance by which they do.

    Raises:
        DnnvssError: a dial or a time that is negative or not a number.
    """

    articulation: float | None = setting(None, least=0, most=100)
    by_group: Mapping[str, float] = setting({}, least=0, most=100)
    closures: bool = False
    contacts: bool = False
    rest: bool = False
    within: bool = False
    anticipation: float = setting(0.15, least=0)
    release: float = setting(0.15, least=0)
    life: float = setting(0.0, least=0, most=1)
    seed: int = setting(0, least=0)

    def __post_init__(self) -> None:
        check_settings(self, "style")


@dataclass(frozen=True, kw_only=True)
class Style(Dials):
    """How trajectories are generated; the default is plain MLPG, bit for bit.

    Args:
        groups: name of a group to its coefficients, for ``by_group``.
    """

    groups: Mapping[str, Sequence[int]] = setting({})

    @property
    def plain(self) -> bool:
        """Whether the style changes nothing of what MLPG gives."""
        changes = self.by_group or self.closures or self.contacts or self.rest or self.within
        return not changes and self.articulation is None

    @property
    def widest(self) -> float:
        """By how much the dials may widen what the talker showed: 1 where none exaggerates."""
        return max(1.0, self.articulation or 1.0, *self.by_group.values())


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
    towards silence), what passes the talker's range is bent into it, and closures, contacts and the caller's
    constraints are held in one last solve, with that range as soft constraints where they would pass it. What the
    talker never showed (:attr:`Talker.unknown`) is left out. Where a constraint of the caller forbids a closure or a
    contact, e.g. a key that opens the mouth on a p, the caller's wins.

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
    return generate_in_passages(lambda around: (mean[around], cut(variance, len(mean), around)), len(mean), tier, clock,
                                talker, style or Style(), windows, constraints)


Predicted = Callable[[slice], tuple[np.ndarray, Any]]
"""What gives mean and variance of a slice of the frames."""


def generate_in_passages(
    predicted: Predicted,
    frames: int,
    tier: Tier,
    clock: FrameClock,
    talker: Talker,
    style: Style,
    windows: Windows = STATIC_DELTA_DELTA2,
    constraints: Constraints | None = None,
) -> np.ndarray:
    """The trajectory (T, D) as :func:`generate` gives it, of a prediction that need not lie there at once.

    Beside the trajectory itself, memory is that of a passage where there are many frames.

    Args:
        predicted: gives the prediction of a slice; it may be asked for the same frames again.
        frames: T.
        tier, clock, talker, style, windows, constraints: as there.

    Raises:
        DnnvssError: as there.
    """
    quiet = None
    if style.rest and "rest" not in talker.unknown:
        quiet = silent_frames(tier, clock, frames, style.anticipation, style.release)
    given = _Given(predicted, quiet, talker, windows, at_once(frames))

    def smooth(around: slice) -> np.ndarray:
        """The frames of a slice as MLPG generates them."""
        part = given(around)
        return mlpg(part.mean, part.variance, windows, equations=part.equations)

    x = in_passages(frames, smooth)
    reach = talker.reach.widened(style.widest) if style.within and talker.reach else None
    x = rewritten(x, _moved(x, tier, clock, talker, style, reach))
    rules = _lip_rules(tier, clock, talker, style, frames, constraints or Constraints.none(x.shape[1]))
    wanted = [] if constraints is None else [constraints]
    for each in (*rules, *wanted):
        each.check(frames, windows)

    def held(around: slice, own: np.ndarray) -> np.ndarray:
        """The frames of a slice with what has to hold in them."""
        here = constraints.within(around) if constraints is not None else None
        part = given(around)
        return _held(own, [rule.within(around) for rule in rules], here, reach,
                     lambda rows: constrain(own, part.variance, Constraints.joined(rows), windows,
                                            lambda: part.equations))

    return rewritten(x, held) if rules or wanted else x


def _moved(x: np.ndarray, tier: Tier, clock: FrameClock, talker: Talker, style: Style, reach: Reach | None
           ) -> Callable[[slice, np.ndarray], np.ndarray]:
    """What scales a slice of the trajectory ``x`` (T, D) by the dial, and bends it into a range."""
    dialled = style.articulation is not None or bool(style.by_group)
    base = 1.0 if style.articulation is None else style.articulation
    if dialled:
        turned = dial(x.shape[1], base, style.groups, **style.by_group)
        fade, speech = speech_weight(tier, clock, len(x)), ~silent_frames(tier, clock, len(x))
        centre, spread = movement_of(x, speech)
        own = spread if talker.own is None else talker.own

    def moved(around: slice, rows: np.ndarray) -> np.ndarray:
        if dialled:
            rows = articulate(rows, turned, talker.natural, own, centre=centre, fade=fade[around])
        return reach.limited(rows) if reach else rows

    return moved


def _lip_rules(tier: Tier, clock: FrameClock, talker: Talker, style: Style, frames: int, first: Constraints
               ) -> list[Constraints]:
    """What the style holds of the lips, where ``first`` does not forbid it."""
    return [talker.held(rule).constraints(tier, clock, talker.gauges[rule.gauge], frames, first)
            for name, rule in LIP_RULES.items() if getattr(style, name) and name not in talker.unknown]


@dataclass(frozen=True)
class _Part:
    """A slice of a prediction: mean (T, W, D), variance that broadcasts to it, and the streams."""

    mean: np.ndarray
    variance: Any
    windows: Windows

    @cached_property
    def equations(self) -> NormalEquations:
        """The normal equations, factorised; all solves of the slice share them."""
        return equations_of(self.variance, (len(self.mean), self.mean.shape[-1]), self.windows)


@dataclass(frozen=True)
class _Given:
    """A prediction with rest in silence, a slice at a time.

    Args:
        predicted: the prediction.
        quiet: (T,) bool, frames that are pulled to rest; None for none.
        talker: whose rest.
        windows: the streams.
        whole: whether all frames are one slice, which is then kept.
    """

    predicted: Predicted
    quiet: np.ndarray | None
    talker: Talker
    windows: Windows
    whole: bool

    def __call__(self, around: slice) -> _Part:
        """A slice of the frames, the mean in its own dtype."""
        return self._all if self.whole else self._part(around)

    @cached_property
    def _all(self) -> _Part:
        return self._part(slice(None))

    def _part(self, around: slice) -> _Part:
        mean, variance = self.predicted(around)
        if self.quiet is None:
            return _Part(mean, variance, self.windows)
        rest, deviation = self.talker.rest, self.talker.rest_deviation
        joined, variance = pulled_to_rest(mean, variance, self.quiet[around], rest, deviation)
        return _Part(joined.astype(mean.dtype), variance, self.windows)


def _held(x: np.ndarray, rules: list[Constraints], wanted: Constraints | None, reach: Reach | None,
          solve: Callable[[list[Constraints]], np.ndarray]) -> np.ndarray:
    """The trajectory ``x`` (T, D) where rules and what a caller wants hold, a range softly where they would pass it.

    What the caller wants and the rules alone would give changes nothing.
    """
    without = solve(rules) if rules else x
    if reach and rules and (soft := reach.constraints(without)):
        rules = [*rules, *soft]
        without = solve(rules)
    if wanted is None:
        return without
    found = solve([wanted, *rules])
    soft = reach.constraints(found, without) if reach else []
    return solve([wanted, *rules, *soft]) if soft else found


def speech_weight(tier: Tier, clock: FrameClock, frames: int, ramp: float = RAMP) -> np.ndarray:
    """Return (T,) weights: 1 in speech, falling to 0 over ``ramp`` seconds of silence by half a cosine."""
    speech = ~silent_frames(tier, clock, frames)
    if not speech.any():
        return np.zeros(frames)
    at = np.flatnonzero(speech)
    after = np.searchsorted(at, np.arange(frames))
    gap = np.minimum(np.abs(np.arange(frames) - at[np.minimum(after, len(at) - 1)]),
                     np.abs(np.arange(frames) - at[np.maximum(after - 1, 0)]))
    return 0.5 + 0.5 * np.cos(np.pi * np.minimum(gap / max(ramp * float(clock.rate), 1.0), 1.0))
