"""Dynamic visemes from phones on a talker whose gestures follow from the phones; networks that are given several."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from conftest import CLOCK, TABLE, of_layers

from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable, encode
from dnnvss.systems import Example
from dnnvss.systems.blend import BlendedNetworks, without_visemes
from dnnvss.systems.network import NetworkModel
from dnnvss.systems.viseme_network import UnitNetwork, unit_sequence, unit_targets
from dnnvss.systems.viseme_predictor import VisemePredictor
from dnnvss.timing import Tier
from dnnvss.training import FitSettings
from dnnvss.visemes import DecodingSettings, Grammar

SETTINGS = FitSettings(epochs=12, batch_size=32, share=1.0, learning_rate=1e-2, progress=False, figure_every=0,
                       accelerator="cpu")
BOTH = FeatureTable((*TABLE.names, "centre_viseme", "viseme_span"), replace(TABLE.settings, units=4))


def gestures(example: Example) -> Tier:
    """Return a tier whose units follow from the phones: rest in silence, and one of three by the phone's letter."""
    tier = example.alignment["phones"]
    return Tier("visemes", [(a, b, "0" if p == "sil" else str(1 + ord(p[0]) % 3)) for a, b, p in tier])


def predictor(examples: dict[str, list[Example]], folder: Path) -> VisemePredictor:
    pairs = {name: [(e.codes, unit_targets(gestures(e), CLOCK)) for e in examples[name]] for name in ("train", "val")}
    network = UnitNetwork.fit(pairs["train"], pairs["val"], 4, [32], 0.1, SETTINGS, folder)
    grammar = Grammar.of([unit_sequence(gestures(e), CLOCK) for e in examples["train"]], 4)
    return VisemePredictor(network, grammar, DecodingSettings(), CLOCK)


def with_visemes(example: Example, tier: Tier) -> Example:
    alignment = example.alignment.with_tier(tier)
    return replace(example, alignment=alignment, codes=encode(alignment, "word", BOTH, CLOCK))


@pytest.fixture(scope="module")
def learnt(examples: dict[str, list[Example]], tmp_path_factory: pytest.TempPathFactory) -> VisemePredictor:
    return predictor(examples, tmp_path_factory.mktemp("visemes"))


def test_targets_are_units_and_the_first_frame_of_each_gesture() -> None:
    tier = Tier("visemes", [(0, 0.02, "0"), (0.02, 0.024, "3"), (0.024, 0.05, "2"), (0.05, 0.07, "2")])
    assert unit_targets(tier, CLOCK).tolist() == [[0, 0], [0, 0], [2, 1], [2, 0], [2, 0], [2, 1], [2, 0]]
    units, frames = unit_sequence(tier, CLOCK)
    assert units.tolist() == [0, 2, 2] and frames.tolist() == [2, 3, 2]


def test_units_that_follow_from_phones_are_found(learnt: VisemePredictor, examples: dict[str, list[Example]]) -> None:
    for example in examples["test"]:
        tier, true = learnt.tier(example.codes, example.alignment), gestures(example)
        assert (tier.start, tier.end) == (true.start, true.end)
        right = unit_targets(tier, CLOCK)[:, 0] == unit_targets(true, CLOCK)[:, 0]
        assert right.mean() > 0.85


def test_a_rise_of_the_rate_that_lasts_one_step_is_no_division_by_zero(examples: dict[str, list[Example]],
                                                                         tmp_path: Path) -> None:
    pairs = [(e.codes, unit_targets(gestures(e), CLOCK)) for e in examples["train"]]
    frames = sum(len(codes) for codes, _ in pairs)
    short = replace(SETTINGS, epochs=3, batch_size=frames, warmup=0.25)  # four steps by the count of the schedule
    assert UnitNetwork.fit(pairs, pairs, 4, [8], 0.1, short, tmp_path).units == 4


def test_one_batch_an_epoch_still_takes_its_inputs_from_all_alternatives(examples: dict[str, list[Example]],
                                                                         tmp_path: Path) -> None:
    shown = [with_visemes(e, gestures(e)) for e in examples["train"]]
    others = [replace(e, alternatives=(e.codes,)) for e in shown]
    model = NetworkModel(BOTH, CLOCK, NetworkModel.Settings(of_layers(8), SETTINGS))
    model.fit(shown, shown[:1], tmp_path)
    frames = sum(len(e.codes) for e in shown)
    batches = model._batches([replace(e, valid=np.ones(len(e.codes), bool)) for e in others], tmp_path, seed=0)
    batches.batch_size, batches.share = frames, 1.0
    turns = []
    for epoch in range(4):
        batches.epoch = lambda epoch=epoch: epoch
        first = batches.stores
        batches.stores = tuple(_Spy(store, k, turns) for k, store in enumerate(first))
        list(batches)
        batches.stores = first
    assert turns == [0, 1, 0, 1]


class _Spy:
    """A store that notes when it is asked."""

    def __init__(self, store: object, number: int, turns: list[int]) -> None:
        self.store, self.number, self.turns = store, number, turns

    def active(self, frames: np.ndarray) -> np.ndarray:
        self.turns.append(self.number)
        return self.store.active(frames)  # type: ignore[attr-defined]

    def numeric(self, frames: np.ndarray) -> np.ndarray:
        return self.store.numeric(frames)  # type: ignore[attr-defined]


def test_samples_span_the_utterance_and_agree_mostly(learnt: VisemePredictor,
                                                     examples: dict[str, list[Example]]) -> None:
    example = examples["test"][0]
    best = unit_targets(learnt.tier(example.codes, example.alignment), CLOCK)[:, 0]
    drawn = learnt.samples(example.codes, example.alignment, 3)
    assert all(t.end == example.alignment.end for t in drawn)
    assert np.mean([(unit_targets(t, CLOCK)[:, 0] == best).mean() for t in drawn]) > 0.7


def test_predictor_reads_phones_alone_and_survives_a_checkpoint(learnt: VisemePredictor, tmp_path: Path,
                                                                examples: dict[str, list[Example]]) -> None:
    torch.save(learnt.network.state(), tmp_path / "network.pt")
    again = UnitNetwork.from_state(torch.load(tmp_path / "network.pt", weights_only=True))
    example = examples["test"][0]
    expected = learnt.network.evidence(example.codes)
    wider = with_visemes(example, gestures(example)).codes
    for found in (again.evidence(example.codes), again.evidence(wider)):
        np.testing.assert_array_equal(found.units, expected.units)
        np.testing.assert_array_equal(found.cuts, expected.cuts)
    assert np.exp(expected.units).sum(1) == pytest.approx(np.ones(len(example.codes)))


def test_prediction_is_the_mean_over_alternatives(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    shown = {name: [with_visemes(e, gestures(e)) for e in part] for name, part in examples.items()}
    model = NetworkModel(BOTH, CLOCK, NetworkModel.Settings(of_layers(16), replace(SETTINGS, epochs=1)))
    model.fit(shown["train"], shown["val"], tmp_path)
    example = shown["test"][0]
    other = with_visemes(example, Tier("visemes", [(example.alignment.start, example.alignment.end, "1")]))
    mixed = replace(example, alternatives=(other.codes,))
    expected = (model.predict(example).mean + model.predict(other).mean) / 2
    np.testing.assert_allclose(model.predict(mixed).mean, expected, atol=1e-5)
    assert np.abs(model.predict(example).mean - model.predict(other).mean).max() > 1e-3


def test_training_takes_inputs_from_all_alternatives_in_turn(examples: dict[str, list[Example]],
                                                             tmp_path: Path) -> None:
    """A network that saw only misleading units in its second turn differs from one that never saw them."""
    shown = [with_visemes(e, gestures(e)) for e in examples["train"]]
    val = [with_visemes(e, gestures(e)) for e in examples["val"]]
    wrong = [with_visemes(e, Tier("visemes", [(e.alignment.start, e.alignment.end, "1")])).codes for e in shown]
    model = NetworkModel(BOTH, CLOCK, NetworkModel.Settings(of_layers(16), replace(SETTINGS, epochs=1)))
    model.fit(shown, val, tmp_path / "alone")
    batches = model._batches([replace(e, alternatives=(w,)) for e, w in zip(shown, wrong, strict=True)],
                             tmp_path, seed=0)
    first, second = batches.draw([np.arange(8)] * 2)
    np.testing.assert_array_equal(first[2], second[2])
    plain = model._batches(shown, tmp_path, seed=0).draw([np.arange(8)])[0]
    np.testing.assert_array_equal(first[0], plain[0])
    assert (first[0] != second[0]).any()


def test_blend_is_the_weighted_mean_of_a_network_with_and_one_without_visemes(
        examples: dict[str, list[Example]], tmp_path: Path) -> None:
    shown = {name: [with_visemes(e, gestures(e)) for e in part] for name, part in examples.items()}
    settings = replace(SETTINGS, epochs=2)
    network = of_layers(16)
    blend = BlendedNetworks(BOTH, CLOCK, BlendedNetworks.Settings(network, settings, weight=0.25))
    blend.fit(shown["train"], shown["val"], tmp_path / "blend")
    phones = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(network, settings))
    phones.fit(examples["train"], examples["val"], tmp_path / "phones")
    every = NetworkModel(BOTH, CLOCK, NetworkModel.Settings(network, replace(settings, seed=1)))
    every.fit(shown["train"], shown["val"], tmp_path / "all")
    expected = (0.75 * phones.predict(examples["test"][0]).mean + 0.25 * every.predict(shown["test"][0]).mean)
    np.testing.assert_allclose(blend.predict(shown["test"][0]).mean, expected, atol=1e-5)
    assert without_visemes(BOTH).names == TABLE.names
    with pytest.raises(DnnvssError, match="weight=2"):
        BlendedNetworks.Settings(network, settings, weight=2)
