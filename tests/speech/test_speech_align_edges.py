"""Edges move to where the sound changes, no further than they may, and words keep to their phones."""

import numpy as np
import pytest

from dnnvss.speech.align_edges import REACH, sharpened
from dnnvss.timing import Alignment, Tier

RATE = 16000


def plan(*edges):
    phones = Tier("phones", zip(edges[:-1], edges[1:], ["sil", "S", "IY", "M", "sil"], strict=True))
    words = Tier("words", [(0, edges[1], ""), (edges[1], edges[4], "seem"), (edges[4], edges[5], "")])
    return Alignment([phones, words])


@pytest.fixture(scope="module")
def sound():
    """Hiss, a bright tone and a dull tone, in silence: the sound changes at 0.2, 0.35, 0.5 and 0.65 s."""
    rng, t = np.random.default_rng(0), np.arange(RATE) / RATE
    out = rng.normal(0, 1e-4, RATE)
    kinds = (rng.normal(0, 0.1, RATE), 0.2 * np.sign(np.sin(2 * np.pi * 700 * t)), 0.2 * np.sin(2 * np.pi * 180 * t))
    for k, kind in enumerate(kinds):
        span = (t >= 0.2 + 0.15 * k) & (t < 0.35 + 0.15 * k)
        out[span] += kind[span]
    return out.astype(np.float32)


def test_edges_move_to_where_the_sound_changes(sound):
    found = sharpened(plan(0.0, 0.18, 0.37, 0.52, 0.63, 1.0), sound)
    assert found["phones"].edges == pytest.approx([0.0, 0.2, 0.35, 0.5, 0.65, 1.0], abs=0.013)  # a window sees 20 ms
    assert found["phones"].labels == ("sil", "S", "IY", "M", "sil")
    assert found["words"].edges == pytest.approx(found["phones"].edges[[0, 1, 4, 5]])


def test_an_edge_moves_no_further_than_its_reach(sound):
    given = plan(0.0, 0.2, 0.31, 0.5, 0.65, 1.0)
    moved = np.abs(sharpened(given, sound)["phones"].edges - given["phones"].edges)
    assert moved.max() <= REACH + 1e-9
    assert moved[2] > 0.02


def test_crowded_edges_keep_their_order(sound):
    given = plan(0.0, 0.34, 0.35, 0.36, 0.37, 1.0)
    assert np.diff(sharpened(given, sound)["phones"].edges).min() > 0.002


def test_sound_that_ends_before_the_alignment_is_no_trouble(sound):
    given = plan(0.0, 0.2, 0.35, 0.5, 0.98, 1.0)
    found = sharpened(given, sound[: RATE // 2])["phones"].edges
    assert found[-2:] == pytest.approx([0.98, 1.0])
