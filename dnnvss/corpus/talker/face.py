"""Pictures of the talker: the portrait bent by the articulators, with the mouth painted over it."""

from collections.abc import Iterator
from functools import cache

import cv2
import numpy as np

from dnnvss.corpus.talker.geometry import SHEET, SKIN_FROM, field_weights, head_fields, skin_fields
from dnnvss.corpus.talker.mouth import paint_mouth
from dnnvss.corpus.talker.portrait import FINER, LIDS, portrait
from dnnvss.corpus.talker.targets import Articulators


def render_frame(articulators: Articulators, size: int = SHEET) -> np.ndarray:
    """Return the picture of a face in this state, uint8 RGB, shape (size, size, 3); without camera noise."""
    basis, still = _maps(size)
    weights = field_weights(np.array([articulators]))[0].astype(np.float32)
    at = still - np.tensordot(weights[:3], basis[:3], axes=1)
    calm = round(SKIN_FROM * size / SHEET)
    at[calm:] -= np.tensordot(weights[3:], basis[3:, calm:], axes=1)
    lid = round(min(max(articulators.blink, 0.0), 1.0) * LIDS)
    picture = cv2.remap(portrait(size, lid), at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    paint_mouth(picture, articulators)
    return picture


@cache
def _maps(size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return displacements (8, size, size, 2) and places (size, size, 2) in pixels of the portrait."""
    finer = FINER * size / SHEET
    centres = (np.arange(size) + 0.5) * (SHEET / size)
    points = np.stack(np.meshgrid(centres, centres), axis=-1)
    basis = np.concatenate([head_fields(points), skin_fields(points)])
    return (basis * finer).astype(np.float32), (points * finer - 0.5).astype(np.float32)


_GRAIN = 1.5  # standard deviation of the camera's noise in grey levels
_TILES, _SLACK = 8, 64


def film(rows: np.ndarray, size: int, random: np.random.Generator) -> Iterator[np.ndarray]:
    """Yield the picture of every frame of ``rows`` (F, 12), uint8 RGB (size, size, 3), with the camera's noise."""
    for row in rows:
        picture = render_frame(Articulators(*row.tolist()), size)
        top, left = random.integers(_SLACK, size=2)
        more, less = (tile[top : top + size, left : left + size] for tile in _grain(size)[int(random.integers(_TILES))])
        yield cv2.subtract(cv2.add(picture, more), less)


@cache
def _grain(size: int) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return tiles of noise, each as what it adds and what it takes away, uint8, a little larger than the picture."""
    shape = (_TILES, size + _SLACK, size + _SLACK, 3)
    noise = np.random.default_rng(size).normal(0, _GRAIN, shape).round()
    return [(np.maximum(tile, 0).astype(np.uint8), np.maximum(-tile, 0).astype(np.uint8)) for tile in noise]
