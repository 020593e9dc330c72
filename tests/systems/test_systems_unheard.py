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
    lend_weights(network.first, TABLE, {"sil", "P", "AA", "T"})
    torch.testing.assert_close(outputs(network, "M", "AA", "M"), before, rtol=0, atol=1e-6)
    torch.testing.assert_close(outputs(network, "P", "AA", "P"), before, rtol=0, atol=0)
    assert (outputs(network, "T", "AA", "P") - before).abs().max() > 0.01


def test_columns_are_those_of_the_same_place() -> None:
    heard = set(PHONES) - {"M", "ZH"}
    never, instead = stand_in_columns(TABLE, heard)
    names = [TABLE.columns[k] for k in TABLE.binary_columns]
    assert len(never) == 2 * (1 + 32 + 5)
    for one, other in zip(never, instead, strict=True):
        assert names[other] == names[one][: -len(names[one].replace("/", ":").split(":")[-1])] + \
            names[other].replace("/", ":").split(":")[-1]
        assert names[one].endswith(("M", "ZH")) and names[other].replace("/", ":").split(":")[-1] in heard


@pytest.mark.parametrize("heard", [set(), set(PHONES)])
def test_where_all_or_nothing_was_heard_nothing_changes(heard: set[str]) -> None:
    network = FeedForward(TABLE.binary_width, 0, TABLE.active_width, out=3, hidden=[8])
    before = network.first.weight.clone()
    lend_weights(network.first, TABLE, heard)
    assert torch.equal(network.first.weight, before)


def test_heard_is_what_owns_a_frame() -> None:
    codes = encode(said("P", "AA"), "it", TABLE, CLOCK)
    assert heard_phones([codes]) == {"sil", "P", "AA"}
