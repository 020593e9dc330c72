"""Dropout with few random bits: its share, its scale, its gradient and its seed."""

import pytest
import torch

from dnnvss.training.dropout import Dropout, keep_mask


@pytest.mark.parametrize("share", [0.1, 0.5, 0.8])
def test_share_and_mean(share: float) -> None:
    torch.manual_seed(0)
    layer, count = Dropout(share), 400_000
    out = layer(torch.ones(count))
    noise = (share * (1 - share) / count) ** 0.5
    assert abs((out == 0).double().mean().item() - share) < 4 * noise
    assert out.unique().tolist() == pytest.approx([0, 1 / (1 - share)])
    assert torch.equal(layer.eval()(out), out)


def test_gradient_passes_where_the_unit_passed() -> None:
    torch.manual_seed(1)
    units = torch.randn(50, 30, dtype=torch.float64, requires_grad=True)
    out = Dropout(0.4)(units)
    out.sum().backward()
    torch.testing.assert_close(units.grad, out.detach() / units.detach())


def test_masks_follow_the_seed_and_neighbours_are_independent() -> None:
    torch.manual_seed(2)
    first = keep_mask(torch.Size((1000, 401)), 0.5)
    assert first.shape == (1000, 401)
    torch.manual_seed(2)
    assert torch.equal(first, keep_mask(torch.Size((1000, 401)), 0.5))
    assert not torch.equal(first, keep_mask(torch.Size((1000, 401)), 0.5))
    signs = 2 * first.double().flatten() - 1
    for lag in (1, 2, 3, 4, 401):  # four places share a draw of 64 bits
        assert abs((signs[lag:] * signs[:-lag]).mean().item()) < 4 / len(signs) ** 0.5
