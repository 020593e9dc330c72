"""What the face stage loses when light and clothes change: frames left out, and lips through the face against tracked.

    OMP_NUM_THREADS=1 python benchmarks/changed_footage.py CORPUS [--train 10] [--val 75]

A face is fitted to some training clips as they are, or with the same changes (--changed); validation clips are then
encoded as they are and with changes. ``light``: gain, offset and slope of each channel, one for a clip. ``clothes``:
everything below the chin in another colour with stripes. ``both``. ``step``: both, and a second light from somewhere in
the middle of the clip on. ``dim``: 4 % darker from the middle on, which no limit sees.
"""

import argparse
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from dnnvss.corpus import Corpus
from dnnvss.face.aam import AAMConfig, ActiveAppearanceModel, fit_aam
from dnnvss.face.aam.coding import measure_clip
from dnnvss.face.base import APERTURE
from dnnvss.face.clips import Clip, UnusableClipError, corpus_clips
from dnnvss.face.lips import lip_pairs

KINDS = ("none", "light", "clothes", "both", "step", "dim")
CHIN = 2
"""Pixels below the lowest landmark from which clothes are another colour."""


def relit(images: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Pictures (F, H, W_, 3) float under a random light."""
    height, width = images.shape[1:3]
    across, down = np.linspace(-1, 1, width)[:, None], np.linspace(-1, 1, height)[:, None, None]
    gain = rng.uniform(0.75, 1.2) * rng.uniform(0.93, 1.07, 3)
    slope = 1 + rng.uniform(-0.2, 0.2) * across + rng.uniform(-0.1, 0.1) * down
    return np.asarray(images * (gain * slope) + rng.uniform(-10, 10, 3))


def changed(images: np.ndarray, points: np.ndarray, kind: str, seed: int) -> np.ndarray:
    """Pictures (F, H, W_, 3) uint8 with a change, for their landmarks (F, L, 2)."""
    rng, frames = np.random.default_rng(seed), len(images)
    at = frames // 3 + int(rng.integers(max(frames // 3, 1)))
    x = images.astype(np.float32)
    if kind in ("light", "both", "step"):
        x = relit(x, rng)
    if kind == "step":
        x[at:] = relit(images[at:].astype(np.float32), rng)
    if kind == "dim":
        x[at:] *= 0.96
    if kind in ("clothes", "both", "step"):
        stripes = rng.uniform(20, 235, 3) + 12 * np.sin(np.arange(x.shape[2]) / 3)[:, None]
        for picture, bottom in zip(x, points[..., 1].max(axis=1).astype(int) + CHIN, strict=True):
            picture[bottom:] = stripes
    return np.clip(x, 0, 255).astype(np.uint8)


def change(clip: Clip, kind: str, seed: int) -> Clip:
    """A clip whose pictures are changed when they are read."""
    return replace(clip, images=lambda: changed(np.stack(list(clip.images())), clip.landmarks()[0], kind, seed))


def through_the_face(model: ActiveAppearanceModel, clip: Clip) -> tuple[int, int, float]:
    """Frames left out, all frames, and the correlation of the aperture through the face with the tracked one."""
    points, _ = clip.landmarks()
    try:
        code = measure_clip(model, clip).code
    except UnusableClipError:
        return len(points), len(points), float("nan")
    pairs, middle = lip_pairs(model.mean_shape, model.layout.inner)
    upper, lower = pairs[middle]
    tracked = model.stabilise(points, code)
    own = (tracked[:, lower, 1] - tracked[:, upper, 1])[code.valid]
    shown = model.gauges[APERTURE](code.parameters)[code.valid]
    return int((~code.valid).sum()), len(points), float(np.corrcoef(shown, own)[0, 1])


def main() -> None:
    """Print a line for each kind of change."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--train", type=int, default=10)
    parser.add_argument("--val", type=int, default=75)
    parser.add_argument("--changed", action="store_true", help="change the training clips as well")
    options = parser.parse_args()
    corpus = Corpus.open(options.corpus)

    def some(split: str, count: int) -> Sequence[Clip]:
        chosen = np.random.default_rng(0).permutation(len(known := corpus.split(split)))[:count]
        return corpus_clips(corpus, [known[k] for k in chosen])

    train = some("train", options.train)
    if options.changed:
        train = [change(c, KINDS[k % 4], k) for k, c in enumerate(train)]
    model = fit_aam(train, corpus.info.landmark_groups, AAMConfig(), progress=False)
    for kind in KINDS:
        found = [through_the_face(model, change(c, kind, 100 + k)) for k, c in enumerate(some("val", options.val))]
        lost, frames, r = (np.array(column) for column in zip(*found, strict=True))
        print(f"{kind:8} {lost.sum():5} of {frames.sum()} frames left out ({lost.sum() / frames.sum():.2%}), aperture "
              f"r least {np.nanmin(r):.4f}, mean {np.nanmean(r):.4f}, {int(np.isnan(r).sum())} clips lost")


if __name__ == "__main__":
    main()
