"""A life learnt from a toy talker's recordings, and drawn over pictures without seams."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from face.aam_cases import CONFIG, GROUPS, POINTS, SIZE, clip_arrays, clips, corpus

from dnnvss.face import clips as clips_module
from dnnvss.face.aam import ActiveAppearanceModel, encode_clip, fit_aam
from dnnvss.face.encoding import encode_corpus
from dnnvss.life import EyeModel, EyeRegion, Life, Moves, Tracks
from dnnvss.render import Neutral, living
from dnnvss.render.living import LivingPicture, head_track, kept_life

RINGS = [np.array([[24.0, 22], [30, 19], [36, 22], [30, 25]]), np.array([[60.0, 22], [66, 19], [72, 22], [66, 25]])]
TURN = np.array([0.01, 0.02, 1.5, -0.8])


@pytest.fixture(scope="module")
def model() -> ActiveAppearanceModel:
    return fit_aam(clips(), GROUPS, CONFIG, progress=False)


@pytest.fixture(scope="module")
def neutral(model: ActiveAppearanceModel) -> Neutral:
    images, points, valid = clip_arrays(50)
    code = encode_clip(model, images, points, valid, 25.0)
    return Neutral(images[0], points[0, model.layout.rows], code.pose[0], code.shape_offset, code.texture_offset)


@pytest.fixture(scope="module")
def life() -> Life:
    region = EyeRegion.around(RINGS)
    model = EyeModel.fit(region, np.full((4, *region.weight.shape, 3), 25.0))
    tracks = Tracks(np.array([0, 4]), np.zeros((4, 1)), np.zeros(4), np.ones(4), np.zeros((4, 4)), np.zeros(4, int),
                    25.0)
    return Life(model, tracks)


def _drawn(living: LivingPicture, picture: np.ndarray, eyes: np.ndarray, head: np.ndarray) -> np.ndarray:
    return next(living.over(iter([picture]), Moves(eyes[None], head[None], np.zeros(0))))


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_a_still_face_is_the_picture_itself(model: ActiveAppearanceModel, neutral: Neutral, life: Life, scale: float
                                            ) -> None:
    picture = np.random.default_rng(1).integers(0, 256, (int(SIZE[0] * scale), int(SIZE[1] * scale), 3), np.uint8)
    drawn = _drawn(LivingPicture(life, model, neutral, scale), picture, np.zeros(2), np.zeros(4))
    assert (drawn == picture).all()


def test_eyes_are_added_where_they_are_and_fade_out(model: ActiveAppearanceModel, neutral: Neutral, life: Life) -> None:
    flat = np.full((*SIZE, 3), 100, np.uint8)
    size = float(np.linalg.norm(25.0 * np.ones((*life.model.region.weight.shape, 3))
                                * life.model.region.weight[..., None]))
    drawn = _drawn(LivingPicture(life, model, neutral), flat, np.array([0, size]), np.zeros(4)).astype(int) - 100
    sign = np.sign(drawn.sum())
    assert abs(sign * drawn[22, 30] - 25).max() <= 1 and abs(sign * drawn[22, 66] - 25).max() <= 1
    assert (drawn[40:] == 0).all() and np.abs(np.diff(drawn, axis=0)).max() <= 14


def test_shut_eyes_lose_the_neutral_frames_own_detail(model: ActiveAppearanceModel, life: Life, neutral: Neutral
                                                      ) -> None:
    image = neutral.image.copy()
    image[20:24, 29:33] = 0  # a pupil
    drawn = _drawn(LivingPicture(life, model, replace(neutral, image=image)), image, np.array([1.0, 0]), np.zeros(4))
    assert drawn[20:24, 29:33].min() > 40 and (drawn[40:] == image[40:]).all()


def test_the_head_moves_and_the_border_stays(model: ActiveAppearanceModel, neutral: Neutral, life: Life) -> None:
    drawing = LivingPicture(life, model, neutral)
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    ramp = np.stack([2.0 * x, 2.0 * y, x + y], axis=-1).round().astype(np.uint8)
    drawn = _drawn(drawing, ramp, np.zeros(2), TURN).astype(float)
    at = np.rint(neutral.pose[2:]).astype(int)
    assert drawn[at[1], at[0]] - ramp[at[1], at[0]] == pytest.approx([-3, 1.6, -0.7], abs=0.8)
    border = np.ones(SIZE, bool)
    border[1:-1, 1:-1] = False
    assert (drawn[border] == ramp[border]).all()
    assert np.diff(drawn[..., 0], axis=1).min() >= 0 and np.diff(drawn[..., 1], axis=0).min() >= 0  # nothing folds


def test_pictures_that_differ_in_a_part_are_drawn_as_if_they_differed_anywhere(
        model: ActiveAppearanceModel, neutral: Neutral, life: Life) -> None:
    drawing, random = LivingPicture(life, model, neutral), np.random.default_rng(2)
    pictures = np.repeat(random.integers(0, 256, (1, *SIZE, 3), np.uint8), 40, axis=0)
    pictures[:, 30:50, 40:70] = random.integers(0, 256, (40, 20, 30, 3), np.uint8)
    moves = Moves(random.normal(0, 30, (40, 2)), TURN * random.normal(0, 1, (40, 4)), np.zeros(0))
    known = np.stack(list(drawing.over(iter(pictures), moves, (slice(30, 50), slice(40, 70)))))
    np.testing.assert_array_equal(known, np.stack(list(drawing.over(iter(pictures), moves))))


def test_a_heads_track_is_its_pose_against_the_mean(model: ActiveAppearanceModel) -> None:
    pose = np.array([[1.0, 0.0, 40, 30], [1.0, 0.0, 44, 30]])
    assert head_track(pose, model) == pytest.approx(np.array([[0, 0, -2, 0], [0, 0, 2, 0.0]]))


def test_what_is_learnt_is_kept_beside_the_encoding(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clips_module, "video_frames", np.load)
    monkeypatch.setattr(living, "read_video", np.load)
    toy = corpus(tmp_path / "toy")
    splits = {"train": [f"toy{i}" for i in range(5)], "test": ["toy5"]}
    eyes = replace(CONFIG, points=replace(POINTS, eyes=("eyes",)))
    encoded = encode_corpus(toy, splits, eyes, tmp_path / "aam", progress=False)
    path = kept_life(toy, encoded)
    assert path is not None and path.parent == encoded.folder and kept_life(toy, encoded) == path
    life = Life.load(path)
    assert len(life.tracks) == 5 and life.tracks.head.shape == (100, 4)
    assert life.tracks.recorded == []  # the toy's eyes are painted on, and never shut
    told = life.tracks.eyes[life.tracks.whole == 0]  # open eyes are told as differences from the clip's open ones
    assert len(told) > 80 and np.abs(np.median(told, axis=0)).max() < 5


def test_a_face_without_eyes_has_no_life(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clips_module, "video_frames", np.load)
    toy = corpus(tmp_path / "toy")
    encoded = encode_corpus(toy, {"train": ["toy0", "toy1", "toy2"]}, CONFIG, tmp_path / "aam", progress=False)
    assert kept_life(toy, encoded) is None
