"""The corners of what a talker showed, drawn: no triangle is turned over, and no picture has a hole or a seam."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from dnnvss.corpus import Corpus
from dnnvss.face.aam import AAMConfig, ActiveAppearanceModel, fit_aam
from dnnvss.face.aam.coding import measure_clip
from dnnvss.face.aam.mesh import rim
from dnnvss.face.clips import corpus_clips

SETTINGS = Path(__file__).parents[2] / "conf" / "aam" / "demo.yaml"


@pytest.fixture(scope="module")
def shown(demo: Path) -> tuple[ActiveAppearanceModel, np.ndarray]:
    """The face of the built-in talker, and parameters at both ends of each range and in random corners of them all."""
    corpus = Corpus.open(demo)
    clips = corpus_clips(corpus, list(corpus.utterances.values()))
    model = fit_aam(clips, corpus.info.landmark_groups, AAMConfig.from_dict(yaml.safe_load(SETTINGS.read_text())),
                    progress=False)
    seen = np.concatenate([measure_clip(model, c).code.parameters for c in clips])
    low, high = seen.min(axis=0), seen.max(axis=0)
    corners = np.where(np.random.default_rng(1).random((60, model.size)) < 0.5, low, high)
    return model, np.concatenate([np.diag(low), np.diag(high), corners, 2 * corners])


def filled(picture: np.ndarray, outline: np.ndarray, less: int = 2) -> np.ndarray:
    """Pixels (H, W_) bool inside an outline (R, 2), drawn in by so many pixels, or out if that is negative."""
    mask = cv2.fillPoly(np.zeros(picture.shape[:2], np.uint8), [outline.round().astype(np.int32)], 1)
    for side in (mask[:6], mask[-6:], mask[:, :6], mask[:, -6:]):
        side[:] = 0
    change = cv2.erode if less > 0 else cv2.dilate
    return np.asarray(change(mask, np.ones((2 * abs(less) + 1,) * 2, np.uint8)).astype(bool))


def test_no_triangle_is_turned_over_at_the_corners(shown: tuple[ActiveAppearanceModel, np.ndarray]) -> None:
    model, parameters = shown
    assert not model.guard.folded(model.drawn(parameters, np.zeros_like(model.mean_shape))).any()


def test_pictures_of_corners_have_no_hole(shown: tuple[ActiveAppearanceModel, np.ndarray]) -> None:
    model, parameters = shown
    edge = rim(model.warp.triangles)
    for row in parameters[: len(parameters) // 3 * 2 : 6]:  # those within the ranges
        picture = model.picture(row)
        points = model.drawn(row, np.zeros_like(model.mean_shape)) - model.warp.origin + 6  # drawing's margin
        inside = filled(picture, points[edge]) & ~filled(picture, points[model.layout.outer], -2)  # teeth are white
        assert inside.sum() > 50 and not (picture[inside] == 255).all(axis=1).any()
