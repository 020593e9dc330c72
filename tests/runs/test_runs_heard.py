"""What a run has heard: distances by hand, sounds that are unlike, what is kept."""

from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK

from dnnvss import files
from dnnvss.acoustics import LogMel
from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable, FrameCodes, Settings
from dnnvss.features.encode import encode_recording
from dnnvss.features.recording import Recording
from dnnvss.media import Sound
from dnnvss.runs.heard import Heard, of_sound

TABLE = FeatureTable(("logmel", "logmel_window", "energy"), Settings(logmel=LogMel(bands=6)))


def heard(level: float, seed: int) -> FrameCodes:
    samples = np.random.default_rng(seed).normal(size=16000).astype(np.float32) * level
    return encode_recording(Recording(None, "", Sound(samples, 16000)), TABLE, CLOCK)


@pytest.fixture(scope="module")
def known() -> Heard:
    made = Heard.of([heard(0.02, seed) for seed in range(6)], CLOCK)
    assert made is not None
    return made


def test_what_is_like_the_training_is_usual_and_what_is_not_is_told(known: Heard) -> None:
    assert known.strangeness(heard(0.02, 9), CLOCK).max() < 1.3 and known.strangeness(heard(0.4, 9), CLOCK).min() > 3


def test_distances_by_hand(known: Heard) -> None:
    codes = heard(0.4, 3)
    rows = of_sound(codes).numeric(np.arange(100))  # type: ignore[union-attr]
    assert rows.shape == (100, 7)  # without the frames around
    square = (((rows - known.scaler.mean) / known.scaler.deviation) ** 2).mean(1)
    found = known.strangeness(codes, CLOCK)
    assert found[0] == pytest.approx(square[0] / known.usual, rel=1e-5)
    assert found[50] == pytest.approx(square[41:51].mean() / known.usual, rel=1e-5)


def test_labels_without_sound_have_heard_nothing(examples: dict) -> None:
    assert Heard.of([e.codes for e in examples["train"]], CLOCK) is None


def test_what_is_kept_comes_back(known: Heard, tmp_path: Path) -> None:
    again = Heard.load(known.save(tmp_path / "heard.npz"))
    assert again.usual == known.usual and np.array_equal(again.scaler.mean, known.scaler.mean)
    files.write_arrays(tmp_path / "heard.npz", mean=np.zeros(2), deviation=np.zeros(2), usual=np.array(1.0))
    with pytest.raises(DnnvssError, match="not above 0"):
        Heard.load(tmp_path / "heard.npz")
