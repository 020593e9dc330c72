"""A toy rig for the tests: four curves, of which three move."""

from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.corpus import Corpus, CorpusInfo, Utterance
from dnnvss.face.clips import Clip
from dnnvss.timing import Alignment, Tier

CURVES = ("JawOpen", "MouthClose", "BrowInnerUp", "HeadYaw")
GROUPS = {name: (i, i + 1) for i, name in enumerate(CURVES)}


def values(seed: int, frames: int = 20) -> np.ndarray:
    """Return the curves (F, 4) of a toy take; the third stands at .25, the fourth goes below 0."""
    random = np.random.default_rng(seed)
    time = np.arange(frames) / frames
    waves = [
        0.5 + 0.4 * np.sin(2 * np.pi * (random.uniform(1, 3) * time + random.uniform()))
        for _ in range(3)
    ]
    return np.stack([waves[0], 0.5 * waves[1], np.full(frames, 0.25), waves[2] - 0.5], axis=1)


def _give(value: object) -> object:
    return value


def clips(count: int = 8) -> list[Clip]:
    """Return toy takes."""
    made = [values(seed)[..., None] for seed in range(count)]
    return [
        Clip(f"toy{k}", 25.0, partial(_give, (v, np.ones(len(v), bool))), partial(_give, None))  # type: ignore[arg-type]
        for k, v in enumerate(made)
    ]


def corpus(root: Path, count: int = 6) -> Corpus:
    """Return a prepared corpus of curves on disk."""
    utterances = []
    for seed in range(count):
        name, curves = f"toy{seed}", values(seed)
        files.write_arrays(
            root / "landmarks" / f"{name}.npz",
            points=curves[..., None].astype(np.float32),
            valid=np.ones(len(curves), bool),
        )
        end = len(curves) / 25
        phones = Tier("phones", [(0, 0.2, "sil"), (0.2, 0.6, "AA"), (0.6, end, "sil")])
        words = Tier("words", [(0, 0.2, ""), (0.2, 0.6, "ah"), (0.6, end, "")])
        utterances.append(
            Utterance(
                name,
                "ah",
                Alignment([phones, words]),
                None,
                None,
                f"landmarks/{name}.npz",
                Fraction(25),
                len(curves),
            )
        )
    info = CorpusInfo("toy", (0, 0), "25", GROUPS, dimensions=1, unit="curve")
    Corpus.write(
        root,
        info,
        utterances,
        {"train": [u.id for u in utterances[:-1]], "test": [utterances[-1].id]},
    )
    return Corpus.open(root)
