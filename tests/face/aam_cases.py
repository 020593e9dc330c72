"""A toy talker for the tests: a smooth coloured face whose landmarks and pictures are known exactly."""

from fractions import Fraction
from functools import partial
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.corpus import Corpus, CorpusInfo, Utterance
from dnnvss.face.aam import AAMConfig, PointSet
from dnnvss.face.clips import Clip
from dnnvss.timing import Alignment, Tier

SIZE = (80, 96)
"""Height and width of the toy pictures."""
GROUPS = {"lips_outer": (0, 6), "lips_inner": (6, 10), "jaw": (10, 15), "eyes": (15, 19)}
POINTS = PointSet("toy", {"lips_outer": "all", "lips_inner": "all", "jaw": "all"}, {"eyes": "all"}, eyes=())
CONFIG = AAMConfig(points=POINTS, modes=6, texture_frames=400, texture_every=1, pose_smoothing=0.0)
_FACE = np.array([
    (36, 48), (42, 44), (54, 44), (60, 48), (54, 53), (42, 53),  # outer lips
    (39, 48), (48, 46), (57, 48), (48, 50),  # inner lips
    (28, 50), (34, 64), (48, 70), (62, 64), (68, 50),  # jaw
    (32, 24), (42, 25), (54, 25), (64, 24),  # eyes
], dtype=float)


def face(opening: float = 0.0, spread: float = 0.0) -> np.ndarray:
    """Return the landmarks (19, 2) with the jaw lowered and the corners drawn apart by some pixels."""
    points = _FACE.copy()
    points[[4, 5, 9], 1] += opening
    points[[11, 12, 13], 1] += 0.6 * opening
    points[[0, 6], 0] -= spread
    points[[3, 8], 0] += spread
    return points


def similarity(points: np.ndarray, scale: float, angle: float, move: tuple[float, float]) -> np.ndarray:
    """Return points turned and scaled about the picture's middle, then moved."""
    middle = np.array(SIZE[::-1]) / 2
    turn = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return (points - middle) @ turn.T + middle + move


def picture(opening: float, scale: float = 1.0, angle: float = 0.0, move: tuple[float, float] = (0.0, 0.0),
            light: float = 0.0) -> np.ndarray:
    """Return a smooth uint8 picture of the face: its colours ride on the face, and its mouth darkens as it opens."""
    y, x = np.mgrid[:SIZE[0], :SIZE[1]] + 0.5
    middle = np.array(SIZE[::-1]) / 2
    back = np.linalg.inv(scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]))
    u, v = np.moveaxis((np.stack([x, y], axis=-1) - middle - move) @ back.T + middle, -1, 0)
    mouth = np.exp(-(((u - 48) / 9) ** 2 + ((v - 49 - opening / 2) / (2 + opening)) ** 2))
    channels = [130 + 40 * np.sin(u / 11) + 20 * np.cos(v / 9) - 8 * opening * mouth,
                110 + 30 * np.cos(u / 13 + v / 17) - 6 * opening * mouth, 90 + 0.4 * u + 0.5 * v + 4 * opening * mouth]
    return np.clip(np.stack(channels, axis=-1) + light, 0, 255).round().astype(np.uint8)


def moves(seed: int, frames: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """Return openings and spreads (F,) in pixels of a toy sentence."""
    random = np.random.default_rng(seed)
    time = np.arange(frames) / frames
    opening = 3 + 3 * np.sin(2 * np.pi * (random.uniform(1, 3) * time + random.uniform()))
    return opening, 1.5 * np.sin(2 * np.pi * (random.uniform(1, 3) * time + random.uniform()))


def clip_arrays(seed: int, scale: float = 1.0, angle: float = 0.0, move: tuple[float, float] = (0.0, 0.0),
                light: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return pictures (F, H, W_, 3), points (F, 19, 2) and valid (F,) of a toy sentence in some pose and light."""
    opening, spread = moves(seed)
    images = np.stack([picture(o, scale, angle, move, light) for o in opening])
    points = np.stack([similarity(face(o, s), scale, angle, move) for o, s in zip(opening, spread, strict=True)])
    return images, points, np.ones(len(points), dtype=bool)


def clip(seed: int, **pose: float) -> Clip:
    """Return a toy sentence as a clip."""
    images, points, valid = clip_arrays(seed, **pose)  # type: ignore[arg-type]
    return Clip(f"toy{seed}", 25.0, partial(_give, (points, valid)), partial(_give, images))


def _give(value: object) -> object:
    return value


def clips(count: int = 8) -> list[Clip]:
    """Return toy sentences in slightly different poses."""
    random = np.random.default_rng(7)
    return [clip(seed, angle=float(random.normal(0, 0.03)), move=tuple(random.normal(0, 1, 2)))  # type: ignore[arg-type]
            for seed in range(count)]


def corpus(root: Path, count: int = 6) -> Corpus:
    """Return a prepared toy corpus on disk; its pictures are ``.npy`` files, which the tests read in place of video."""
    utterances = []
    for seed in range(count):
        images, points, valid = clip_arrays(seed, move=(0.3 * seed, 0.2 * seed))
        name, end = f"toy{seed}", len(images) / 25
        files.write_arrays(root / "landmarks" / f"{name}.npz", points=points.astype(np.float32), valid=valid)
        (root / "video").mkdir(exist_ok=True)
        np.save(root / "video" / f"{name}.npy", images)
        phones = Tier("phones", [(0, 0.2, "sil"), (0.2, 0.6, "AA"), (0.6, end, "sil")])
        words = Tier("words", [(0, 0.2, ""), (0.2, 0.6, "ah"), (0.6, end, "")])
        utterances.append(Utterance(name, "ah", Alignment([phones, words]), f"video/{name}.npy", None,
                                    f"landmarks/{name}.npz", Fraction(25), len(images)))
    info = CorpusInfo("toy", (SIZE[1], SIZE[0]), "25", GROUPS)
    Corpus.write(root, info, utterances, {"train": [u.id for u in utterances[:-1]], "test": [utterances[-1].id]})
    return Corpus.open(root)
