"""The statistics of viewing tests: the papers' own tables, scipy and scikit-learn as oracles, coverage."""

import numpy as np
import pytest
from scipy import stats

from dnnvss.errors import DnnvssError
from dnnvss.evaluation.viewing.agreement import krippendorff
from dnnvss.evaluation.viewing.bradley_terry import fit_bradley_terry
from dnnvss.evaluation.viewing.mixed import fit_mixed
from dnnvss.evaluation.viewing.power import Viewers, fewest, power, power_table, simulated_differences, simulated_shares
from dnnvss.evaluation.viewing.ranks import (
    friedman,
    kruskal_wallis,
    leaving_out,
    rank_statistics,
    signed_rank,
    signed_rank_p,
)
from dnnvss.evaluation.viewing.screening import screened
from dnnvss.evaluation.viewing.shares import exact_share, mean_interval, sensitivity, share_over_viewers

TABLES = {  # Theobald et al. (2003), tables 3, 4 and 5: average ranks, H, Z
    "3": ([90.5, 420.2, 462.5, 444.7, 584.7], 408.04, [-18.97, 1.20, 3.79, 2.70, 11.27]),
    "4": ([263.7, 304.9, 287.6, 425.8], 73.18, [-4.48, -1.23, -2.60, 8.32]),
    "5": ([223.3, 256.4, 241.8], 4.60, [-1.92, 1.78, 0.14]),
}
TABLE_2 = [(20, 38.0, 0.013), (16, 23.5, 0.023), (18, 122.0, 0.117), (20, 67.5, 0.167), (20, 92.5, 0.654)]
"""Theobald et al. (2003), table 2: n, W and p of the viewers whose p is printed in full."""


@pytest.mark.parametrize("table", TABLES)
def test_average_ranks_of_the_paper_give_its_statistics(table: str) -> None:
    ranks, h, z = TABLES[table]
    counts = np.full(len(ranks), 160)
    found, scores = rank_statistics(counts, np.array(ranks))
    slack = 12 / (counts.sum() * (counts.sum() + 1)) * 160 * 0.1 * np.abs(np.array(ranks) - np.mean(ranks)).sum()
    assert found == pytest.approx(h, abs=slack + 0.005)  # the ranks are rounded to a tenth
    assert scores == pytest.approx(z, abs=0.013)


@pytest.mark.parametrize(("used", "statistic", "p"), TABLE_2)
def test_signed_ranks_of_the_paper_give_its_p(used: int, statistic: float, p: float) -> None:
    assert signed_rank_p(statistic, used) == pytest.approx(p, abs=0.0005)


def test_signed_ranks_agree_with_scipy_and_by_hand() -> None:
    rng = np.random.default_rng(0)
    d = np.round(rng.normal(2, 6, 40))
    found = signed_rank(d)
    oracle = stats.wilcoxon(d, correction=True, method="asymptotic")
    assert found.p == pytest.approx(oracle.pvalue) and found.used == np.count_nonzero(d) < found.count == 40
    assert min(found.statistic, found.used * (found.used + 1) / 2 - found.statistic) == oracle.statistic
    few = rng.normal(1, 1, 9)
    assert signed_rank(few).p == pytest.approx(stats.wilcoxon(few, method="exact").pvalue)
    assert signed_rank(np.array([1.0, 2, 3])).p == 0.25 and signed_rank(np.array([1.0, 2, 6])).median == 2.75
    nothing = signed_rank(np.zeros(5))
    assert (nothing.used, nothing.p, nothing.median) == (0, 1.0, 0.0)


def test_kruskal_wallis_and_friedman_agree_with_scipy() -> None:
    rng = np.random.default_rng(1)
    groups = {name: np.round(rng.normal(mean, 8, 30)) for name, mean in (("a", 10), ("b", 14), ("c", 15))}
    found = kruskal_wallis(list(groups.values()))
    oracle = stats.kruskal(*groups.values())
    assert (found.adjusted, found.p) == pytest.approx((oracle.statistic, oracle.pvalue))
    assert found.statistic < found.adjusted and found.medians[0] == np.median(groups["a"])
    tests = leaving_out(groups, [("a",), ("a", "b")])
    assert list(tests) == [(), ("a",)] and tests["a",].adjusted == pytest.approx(
        stats.kruskal(groups["b"], groups["c"]).statistic)
    same = kruskal_wallis([np.full(4, 5.0), np.full(4, 5.0)])
    assert (same.adjusted, same.p) == (0.0, 1.0)
    blocks = np.round(rng.normal([0, 1, 3], 2, (12, 3)))
    test, oracle = friedman(blocks), stats.friedmanchisquare(*blocks.T)
    assert (test.statistic, test.p) == pytest.approx((oracle.statistic, oracle.pvalue))
    assert friedman(np.array([[1, 2, 3]] * 4)).agreement == pytest.approx(1)
    assert np.isnan(friedman(np.ones((4, 3))).p)


def test_twelve_of_fifteen_viewers_are_eighty_percent() -> None:
    oracle = stats.binomtest(7, 30).proportion_ci(0.95, "exact")
    assert (exact_share(7, 30).low, exact_share(7, 30).high) == pytest.approx((oracle.low, oracle.high))
    found = exact_share(12, 15)  # Thangthai et al. (2016), section 5.4
    assert found.value == 0.8 and found.p == pytest.approx(0.0352, abs=1e-4)
    assert (found.low, found.high) == pytest.approx((0.519, 0.957), abs=0.001)
    assert exact_share(0, 10).low == 0 and np.isnan(exact_share(0, 0).value)
    values = np.random.default_rng(2).normal(1, 2, 12)
    oracle = stats.ttest_1samp(values, 0.5)
    found, interval = mean_interval(values, 0.5), oracle.confidence_interval()
    assert (found.low, found.high, found.p) == pytest.approx((interval.low, interval.high, oracle.pvalue))
    assert np.isnan(mean_interval(np.array([1.0])).p) and share_over_viewers(np.array([1, 1, 0.9])).high == 1
    assert np.isnan(sensitivity((0, 0), (5, 10)))
    assert sensitivity((5, 10), (5, 10)) == 0 and sensitivity((9, 10), (1, 10)) > 2


@pytest.mark.parametrize("value", [0.0, 0.1, 0.5, 1.0])
def test_viewers_who_are_all_alike_give_no_interval(value: float) -> None:
    found = share_over_viewers(np.full(3, value))
    assert found.value == pytest.approx(value) and np.isnan([found.low, found.high, found.p]).all()


def test_bradley_terry_is_a_logistic_regression() -> None:
    from sklearn.linear_model import LogisticRegression

    rng = np.random.default_rng(3)
    pairs = np.array([(a, b) for a in range(4) for b in range(4) if a != b] * 30)
    true = np.array([-1, 0, 0.3, 0.7])
    won = (rng.random(len(pairs)) < 1 / (1 + np.exp(true[pairs[:, 1]] - true[pairs[:, 0]]))).astype(float)
    found = fit_bradley_terry(4, pairs, won, np.arange(len(pairs)) % 20)
    design = np.eye(4)[pairs[:, 0]] - np.eye(4)[pairs[:, 1]]
    oracle = LogisticRegression(C=np.inf, fit_intercept=False, tol=1e-10).fit(design, won).coef_[0]
    assert found.strengths == pytest.approx(oracle - oracle.mean(), abs=1e-4)
    d = found.difference(3, 0)
    assert d.low < 1.7 < d.high and d.p < 1e-4 and d.value == pytest.approx(found.strengths[3] - found.strengths[0])
    with pytest.raises(DnnvssError, match="never lost"):
        fit_bradley_terry(2, np.array([[0, 1]] * 5), np.ones(5), np.arange(5))
    tied = fit_bradley_terry(2, np.array([[0, 1]] * 6), np.full(6, 0.5), np.arange(6))
    assert tied.strengths == pytest.approx([0, 0]) and np.isnan([*tied.low, tied.difference(0, 1).p]).all()
    alone = fit_bradley_terry(2, np.array([[0, 1]] * 6), np.array([1, 0, 1, 0, 1, 1.0]), np.zeros(6, int))
    assert alone.strengths == pytest.approx([np.log(2) / 2, -np.log(2) / 2]) and np.isnan(alone.high).all()


def test_agreement_is_that_of_its_author() -> None:
    gap = np.nan
    ratings = np.array([[1, 2, 3, 3, 2, 1, 4, 1, 2, gap, gap, gap], [1, 2, 3, 3, 2, 2, 4, 1, 2, 5, gap, 3],
                        [gap, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, gap], [1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, gap]])
    assert krippendorff(ratings, nominal=True) == pytest.approx(0.743, abs=5e-4)  # Krippendorff (2011), section C
    assert krippendorff(ratings) == pytest.approx(0.849, abs=5e-4)
    assert np.isnan(krippendorff(np.ones((3, 4))))


def test_who_answers_at_random_is_screened_and_who_is_strict_is_not() -> None:
    rng = np.random.default_rng(4)
    quality = np.linspace(20, 80, 60)
    scores = quality + rng.normal(0, 6, (60, 60))
    scores[0] = rng.uniform(0, 100, 60)
    scores[1] -= 25
    assert np.flatnonzero(screened(scores)).tolist() == [0]
    scores[rng.random(scores.shape) < 0.3] = np.nan
    assert screened(scores).tolist() == [_screened_by_hand(scores, i) for i in range(60)]
    assert not screened(scores[:3]).any()  # too few to tell


def _screened_by_hand(scores: np.ndarray, viewer: int) -> bool:
    """The steps of BT.500 for a viewer, stimulus by stimulus."""
    high = low = asked = 0
    for column in scores.T:
        known = column[~np.isnan(column)]
        if np.isnan(column[viewer]):
            continue
        asked += 1
        beta = stats.kurtosis(known, fisher=False)
        bound = (2 if 2 <= beta <= 4 else 20 ** 0.5) * known.std(ddof=1)
        high += column[viewer] >= known.mean() + bound
        low += column[viewer] <= known.mean() - bound
    return (high + low) / asked > 0.05 and abs(high - low) / (high + low) < 0.3


def test_the_mixed_model_finds_what_was_put_in() -> None:
    pytest.importorskip("statsmodels")
    rng = np.random.default_rng(5)
    v, s, c = (a.ravel() for a in np.meshgrid(range(10), range(8), range(3), indexing="ij"))
    score = 50 + 10 * rng.normal(size=10)[v] + 5 * rng.normal(size=8)[s] + np.array([0, 8, 8])[c]
    score += 4 * rng.normal(size=240)
    found = fit_mixed(score, c, v, s, ["a", "b", "c"])
    means = [score[c == k].mean() for k in range(3)]  # of a balanced design
    assert found.means == pytest.approx(means, abs=1e-3)
    d = found.difference(1, 0)
    assert d.low < 8 < d.high and d.p < 1e-4 and found.rest == pytest.approx(16, rel=0.4)
    assert found.difference(2, 1).p > 0.01 and 40 < found.viewers < 300 and 5 < found.sentences < 100
    with pytest.raises(DnnvssError, match="are the same"):
        fit_mixed(10.0 * c, c, v, s, ["a", "b", "c"])


def test_power_is_that_of_the_t_test() -> None:
    assumed = Viewers(trials=20, spread=6, noise=20)
    deviation = np.sqrt(6 ** 2 + 20 ** 2 / 20)
    shift, n = 5 / deviation * np.sqrt(15), 15
    bound = stats.t.ppf(0.975, n - 1)
    truth = stats.nct.sf(bound, n - 1, shift) + stats.nct.cdf(-bound, n - 1, shift)
    assert power(n, 5, assumed, shares=False) == pytest.approx(truth, abs=0.03)
    assert power(12, 0.5, Viewers(), shares=True) == pytest.approx(0.05, abs=0.02)
    table = power_table([5, 10, 20, 100], [0.55, 0.8], Viewers(), shares=True)
    assert (np.diff(table, axis=0) > -0.02).all()
    assert fewest(table, [5, 10, 20, 100]) == [100, 5] and fewest(table[:1], [5])[0] is None


@pytest.mark.slow
@pytest.mark.parametrize("careless", [0.0, 0.2])
def test_intervals_cover_the_truth_in_95_percent_of_simulations(careless: float) -> None:
    """With careless viewers among them, whom nobody found out, the truth is that of all who may come."""
    rng = np.random.default_rng(6)
    assumed = Viewers(trials=20, spread=0.1, careless=careless)
    truth = 0.7 * (1 - careless) + 0.5 * careless
    scoring = Viewers(trials=20, spread=8, noise=20, careless=careless)
    hit, majority, points, exact = 0, 0, 0, 0.7
    for _ in range(1000):
        found = share_over_viewers(simulated_shares(20, 0.7, assumed, rng))
        hit += found.low <= truth <= found.high
        scored = mean_interval(simulated_differences(20, 10, scoring, rng))
        points += scored.low <= 10 * (1 - careless) <= scored.high
        count = exact_share(int(rng.binomial(400, exact)), 400)
        majority += count.low <= exact <= count.high
    assert all(930 <= covered <= 970 for covered in (hit, majority, points))


@pytest.mark.slow
@pytest.mark.parametrize("careless", [0.0, 0.2])
def test_bradley_terry_covers_the_truth_with_viewers_of_their_own_mind(careless: float) -> None:
    rng, viewers = np.random.default_rng(7), 30
    pairs = np.array([(0, 1), (1, 2), (0, 2)] * 8)
    table, who = np.tile(pairs, (viewers, 1)), np.repeat(np.arange(viewers), len(pairs))
    true = np.array([-0.5, 0.0, 0.5])
    shares = _mean_shares(true, careless)
    target = fit_bradley_terry(3, np.array([(0, 1), (1, 2), (0, 2)] * 2),
                               np.array([*shares, *shares]), np.arange(6)).strengths
    hit = 0
    for _ in range(1000):
        own = true + 0.4 * rng.normal(size=(viewers, 3))
        own[rng.random(viewers) < careless] = 0
        chance = 1 / (1 + np.exp(own[who, table[:, 1]] - own[who, table[:, 0]]))
        fitted = fit_bradley_terry(3, table, (rng.random(len(table)) < chance).astype(float), who)
        d = fitted.difference(2, 0)
        hit += d.low <= target[2] - target[0] <= d.high
    assert 930 <= hit <= 970


def _mean_shares(true: np.ndarray, careless: float) -> np.ndarray:
    """How often the first of each pair wins over all viewers who may come."""
    own = true + 0.4 * np.random.default_rng(8).normal(size=(200_000, 3))
    shares = np.array([(1 / (1 + np.exp(own[:, b] - own[:, a]))).mean() for a, b in ((0, 1), (1, 2), (0, 2))])
    return (1 - careless) * shares + careless * 0.5
