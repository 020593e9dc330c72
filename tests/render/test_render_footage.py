"""The face put back into footage of the toy talker, and the other views."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from face.aam_cases import CONFIG, GROUPS, SIZE, clip_arrays, clips, moves, picture

from dnnvss.errors import DnnvssError
from dnnvss.face.aam import ActiveAppearanceModel, encode_clip, fit_aam
from dnnvss.render import Footage, Revoicer, walk
from dnnvss.render.patch import Patch
from dnnvss.render.views import draw_mesh, mesh_frames, patch_frames

MOUTH = np.s_[42:62, 34:62]


@pytest.fixture(scope="module")
def model() -> ActiveAppearanceModel:
    return fit_aam(clips(), GROUPS, CONFIG, progress=False)


def footage(model: ActiveAppearanceModel, seed: int, **pose: float) -> tuple[Footage, np.ndarray]:
    images, points, valid = clip_arrays(seed, **pose)  # type: ignore[arg-type]
    return Footage(images, encode_clip(model, images, points, valid, 25.0), Fraction(25), f"toy{seed}"), points


def test_own_parameters_give_the_footage_back(model: ActiveAppearanceModel) -> None:
    shown, points = footage(model, 50, angle=0.03)
    revoicer = Revoicer(model, shown, np.arange(len(shown)))
    for drawn, image in zip(revoicer.frames(shown.code.parameters), shown.images, strict=True):
        assert np.abs(drawn.astype(int) - image).max() <= 12
        assert (drawn[:28] == image[:28]).all() and (drawn[:, :10] == image[:, :10]).all()
    placed = revoicer.points_in_image(shown.code.parameters)
    assert np.abs(placed - points[:, model.layout.rows]).mean() < 0.1


def test_other_words_take_the_pose_and_the_light_of_the_footage(model: ActiveAppearanceModel) -> None:
    """The toy's pictures are known for any opening, pose and light: the revoiced frame must be that picture."""
    shown, _ = footage(model, 50, angle=0.05, light=25.0)
    said, _ = footage(model, 61)
    revoicer = Revoicer(model, shown, np.arange(len(shown)))
    opening = moves(61)[0] - moves(61)[0].mean() + moves(50)[0].mean()  # codes are about the mean of their clip
    errors, still = [], []
    for t, drawn in enumerate(revoicer.frames(said.code.parameters)):
        truth = picture(opening[t], angle=0.05, light=25.0).astype(float)
        errors.append((drawn - truth)[MOUTH])
        still.append((shown.images[t] - truth)[MOUTH])
    assert np.sqrt(np.mean(np.square(errors))) < 0.5 * np.sqrt(np.mean(np.square(still)))
    assert np.abs(np.mean(errors)) < 3  # the light is the footage's, 25 grey levels from the other clip's


def test_the_picture_below_goes_with_the_jaw(model: ActiveAppearanceModel) -> None:
    """The toy's skin is smooth: a seam or a tear would be the steepest step in the picture."""
    shown, _ = footage(model, 50)
    wide = shown.code.parameters[model.gauges["aperture"](shown.code.parameters).argmax()] * 1.3
    shut = int(model.gauges["aperture"](shown.code.parameters).argmin())
    drawn = next(Revoicer(model, shown, np.array([shut])).frames(wide[None])).astype(int)
    assert np.abs(np.diff(drawn[56:], axis=0)).max() <= 14 and np.abs(np.diff(drawn[56:], axis=1)).max() <= 14


def test_a_larger_picture_has_its_points_where_it_shows_them(model: ActiveAppearanceModel) -> None:
    shown, points = footage(model, 50)
    revoicer = Revoicer(model, shown, np.arange(len(shown)), scale=2.0)
    assert revoicer.size == (2 * SIZE[1], 2 * SIZE[0])
    assert next(revoicer.frames(shown.code.parameters)).shape == (2 * SIZE[0], 2 * SIZE[1], 3)
    often = np.repeat(shown.code.parameters, 4, axis=0)
    assert np.abs(revoicer.points_in_image(often)[::4] - 2 * points[:, model.layout.rows]).mean() < 0.2


@pytest.mark.parametrize("scale", [0, -1])
def test_a_size_that_is_none_is_refused(model: ActiveAppearanceModel, scale: float) -> None:
    with pytest.raises(DnnvssError, match=f"render scale is {scale}"):
        Revoicer(model, footage(model, 50)[0], np.arange(5), scale=scale)


def test_long_speech_walks_back_and_forth_and_turns_where_the_head_is_still() -> None:
    pose = np.column_stack([np.ones(20), np.zeros(20), np.cumsum(np.ones(20)), np.zeros(20)])
    pose[17:, 2] = pose[17, 2]  # the head stands still at the end
    pose[:3, 2] = pose[2, 2]
    order = walk(pose, 60, "pingpong")
    assert len(order) == 60 and np.abs(np.diff(order)).max() == 1 and order[0] == 0
    turns = order[1:-1][np.diff(np.sign(np.diff(order))) != 0]
    assert set(turns.tolist()) <= {0, 1, 18, 19}
    assert walk(pose, 5, "pingpong").tolist() == [0, 1, 2, 3, 4]
    assert walk(pose, 23, "hold")[-4:].tolist() == [19, 19, 19, 19]
    with pytest.raises(DnnvssError, match="into_fill is 'loop'"):
        walk(pose, 5, "loop")


def test_only_frames_with_landmarks_are_used(model: ActiveAppearanceModel) -> None:
    shown, _ = footage(model, 50)
    valid = np.ones(len(shown), bool)
    valid[[0, 1, 9]] = False
    part, first = replace(shown, code=replace(shown.code, valid=valid)).usable()
    assert (first, len(part)) == (10, 10) and (part.images == shown.images[10:]).all()
    assert (part.code.pose == shown.code.pose[10:]).all()
    with pytest.raises(DnnvssError, match=r"toy50: no 5 frames in a row"):
        replace(shown, code=replace(shown.code, valid=np.arange(len(shown)) % 4 > 0)).usable()
    with pytest.raises(DnnvssError, match="another model"):
        Revoicer(model, replace(shown, code=replace(shown.code, parameters=shown.code.parameters[:, :3])), np.arange(3))


def test_patch_and_mesh_lie_where_the_face_has_them(model: ActiveAppearanceModel) -> None:
    shown, points = footage(model, 50)
    revoicer = Revoicer(model, shown, np.arange(len(shown)))
    patch = next(patch_frames(model, revoicer, shown.code.parameters)).astype(int)
    assert np.abs(patch[46:52, 40:56] - shown.images[0][46:52, 40:56]).max() <= 10 and (patch[:40] == 255).all()
    mesh = next(mesh_frames(model, revoicer, shown.code.parameters))
    x, y = np.floor(points[0, model.layout.rows[12]]).astype(int)  # a point of the jaw
    assert mesh[y, x].max() < 200 and (mesh[:40] == 255).all()
    over = draw_mesh(shown.images[0], model, points[0, model.layout.rows])
    assert (over[:40] == shown.images[0][:40]).all() and (over != shown.images[0]).any()


def test_sharpening_is_linear_stays_in_the_mouth_and_leaves_what_is_even(model: ActiveAppearanceModel) -> None:
    patch, random = Patch(model), np.random.default_rng(0)
    one, other = random.normal(100, 20, (2, *model.mean_texture.shape)).astype(np.float32)
    both = 2 * patch.sharpened(one) - patch.sharpened(other)
    assert patch.sharpened(2 * one - other) == pytest.approx(both, abs=1e-2)
    even = np.full_like(one, 130)
    assert patch.sharpened(even) == pytest.approx(even, abs=1e-3)
    places = model.warp.matrix @ model.warp.shape
    contour = model.warp.shape[model.layout.inner]
    outside = ((places < contour.min(axis=0) - 4) | (places > contour.max(axis=0) + 4)).any(axis=1)
    changed = np.abs(patch.sharpened(one) - one).max(axis=1)
    assert changed[outside].max() < 0.1 and changed[~outside].max() > 5
    assert (Patch(model, sharpness=0).sharpened(one) == one).all()
