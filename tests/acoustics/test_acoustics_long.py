"""Hours of sound: what is held beside the sound and its features does not grow with them."""

import tracemalloc
from collections.abc import Callable

import numpy as np
import pytest

from dnnvss.acoustics import RATE, Encoder, LogMel, Mfcc, analyse, encoder, encoder_outputs
from dnnvss.media import Sound
from dnnvss.timing import FrameClock


def beside(work: Callable[[Sound], np.ndarray], minutes: int) -> float:
    """MB that were held at most, the sound and the result left out."""
    sound = Sound(np.zeros(minutes * 60 * RATE, np.float32), RATE)
    tracemalloc.start()
    made = work(sound)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return (peak - made.nbytes) / 1e6


def mel(sound: Sound) -> np.ndarray:
    return analyse(sound, LogMel(), FrameClock(100), 0, round(100 * sound.seconds))


def cepstra(sound: Sound) -> np.ndarray:
    return analyse(sound, Mfcc(causal=True), FrameClock(25), 0, round(25 * sound.seconds))


def heard(sound: Sound) -> np.ndarray:
    return encoder_outputs(sound, Encoder())


@pytest.mark.parametrize("work", [mel, cepstra, heard])
def test_memory_does_not_grow_with_the_sound(work: Callable[[Sound], np.ndarray],
                                             monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(encoder, "run_encoder", lambda e: np.zeros((e.shape[1] // 2, 384), np.float32))
    short, long = beside(work, 3), beside(work, 12)
    assert long < short + 5
    assert long < 150
