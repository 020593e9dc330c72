"""The ways to the first layer against torch's own layers, and the order that the gradient is summed in."""

import numpy as np
import pytest
import torch
from torch import Tensor

from dnnvss.systems.feedforward import CodeLinear
from dnnvss.training.code_product import code_product
from dnnvss.training.code_sum import by_column, code_sum

ROWS, UNITS, FRAMES, SLOTS = 40, 7, 25, 6


def codes(rng: np.random.Generator) -> Tensor:
    """Columns of frames, none twice in a frame, some places empty."""
    rows = np.stack([rng.permutation(ROWS)[:SLOTS] for _ in range(FRAMES)])
    rows[rng.random(rows.shape) < 0.2] = ROWS
    return torch.from_numpy(rows.astype(np.int32))


def dense(active: Tensor) -> Tensor:
    return torch.zeros(len(active), ROWS + 1, dtype=torch.float64).scatter_(1, active.long(), 1.0)[:, :ROWS]


@pytest.mark.parametrize("seed", range(3))
def test_sum_and_gradient_equal_the_dense_product(seed: int) -> None:
    active = codes(np.random.default_rng(seed))
    torch.manual_seed(seed)
    weight = torch.randn(ROWS + 1, UNITS, dtype=torch.float64)
    weight[-1] = 0
    ours, theirs = weight.clone().requires_grad_(), weight[:-1].clone().requires_grad_()
    code_sum(active, ours).tanh().square().sum().backward()
    (dense(active) @ theirs).tanh().square().sum().backward()
    torch.testing.assert_close(code_sum(active, ours), dense(active) @ weight[:-1])
    torch.testing.assert_close(ours.grad[:-1], theirs.grad)
    assert not ours.grad[-1].any()
    with torch.no_grad():
        torch.testing.assert_close(code_sum(active, ours), dense(active) @ weight[:-1])


@pytest.mark.parametrize("numbers", [0, 3])
def test_product_and_gradients_equal_torchs_layers(numbers: int) -> None:
    active = codes(np.random.default_rng(1))
    torch.manual_seed(1)
    numeric, bias = torch.randn(FRAMES, numbers).double(), torch.randn(UNITS).double()
    weight, other = torch.randn(ROWS + 1, UNITS).double(), torch.randn(numbers, UNITS).double()
    ours, theirs = ([w.clone().requires_grad_() for w in (weight, other, bias)] for _ in range(2))
    values = (code_product(active, numeric, *ours),
              dense(active) @ theirs[0][:-1] + torch.addmm(theirs[2], numeric, theirs[1]))
    torch.testing.assert_close(*values)
    for value in values:
        value.tanh().square().sum().backward()
    for mine, expected in zip(ours, theirs, strict=True):
        torch.testing.assert_close(mine.grad, expected.grad)  # the row of padding has none


def test_stacked_products_are_those_of_each_layer_alone() -> None:
    active = torch.stack([codes(np.random.default_rng(seed)) for seed in range(2)])
    numeric, weight, other, bias = (torch.randn(2, *shape).double() for shape in
                                    ((FRAMES, 3), (ROWS + 1, UNITS), (3, UNITS), (UNITS,)))
    ours = [w.clone().requires_grad_() for w in (weight, other, bias)]
    together = code_product(active, numeric, *ours)
    together.square().sum().backward()
    for k in range(2):
        alone = [w[k].clone().requires_grad_() for w in (weight, other, bias)]
        value = code_product(active[k], numeric[k], *alone)
        value.square().sum().backward()
        torch.testing.assert_close(together[k], value)
        for mine, expected in zip(ours, alone, strict=True):
            torch.testing.assert_close(mine.grad[k], expected.grad)


def test_products_in_bf16_are_close_to_the_sum() -> None:
    layer = CodeLinear(ROWS, 2, 16)
    layer.reset(SLOTS)
    active, numeric = codes(np.random.default_rng(2)), torch.randn(FRAMES, 2)
    with torch.autocast("cpu", torch.bfloat16):
        rounded = code_product(active, numeric, layer.weight, layer.numeric_weight, layer.bias)
    assert rounded.dtype == torch.bfloat16
    torch.testing.assert_close(rounded.float(), layer(active, numeric), rtol=0.02, atol=0.02)


@pytest.mark.parametrize("columns", [3, 70000])
def test_frames_of_each_column(columns: int) -> None:
    active = np.array([[2, columns], [0, 2], [columns, 0]], dtype=np.int32)
    frames, starts = by_column(active, columns)
    np.testing.assert_array_equal(frames, [1, 2, 0, 1])  # column 0 in frames 1 and 2, column 2 in frames 0 and 1
    np.testing.assert_array_equal(starts[:4], [0, 2, 2, 4])
    assert starts[columns] == 4
    assert starts.shape == (columns + 1,)


def test_large_batches_are_summed_of_bf16_where_that_is_asked_for() -> None:
    torch.manual_seed(0)
    active = torch.stack([torch.randperm(601)[:20] for _ in range(400)]).int()  # 600 is padding
    weight = torch.randn(601, 32, requires_grad=True)
    with torch.no_grad():
        weight[600] = 0
    slopes = torch.randn(400, 32)
    (code_sum(active, weight) * slopes).sum().backward()
    exact, weight.grad = weight.grad, None
    with torch.autocast("cpu", torch.bfloat16):
        brief = code_sum(active, weight)
    assert brief.dtype == torch.bfloat16 and exact is not None
    (brief * slopes).sum().backward()
    sums = code_sum(active, weight.detach())
    torch.testing.assert_close(brief.float(), sums, rtol=0.02, atol=0.06)
    torch.testing.assert_close(weight.grad, exact, rtol=0.02, atol=0.06)
    assert weight.grad.dtype == torch.float32 and not weight.grad[600].any()
    with torch.autocast("cpu", torch.bfloat16):
        assert code_sum(active[:100], weight).dtype == torch.float32  # too few to be worth it
