"""Calibration of predicted variances, on errors of known spread."""

import numpy as np
import pytest
from scipy.stats import norm

from dnnvss import DnnvssError
from dnnvss.evaluation.calibration import calibration, plot_calibration


def sentences(spread):
    rng = np.random.default_rng(0)
    return [spread * rng.normal(size=(3000, 2)) for _ in range(4)]


def test_a_calibrated_model_holds_what_it_promises():
    x = sentences(2.0)
    c = calibration(x, [np.zeros((3000, 2))] * 4, [np.full(2, 4.0)] * 4)
    assert c.error.max() < 0.01 and c.spread == pytest.approx([1, 1], abs=0.02)
    assert c.density == pytest.approx([-0.5 * np.log(2 * np.pi * 4) - 0.5] * 2, abs=0.02)


def test_a_model_that_is_too_sure_holds_less():
    c = calibration(sentences(2.0), [np.zeros((3000, 2))] * 4, [np.array([1.0, 4.0])] * 4)
    assert c.spread == pytest.approx([2, 1], abs=0.04)
    level = np.argmin(np.abs(c.levels - 0.5))
    assert c.held[level, 0] == pytest.approx(2 * norm.cdf(norm.ppf(0.75) / 2) - 1, abs=0.02)
    assert c.error[0] > 0.15 and c.density[0] < c.density[1]


def test_masks_variances_a_frame_and_refusals(tmp_path):
    x = [np.array([[1.0], [100.0]])]
    c = calibration(x, [np.zeros((2, 1))], [np.array([[1.0], [1.0]])], [np.array([True, False])])
    assert c.spread == pytest.approx([1.0])
    assert plot_calibration(tmp_path / "c.png", {"model": c}).stat().st_size > 1000
    with pytest.raises(DnnvssError, match="not positive"):
        calibration(x, x, [np.zeros(1)])
