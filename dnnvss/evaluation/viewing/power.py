"""How many viewers find which difference: a test tried out on simulated viewers before anybody is asked.

Simulated viewers plan a test. They are never a result.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from dnnvss.evaluation.viewing.shares import NOTHING
from dnnvss.settings import setting

WANTED = 0.8
"""The share of tests that should find a difference that is there."""


@dataclass(frozen=True)
class Viewers:
    """What is assumed of viewers; the result is worth as much as this is.

    Args:
        trials: judgements of one comparison by each viewer.
        spread: standard deviation over viewers of their own share, or of their own difference in points.
        noise: standard deviation in points of one viewer's judgement of a difference; shares have none but chance.
        careless: share of viewers who answer at random.
    """

    trials: int = setting(20, least=1, most=1000)
    spread: float = setting(0.1, least=0, most=100)
    noise: float = setting(15.0, least=0, most=100)
    careless: float = setting(0.0, least=0, most=1)


def simulated_shares(viewers: int, share: float, assumed: Viewers, rng: np.random.Generator) -> np.ndarray:
    """Shares (viewers,) of the judgements of simulated viewers that are for the first of two."""
    own = np.clip(share + assumed.spread * rng.standard_normal(viewers), 0, 1)
    own = np.where(rng.random(viewers) < assumed.careless, 0.5, own)
    found: np.ndarray = rng.binomial(assumed.trials, own) / assumed.trials
    return found


def simulated_differences(viewers: int, points: float, assumed: Viewers, rng: np.random.Generator) -> np.ndarray:
    """Mean differences (viewers,) in points that simulated viewers give."""
    own = points + assumed.spread * rng.standard_normal(viewers)
    own = np.where(rng.random(viewers) < assumed.careless, 0.0, own)
    return own + assumed.noise / np.sqrt(assumed.trials) * rng.standard_normal(viewers)


def power(viewers: int, effect: float, assumed: Viewers, shares: bool, seed: int = 0, tests: int = 2000) -> float:
    """The share of simulated tests that find a difference at the level of 5 %, by a t test over viewers.

    Where all viewers of a test are alike there is no t test, and nothing is found.

    Args:
        viewers: of each test.
        effect: the true share for the better one, or the true difference in points.
        assumed: of the viewers.
        shares: whether they choose; else they score.
        seed: of the simulation.
        tests: how many are simulated.
    """
    rng = np.random.default_rng([seed, viewers, round(1000 * effect)])
    simulate, chance = (simulated_shares, 0.5) if shares else (simulated_differences, 0.0)
    means = np.stack([simulate(viewers, effect, assumed, rng) for _ in range(tests)])
    error = means.std(axis=1, ddof=1) / np.sqrt(viewers)
    off = np.abs(means.mean(axis=1) - chance)
    return float(((off > stats.t.ppf(0.975, viewers - 1) * error) & (error > NOTHING)).mean())


def power_table(viewers: Sequence[int], effects: Sequence[float], assumed: Viewers, shares: bool, seed: int = 0
                ) -> np.ndarray:
    """The power (viewers, effects) of each number of viewers for each difference."""
    return np.array([[power(n, effect, assumed, shares, seed) for effect in effects] for n in viewers])


def fewest(table: np.ndarray, viewers: Sequence[int]) -> list[int | None]:
    """The fewest viewers who reach :data:`WANTED` for each column of a power table, None where none do."""
    return [next((n for n, row in zip(viewers, table, strict=True) if row[k] >= WANTED), None)
            for k in range(table.shape[1])]
