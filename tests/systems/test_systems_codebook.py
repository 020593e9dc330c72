"""The codebook: its own sentence comes back, similar phones are similar, what is missing is replaced and reported."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK, TABLE
from scipy.interpolate import PchipInterpolator

from dnnvss.curves import STATIC_DELTA_DELTA2, derivatives, mlpg
from dnnvss.errors import DnnvssError
from dnnvss.features import encode
from dnnvss.phones import ANSWERS, PHONES, phone_id
from dnnvss.systems import Example
from dnnvss.systems.codebook import Codebook
from dnnvss.systems.codebook_units import OUTSIDE, Inventory, neighbours, phone_distances, similarities
from dnnvss.timing import Alignment, Tier


def sentence(name: str, phones: list[str], frames: list[int], static: np.ndarray | None = None) -> Example:
    edges = np.cumsum([0, *frames]) / 100
    tier = Tier("phones", zip(edges[:-1], edges[1:], phones, strict=True))
    alignment = Alignment([tier, Tier("words", [(0.0, edges[-1], "word")])])
    codes = encode(alignment, "word", TABLE, CLOCK)
    if static is None:
        return Example(name, alignment, codes)
    return Example(name, alignment, codes, derivatives(static, STATIC_DELTA_DELTA2).astype(np.float32),
                   np.ones(len(static), dtype=bool))


def fitted(train: list[Example], **settings: object) -> Codebook:
    model = Codebook(TABLE, CLOCK, Codebook.Settings(**settings))
    model.fit(train, [], Path())
    return model


def test_its_own_sentence_comes_back(examples: dict) -> None:
    model = fitted(examples["train"], examples=1, context=8)
    for example in examples["train"]:
        prediction = model.predict(example)
        assert np.abs(prediction.mean - example.targets).max() < 1e-6
        static = mlpg(prediction.mean, prediction.variance, STATIC_DELTA_DELTA2)
        assert np.abs(static - example.targets[:, 0]).max() < 1e-6
        assert {u for choice in model.choices(example) for u in choice.utterances} == {example.id}


def test_its_own_sentence_can_be_left_out(examples: dict) -> None:
    model = fitted(examples["train"], examples=3, own=False)
    example = examples["train"][0]
    elsewhere = {p for e in examples["train"][1:] for p in e.alignment["phones"].labels}
    for choice in model.choices(example):  # but for phones that nobody else says
        assert (example.id in choice.utterances) == (choice.phone not in elsewhere)


def test_best_contexts_are_found_and_weighted_by_hand() -> None:
    flat = [np.full((30, 1), level) for level in (0.0, 6.0, 12.0)]
    left = ["P", "K", "P"]
    right = ["T", "T", "K"]
    train = [sentence(f"u{i}", [left[i], "AA", right[i]], [10, 10, 10], flat[i]) for i in range(3)]
    model = fitted(train, examples=2, context=1, gamma=50.0)  # other phones count for almost nothing
    choice = model.choices(sentence("new", ["P", "AA", "T"], [5, 20, 5]))[1]
    assert choice.phone == choice.used == "AA" and choice.utterances[0] == "u0"
    table = similarities(model.distances_, 50.0)
    scores = [table[phone_id("P"), phone_id(a)] / 2 + table[phone_id("T"), phone_id(b)] / 2
              for a, b in zip(left, right, strict=True)]
    best = sorted(scores, reverse=True)[:2]
    np.testing.assert_allclose(choice.weights, np.array(best) / sum(best))
    trajectory = model.predict(sentence("new", ["P", "AA", "T"], [5, 20, 5])).mean[:, 0, 0]
    levels = np.array([int(u[1]) * 6.0 for u in choice.utterances])
    np.testing.assert_allclose(trajectory[7:23], np.dot(choice.weights, levels), atol=1e-9)


def talker() -> list[Example]:
    """Return sentences of a talker whose mouth follows what can be seen of each phone: lips, jaw, tongue."""
    rng = np.random.default_rng(0)
    shown = ANSWERS[:, :20] * np.array([4, 4, 3, 2, 3, 1, *[0.3] * 14])
    out = []
    for i in range(40):
        phones = ["sil", *[str(p) for p in rng.choice(PHONES[:39], 12)], "sil"]
        frames = rng.integers(5, 12, len(phones))
        raw = np.repeat(shown[[phone_id(p) for p in phones]], frames, 0)
        static = np.stack([np.convolve(np.pad(c, 2, "edge"), np.ones(5) / 5, "valid") for c in raw.T], 1)
        out.append(sentence(f"u{i}", phones, frames.tolist(), static + rng.normal(scale=0.05, size=static.shape)))
    return out


def test_lips_decide_which_phones_are_alike() -> None:
    distance = phone_distances(Inventory.of(talker()))
    np.testing.assert_allclose(distance, distance.T)
    assert (np.diag(distance) == 0).all()

    def ranked(phone: str) -> list[str]:
        return [PHONES[j] for j in np.argsort(distance[phone_id(phone), :39], kind="stable")[1:3]]

    assert set(ranked("P")) == {"B", "M"} and set(ranked("M")) == {"B", "P"} and set(ranked("B")) == {"M", "P"}
    assert ranked("F")[0] == "V" and ranked("V")[0] == "F"


def test_absent_phone_takes_the_nearest_by_articulation_and_is_reported() -> None:
    rng = np.random.default_rng(0)
    train = [sentence("a", ["sil", "B", "AA", "sil"], [6] * 4, rng.normal(size=(24, 2)))]
    model = fitted(train)
    new = sentence("n", ["sil", "P", "AA", "sil"], [6] * 4)
    choice = model.choices(new)[1]
    assert (choice.phone, choice.used, choice.utterances) == ("P", "B", ("a",))
    np.testing.assert_allclose(model.predict(new).mean[6:12, 0], train[0].targets[6:12, 0], atol=1e-6)


def test_sentence_of_one_phone_and_phones_without_a_frame() -> None:
    rng = np.random.default_rng(0)
    model = fitted([sentence("a", ["AA", "B"], [9, 9], rng.normal(size=(18, 2)))], cutoff=10.0)
    assert np.isfinite(model.predict(sentence("n", ["AA"], [3])).mean).all()
    assert model.predict(sentence("n", ["AA"], [1])).mean.shape == (1, 3, 2)
    tier = Tier("phones", [(0, 0.1, "AA"), (0.1, 0.103, "B"), (0.103, 0.2, "AA")])
    alignment = Alignment([tier, Tier("words", [(0, 0.2, "word")])])
    short = Example("s", alignment, encode(alignment, "word", TABLE, CLOCK))
    assert model.predict(short).mean.shape[0] == 20 and len(model.choices(short)) == 2


def test_trajectories_are_monotone_hermite_interpolants(examples: dict) -> None:
    train = examples["train"][:2]
    corpus = Inventory.of(train)
    for u, example in enumerate(train):
        low, high = corpus.bounds[u], corpus.bounds[u + 1]
        frames = np.arange(low, high)
        times = np.random.default_rng(u).uniform(low + 1, high - 2, 50)  # beyond, rules for end slopes differ
        expected = PchipInterpolator(frames, example.targets[:, 0].astype(float))(times)
        np.testing.assert_allclose(corpus.at(times, np.full(50, u)), expected, atol=1e-9)
        assert np.abs(corpus.at(np.array([low - 5.0]), np.array([u])) - example.targets[0, 0]).max() == 0


def test_unmeasured_phones_are_no_examples() -> None:
    rng = np.random.default_rng(0)
    example = sentence("a", ["AA", "B", "AA"], [10, 10, 10], rng.normal(size=(30, 2)))
    valid = np.ones(30, dtype=bool)
    valid[3] = False
    model = fitted([replace(example, valid=valid)])
    assert [c.entries for c in model.choices(example)] == [(2,), (1,), (2,)]
    with pytest.raises(DnnvssError, match="no phone of the training examples was measured throughout"):
        fitted([replace(example, valid=np.zeros(30, dtype=bool))])


def test_spline_halves_an_oscillation_at_its_cutoff() -> None:
    model = Codebook(TABLE, CLOCK, Codebook.Settings(cutoff=10.0))
    t = np.arange(400) / 100
    for hertz, kept in ((1.0, 1.0), (10.0, 0.5), (40.0, 0.01)):
        wave = np.sin(2 * np.pi * hertz * t + 0.3)[:, None]
        middle = slice(100, 300)
        gain = np.linalg.lstsq(wave[middle], model.smoothed(wave)[middle, 0], rcond=None)[0][0]
        assert gain == pytest.approx(kept, abs=0.05)


def test_neighbours_and_similarities_end_at_the_utterance() -> None:
    around = neighbours(np.array([5, 6, 7, 8]), np.array([0, 0, 1, 1]), 2)
    assert around[1].tolist() == [5, OUTSIDE, OUTSIDE, OUTSIDE] and around[2].tolist() == [OUTSIDE, OUTSIDE, 8, OUTSIDE]
    table = similarities(np.ones((41, 41)) - np.eye(41), 2.0)
    assert table[3, 3] == 1 and table[3, 4] == pytest.approx(np.exp(-2)) and table[OUTSIDE, OUTSIDE] == 1
    assert table[OUTSIDE, 3] == 0


@pytest.mark.parametrize("setting", [{"examples": 0}, {"context": -1}, {"gamma": -1.0}, {"cutoff": 0.0}])
def test_settings_out_of_range_are_refused(setting: dict) -> None:
    with pytest.raises(DnnvssError, match=rf"model\.{next(iter(setting))}=.* is too little"):
        Codebook.Settings(**setting)
