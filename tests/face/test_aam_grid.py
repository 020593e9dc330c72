"""The model on real video: a few clips of GRID s1, where DNNVSS_GRID says where they are."""

import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from dnnvss.face.aam import AAMConfig, fit_aam
from dnnvss.face.aam.coding import clip_errors, measure_clip
from dnnvss.face.clips import Clip
from dnnvss.media import read_video


def _landmarks(path: Path, scale: float) -> tuple[np.ndarray, np.ndarray]:
    with np.load(path) as arrays:
        return arrays["points"] / scale, arrays["valid"]


def _clips(raw: Path, split: str, count: int, scale: float) -> list[Clip]:
    ids = (raw / "splits" / f"{split}.txt").read_text().split()[:count]
    return [Clip(i, 25.0, partial(_landmarks, raw / "landmarks" / f"{i}.npz", scale),
                 partial(read_video, raw / "video" / f"{i}.mp4")) for i in ids]


@pytest.mark.grid
def test_thirty_modes_of_twenty_clips_reconstruct_unseen_ones(grid_raw: Path) -> None:
    about = json.loads((grid_raw / "landmarks.json").read_text())
    groups = {name: (a, b) for name, (a, b) in about["groups"].items()}
    model = fit_aam(_clips(grid_raw, "train", 20, about["scale"]), groups, AAMConfig(), progress=False)
    assert model.size == 30 and len(model.mean_shape) == 34
    total = sum(clip_errors(model, measure_clip(model, c)) for c in _clips(grid_raw, "test", 4, about["scale"]))
    pixels, grey = np.sqrt(total[0] / total[2])
    assert pixels < 0.35 and grey < 4
    assert 1.5 < model.gauges["aperture"](np.zeros(30)) < 5 and 33 < model.gauges["width"](np.zeros(30)) < 43
