"""A linear mixed model of scores: conditions fixed, viewers and sentences random."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.evaluation.viewing.shares import Share, t_interval

MOST = 4000
"""Scores up to which the model is fitted; the library's matrices grow with the square of their number."""


@dataclass(frozen=True)
class MixedModel:
    """A fitted model.

    Args:
        means: (K,) of the conditions.
        covariance: (K, K) of the means.
        viewers, sentences, rest: variances of the random effects and of what is left.
        degrees: degrees of freedom of intervals and tests: the number of viewers less one.
    """

    means: np.ndarray
    covariance: np.ndarray
    viewers: float
    sentences: float
    rest: float
    degrees: int

    def difference(self, first: int, second: int) -> Share:
        """Mean of the first less that of the second, its 95 % interval, and the two-sided p of none."""
        c = self.covariance
        value = float(self.means[first] - self.means[second])
        error = float(np.sqrt(max(c[first, first] + c[second, second] - 2 * c[first, second], 0.0)))
        return t_interval(value, error, self.degrees)


def fit_mixed(scores: np.ndarray, condition: np.ndarray, viewer: np.ndarray, sentence: np.ndarray, names: Sequence[str]
              ) -> MixedModel:
    """The model by restricted maximum likelihood: score = condition + viewer + sentence + viewer by condition + rest.

    Viewers who differ in how much they like a condition widen its interval, as they should.

    Args:
        scores: (N,).
        condition, viewer, sentence: (N,) numbers.
        names: of the conditions.

    Raises:
        DnnvssError: the library is missing, or cannot fit these scores.

    **Source**: Baayen, Davidson and Bates (2008), crossed random effects for subjects and items.
    """
    try:
        from statsmodels.regression.mixed_linear_model import MixedLM, VCSpec
    except ImportError as error:
        raise DnnvssError("the mixed model needs the package statsmodels",
                          remedy='Install it: pip install "dnnvss[viewing]"') from error
    k = len(names)
    if all(np.ptp(scores[condition == c]) == 0 for c in np.unique(condition)):
        raise DnnvssError("all scores of a condition are the same", remedy="Ask more viewers")
    fixed = np.eye(k)[condition]
    own = viewer * k + condition
    effects = {"viewers": _dummies(viewer), "sentences": _dummies(sentence), "own": _dummies(own)}
    spec = VCSpec(list(effects), [[list(map(str, range(x.shape[1])))] for x in effects.values()],
                  [[x] for x in effects.values()])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a variance of 0 is no fault of the user's
        try:
            fit = MixedLM(scores, fixed, groups=np.zeros(len(scores)), exog_vc=spec).fit(
                reml=True, method=["lbfgs", "powell"])
        except (np.linalg.LinAlgError, ValueError) as error:
            raise DnnvssError(f"no mixed model fits these scores ({error})", remedy="Ask more viewers") from error
    covariance = np.asarray(fit.cov_params())[:k, :k]
    if not fit.converged or not np.isfinite(covariance).all() or not np.isfinite(fit.fe_params).all():
        raise DnnvssError("no mixed model fits these scores", remedy="Ask more viewers")
    variances = dict(zip(effects, np.asarray(fit.vcomp), strict=True))
    return MixedModel(np.asarray(fit.fe_params), covariance, float(variances["viewers"]),
                      float(variances["sentences"]), float(fit.scale), max(len(np.unique(viewer)) - 1, 1))


def _dummies(groups: np.ndarray) -> np.ndarray:
    """A column of zeros and ones for each group, (N, G)."""
    _, row = np.unique(groups, return_inverse=True)
    return np.eye(row.max() + 1)[row]
