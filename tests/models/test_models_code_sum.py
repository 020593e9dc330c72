"""Sums of rows against the dense product, in both directions, and the order that the gradient is summed in."""

import numpy as np
import pytest
import torch
from torch import Tensor

from dnnvss.models.code_sum import by_column, code_sum

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


@pytest.mark.parametrize("columns", [3, 70000])
def test_frames_of_each_column(columns: int) -> None:
    active = np.array([[2, columns], [0, 2], [columns, 0]], dtype=np.int32)
    frames, starts = by_column(active, columns)
    np.testing.assert_array_equal(frames, [1, 2, 0, 1])  # column 0 in frames 1 and 2, column 2 in frames 0 and 1
    np.testing.assert_array_equal(starts[:4], [0, 2, 2, 4])
    assert starts[columns] == 4
    assert starts.shape == (columns + 1,)
