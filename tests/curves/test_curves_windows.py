"""Delta windows: hand-worked values, edges, ragged rows, refusals."""

import numpy as np
import pytest
import torch

from dnnvss import DnnvssError
from dnnvss.curves import STATIC, STATIC_DELTA, STATIC_DELTA_DELTA2, Windows, derivatives


def test_by_hand_with_held_edges():
    x = np.array([[0.0], [1.0], [4.0], [9.0]])
    streams = derivatives(x)
    assert streams.shape == (4, 3, 1)
    assert streams[:, 0, 0].tolist() == [0, 1, 4, 9]
    assert streams[:, 1, 0].tolist() == [0.5, 2, 4, 2.5]  # ends: (1 - 0) / 2 and (9 - 4) / 2
    assert streams[:, 2, 0].tolist() == [1, 2, 2, -5]  # ends: 0 - 2*0 + 1 and 4 - 2*9 + 9


def test_one_frame_has_no_movement():
    assert derivatives(np.array([[3.0, -1.0]])).tolist() == [[[3, -1], [0, 0], [0, 0]]]


def test_ragged_rows_hold_their_own_last_frame():
    rng = np.random.default_rng(0)
    x = rng.normal(size=(3, 6, 2))
    streams = derivatives(x, lengths=np.array([6, 4, 1]))
    for row, length in enumerate([6, 4, 1]):
        assert np.allclose(streams[row, :length], derivatives(x[row, :length]), atol=1e-15)


def test_torch_keeps_kind_dtype_and_gradient():
    x = torch.randn(2, 5, 3, dtype=torch.float32, generator=torch.Generator().manual_seed(0), requires_grad=True)
    streams = derivatives(x)
    assert streams.dtype == torch.float32 and streams.shape == (2, 5, 3, 3)
    streams[:, :, 1].sum().backward()
    # the sum of all deltas is (last + last held - first - first held + ...) / 2, which telescopes to the two ends
    assert np.allclose(x.grad[0, :, 0].numpy(), [-1, 0, 0, 0, 1])


def test_reach_and_weights_derive_from_the_table():
    assert STATIC_DELTA_DELTA2.reach == 1 and len(STATIC_DELTA_DELTA2) == 3
    assert STATIC_DELTA_DELTA2.weights(1) == [(-1, -0.5), (1, 0.5)]


@pytest.mark.parametrize(
    ("names", "taps", "match"),
    [
        (("a", "b"), ((1.0,), (0.5, 0.5)), "odd number"),
        (("a", "b"), ((1.0,), (np.nan, 0, 1)), "finite"),
        (("a",), ((0.5,),), "first window"),
        (("a", "a"), ((1.0,), (1.0,)), "Name each"),
    ],
)
def test_a_bad_table_is_refused(names, taps, match):
    with pytest.raises(DnnvssError, match=match):
        Windows(names, taps)


def test_windows_by_name():
    assert Windows.named("static_delta_delta2") is STATIC_DELTA_DELTA2
    assert Windows.named("static_delta").names == ("static", "delta")
    with pytest.raises(DnnvssError, match=r"'acceleration'.*static_delta_delta2"):
        Windows.named("acceleration")


def test_no_frames_is_an_error():
    with pytest.raises(DnnvssError, match="no frame"):
        derivatives(np.zeros((0, 3)))


def test_the_first_streams_are_those_of_fewer_windows() -> None:
    assert STATIC_DELTA_DELTA2.first(2) == STATIC_DELTA
    assert STATIC_DELTA_DELTA2.first(1) == STATIC
    with pytest.raises(DnnvssError, match="4 of 3 streams"):
        STATIC_DELTA_DELTA2.first(4)
