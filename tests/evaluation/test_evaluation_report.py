"""Tables: the paper's average by hand, masks, JSON and Markdown."""

import json

import numpy as np
import pytest

from dnnvss import DnnvssError
from dnnvss.evaluation import evaluate, score


def ramp(*slopes: float, frames: int = 5) -> np.ndarray:
    return np.arange(frames)[:, None] * np.array(slopes)


def test_speech_and_valid_frames_count():
    reference = ramp(1.0)
    predicted = reference.copy()
    predicted[0], predicted[4] = 100.0, -100.0
    speech = np.array([0, 1, 1, 1, 1], bool)
    valid = np.array([1, 1, 1, 1, 0], bool)
    scores = score(reference, predicted, speech, valid)
    assert scores["speech"]["rmse"].tolist() == [0.0] and scores["speech"]["correlation"] == pytest.approx(1)
    assert scores["all"]["rmse"] == pytest.approx(100 / 2)  # one error of 100 in four valid frames


def test_an_invalid_frame_may_hold_nan():
    reference = ramp(1.0)
    reference[2] = np.nan
    scores = score(reference, ramp(1.0), valid=np.isfinite(reference[:, 0]))
    assert scores["all"]["rmse"].tolist() == [0.0]


def test_mean_and_sd_over_sentences_of_the_average_over_the_first_coefficients():
    references = {"a": ramp(1.0, 1.0, 1.0), "b": ramp(1.0, 1.0, 1.0)}
    # errors grow by 1 and 3 a frame: rmse over 0..4 is slope * sqrt(6); the third coefficient must not count
    predicted = {"a": ramp(2.0, 4.0, 99.0), "b": ramp(1.0, 1.0, -99.0)}
    report = evaluate({"x": predicted}, references, first=2)
    mean, spread = report.summary("x", "rmse")
    assert mean == pytest.approx((2 * np.sqrt(6) + 0) / 2)
    assert spread == pytest.approx(2 * np.sqrt(6) / np.sqrt(2))  # two values that differ by 2 sqrt 6
    assert report.headline("x") == pytest.approx(1.0)
    assert report.coefficients("x", "gv_ratio")[0] == pytest.approx([4, 16, 99**2])


def test_nan_is_left_out_of_averages_and_written_as_a_dash():
    still = np.column_stack([np.arange(5.0), np.ones(5)])
    report = evaluate({"x": {"a": still, "b": still}}, {"a": still, "b": still * [1, 0]}, first=2)
    assert report.summary("x", "correlation")[0] == pytest.approx(1.0)
    flat = evaluate({"x": {"a": np.ones((5, 1))}}, {"a": np.ones((5, 1))})
    assert np.isnan(flat.headline("x")) and "\u2013" in flat.table()
    assert json.loads(json.dumps(flat.to_json()))["systems"]["x"]["regions"]["speech"]["correlation"]["mean"] is None


def test_tables():
    rng = np.random.default_rng(0)
    references = {i: rng.normal(size=(20, 7)) for i in "abc"}
    systems = {"good": {i: r + 0.1 * rng.normal(size=r.shape) for i, r in references.items()},
               "training mean": {i: np.zeros_like(r) for i, r in references.items()}}
    report = evaluate(systems, references, columns=tuple(f"aam{d}" for d in range(7)))
    text, tables = report.table(), report.markdown()
    assert "over 3 sentences of the average over the first 5" in text and "aam4" in tables and "aam5" not in tables
    row = next(line for line in tables.splitlines() if line.startswith("| training mean"))
    assert row.startswith("| training mean | 0.000 (0.000) | ")
    rows = [line for line in tables.splitlines() if line.startswith("|")]
    assert all(line.count("|") in (rows[0].count("|"), 7) for line in rows)
    value = json.loads(json.dumps(report.to_json()))["systems"]["good"]["regions"]["speech"]["correlation"]
    assert value["mean"] == pytest.approx(report.headline("good"), abs=1e-6)
    assert len(value["by_coefficient"]) == 7 and len(value["by_sentence"]) == 3


def test_a_missing_or_misfit_sentence_is_named():
    with pytest.raises(DnnvssError, match="utterance b: system 'x' has no prediction"):
        evaluate({"x": {"a": ramp(1.0)}}, {"a": ramp(1.0), "b": ramp(1.0)})
    with pytest.raises(DnnvssError, match=r"utterance a: system 'x': .*same frames"):
        evaluate({"x": {"a": ramp(1.0, frames=4)}}, {"a": ramp(1.0)})
    with pytest.raises(DnnvssError, match="nothing to evaluate"):
        evaluate({}, {})
