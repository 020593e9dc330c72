"""Sounds that are none are refused with their file, and channels are mixed block by block."""

import struct
from collections import deque
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dnnvss.errors import DnnvssError
from dnnvss.media import read_audio
from dnnvss.media.hearing import _mixed_blocks, mixed


def stored(path: Path, samples: np.ndarray, rate: int = 16000) -> Path:
    """A wav file of 32-bit floats."""
    data = samples.astype("<f4").tobytes()
    head = struct.pack("<4sI4s4sIHHIIHH4sI", b"RIFF", 36 + len(data), b"WAVE", b"fmt ", 16, 3, 1, rate, rate * 4, 4, 32,
                       b"data", len(data))
    path.write_bytes(head + data)
    return path


TONE = np.sin(np.arange(16000) / 9) / 2


@pytest.mark.parametrize("samples, rate, message", [
    (np.where(np.arange(16000) == 99, np.nan, TONE), 16000, "a.wav: holds samples that are no finite numbers"),
    (np.where(np.arange(16000) == 99, np.inf, TONE), 16000, "a.wav: holds samples that are no finite numbers"),
    (TONE * 1e4, 16000, r"a.wav: its samples reach 5000(\.\d+)?, and 1 is full scale"),
    (TONE, 1, "a.wav: says that it has 1 samples a second")])
def test_what_is_no_sound_is_refused_with_its_file(tmp_path: Path, samples: np.ndarray, rate: int,
                                                   message: str) -> None:
    for target in (16000, 48000):
        with pytest.raises(DnnvssError, match=message):
            read_audio(stored(tmp_path / "a.wav", samples, rate), target)


def test_loud_and_silent_sounds_are_sounds(tmp_path: Path) -> None:
    np.testing.assert_allclose(read_audio(stored(tmp_path / "a.wav", TONE * 20)), TONE * 20, rtol=1e-5)
    assert not read_audio(stored(tmp_path / "b.wav", TONE * 0)).any()


def test_the_remedy_of_a_sound_is_a_sound(tmp_path: Path) -> None:
    for name, remedy in (("a.wav", "OUT.wav"), ("a.pcm", "OUT.wav"), ("a.mp4", "OUT.mp4")):
        (tmp_path / name).write_bytes(b"no sound at all" * 9)
        with pytest.raises(DnnvssError, match=remedy):
            read_audio(tmp_path / name)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(1, 40), min_size=1, max_size=5), st.integers(1, 3), st.integers(0, 99))
def test_blocks_are_mixed_as_the_whole(lengths: list[int], channels: int, seed: int) -> None:
    whole = np.random.default_rng(seed).normal(size=(channels, sum(lengths))).astype(np.float32)
    laid = deque((0.0, block) for block in np.split(whole, np.cumsum(lengths)[:-1], axis=1))
    np.testing.assert_allclose(_mixed_blocks(laid), mixed(whole), atol=1e-6)
    assert not laid
