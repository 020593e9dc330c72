"""Dropout with few random bits: its share, its scale, its gradient and its seed."""

from collections.abc import Callable

import pytest
import torch

from dnnvss.training.dropout import Dropout, halves, keep_mask


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


@pytest.mark.parametrize("drawn", [lambda shape: keep_mask(shape, 0.5),
                                   lambda shape: halves(shape, torch.bfloat16) / 2])
def test_masks_follow_the_seed_and_neighbours_are_independent(drawn: Callable[[torch.Size], torch.Tensor]) -> None:
    torch.manual_seed(2)
    first = drawn(torch.Size((1000, 401)))
    assert first.shape == (1000, 401)
    torch.manual_seed(2)
    assert torch.equal(first, drawn(torch.Size((1000, 401))))
    assert not torch.equal(first, drawn(torch.Size((1000, 401))))
    signs = 2 * first.double().flatten() - 1
    for lag in (1, 2, 3, 4, 8, 64, 401):  # places that share a byte, or a draw of 64 bits
        assert abs((signs[lag:] * signs[:-lag]).mean().item()) < 4 / len(signs) ** 0.5
