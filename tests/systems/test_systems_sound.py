"""Networks that read the sound: one whose face follows the loudness alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK, make_example, of_layers

from dnnvss.acoustics import LogMel
from dnnvss.curves import STATIC_DELTA_DELTA2, derivatives
from dnnvss.features import FeatureTable, Settings, encode
from dnnvss.media import Sound
from dnnvss.systems import Example
from dnnvss.systems.network import NetworkModel
from dnnvss.training import FitSettings

SOUND = Settings(logmel=LogMel(bands=4), logmel_offsets=(-2, 2))


def heard(name: str, seed: int, table: FeatureTable) -> Example:
    """An utterance of random phones under noise that swells at random; the parameter is how loud it is."""
    rng = np.random.default_rng(seed)
    example = make_example(name, rng, 1)
    frames = len(example.codes)
    level = np.interp(np.arange(frames), np.arange(0, frames + 8, 8), rng.uniform(-4, -1, len(range(0, frames + 8, 8))))
    loud = np.exp(np.interp(np.arange(160 * frames) / 160 - 0.5, np.arange(frames), level))
    sound = Sound(rng.normal(size=160 * frames) * loud, 16000)
    return replace(example, codes=encode(example.alignment, "word", table, CLOCK, sound),
                   targets=derivatives(level[:, None], STATIC_DELTA_DELTA2).astype(np.float32))


@pytest.mark.parametrize("blocks", [("logmel", "logmel_window"), ("centre_phone", "logmel", "logmel_window")])
def test_what_is_only_heard_is_learnt(blocks: tuple[str, ...], tmp_path: Path) -> None:
    table = FeatureTable(blocks, SOUND)
    train, val, test = ([heard(f"{kind}{k}", 100 * n + k, table) for k in range(count)]
                        for n, (kind, count) in enumerate((("train", 10), ("val", 2), ("test", 2))))
    settings = FitSettings(epochs=12, batch_size=64, share=1.0, figure_every=0, progress=False, accelerator="cpu")
    model = NetworkModel(table, CLOCK, NetworkModel.Settings(of_layers(32), settings))
    model.fit(train, val, tmp_path)
    for example in test:
        assert example.targets is not None
        r = np.corrcoef(model.predict(example).mean[:, 0, 0], example.targets[:, 0, 0])[0, 1]
        assert r > 0.9
