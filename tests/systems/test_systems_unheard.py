"""A phone that training never heard is said as the likest that it did."""

import numpy as np
import pytest
import torch

from dnnvss.features import FeatureTable, encode
from dnnvss.phones import PHONES
from dnnvss.systems.feedforward import FeedForward
from dnnvss.systems.unheard import heard_phones, lend_weights, stand_in_columns
from dnnvss.timing import Alignment, FrameClock, Tier

TABLE = FeatureTable(("centre_phone", "phone_window", "phone_position", "phone_context"))
CLOCK = FrameClock(100)


def said(*phones: str) -> Alignment:
    rows = [(0.1 * k, 0.1 * (k + 1), phone) for k, phone in enumerate(("sil", *phones, "sil"))]
    end = rows[-1][1]
    words = [(0, 0.1, ""), (0.1, end - 0.1, "it"), (end - 0.1, end, "")]
    return Alignment([Tier("phones", rows), Tier("words", words)])


def outputs(network: FeedForward, *phones: str) -> torch.Tensor:
    codes = encode(said(*phones), "it", TABLE, CLOCK)
    return network(torch.from_numpy(codes.active(np.arange(len(codes)))), torch.zeros(len(codes), 0))


def test_a_phone_never_heard_is_taken_for_the_likest() -> None:
    torch.manual_seed(0)
    network = FeedForward(TABLE.binary_width, 0, TABLE.active_width, out=3, hidden=[8])
    before = outputs(network, "P", "AA", "P")
    assert (outputs(network, "M", "AA", "P") - before).abs().max() > 0.01
    lend_weights(network.first, TABLE, {"sil", "P", "AA", "T"})  # T and AA are too far from M to count
    torch.testing.assert_close(outputs(network, "M", "AA", "M"), before, rtol=0, atol=1e-3)
    torch.testing.assert_close(outputs(network, "P", "AA", "P"), before, rtol=0, atol=0)
    assert (outputs(network, "T", "AA", "P") - before).abs().max() > 0.01


def test_columns_are_those_of_the_same_place_by_distance() -> None:
    lent = stand_in_columns(TABLE, {"AW", "AY", "AE", "P"})
    names = [TABLE.columns[k] for k in TABLE.binary_columns]
    assert len(lent) == (len(PHONES) - 4) * (1 + 32 + 5)
    shares = lent[names.index("phone_window/-3:AA")]
    assert {names[k] for k in shares} == {f"phone_window/-3:{p}" for p in ("AW", "AY", "AE", "P")}
    by = {names[k].split(":")[1]: share for k, share in shares.items()}
    assert by["AW"] == by["AY"] and by["AE"] / by["AW"] == pytest.approx(np.exp(2.5 - 4.5))
    assert sum(by.values()) == pytest.approx(1)


@pytest.mark.parametrize("heard", [set(), set(PHONES)])
def test_where_all_or_nothing_was_heard_nothing_changes(heard: set[str]) -> None:
    network = FeedForward(TABLE.binary_width, 0, TABLE.active_width, out=3, hidden=[8])
    before = network.first.weight.clone()
    lend_weights(network.first, TABLE, heard)
    assert torch.equal(network.first.weight, before)


def test_heard_is_what_owns_a_frame() -> None:
    codes = encode(said("P", "AA"), "it", TABLE, CLOCK)
    assert heard_phones([codes]) == {"sil", "P", "AA"}
