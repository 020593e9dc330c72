"""Fit, encode and decode on a toy talker."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from face.aam_cases import CONFIG, GROUPS, clip, clip_arrays, clips, face

from dnnvss.errors import DnnvssError
from dnnvss.face.aam import ActiveAppearanceModel, encode_clip, fit_aam, reconstruct
from dnnvss.face.aam.coding import clip_errors, measure_clip
from dnnvss.face.clips import Clip, UnusableClipError
from dnnvss.face.lips import lip_pairs
from dnnvss.face.pca import components
from dnnvss.robust import robust_limit


@pytest.fixture(scope="module")
def model() -> ActiveAppearanceModel:
    return fit_aam(clips(), GROUPS, CONFIG, progress=False)


@pytest.mark.parametrize("shape", [(40, 700), (700, 40), (900, 800)])
def test_components_against_numpy(shape: tuple[int, int]) -> None:
    random = np.random.default_rng(1)
    rows = random.normal(size=(shape[0], 8)) @ (np.diag(0.5 ** np.arange(8)) @ random.normal(size=(8, shape[1])))
    rows -= rows.mean(axis=0)
    found = components(rows, 4)
    values, vectors = np.linalg.eigh(np.cov(rows.T, bias=True))
    assert found.deviations == pytest.approx(np.sqrt(values[::-1][:4]), rel=1e-6)
    assert np.abs((found.modes * vectors.T[::-1][:4]).sum(axis=1)) == pytest.approx(np.ones(4), abs=1e-6)
    assert found.total == pytest.approx(values.sum(), rel=1e-6)
    assert (found.modes[np.arange(4), np.abs(found.modes).argmax(axis=1)] > 0).all()


def test_share_of_variance_keeps_the_fewest_modes_that_reach_it() -> None:
    rows = np.diag([4.0, 2.0, 1.0, 0.5]).repeat(2, axis=0) * np.tile([1, -1], 4)[:, None]
    # variances 16 : 4 : 1 : 0.25 of 21.25
    assert [len(components(rows, share).modes) for share in (0.5, 0.75, 0.76, 0.95, 0.999)] == [1, 1, 2, 3, 4]


def test_round_trip_of_parameters(model: ActiveAppearanceModel) -> None:
    parameters = np.random.default_rng(2).normal(0, 1, (5, model.size)) * model.deviations
    points, textures = model.decode(parameters)
    back = model.project(points - model.mean_shape, textures - model.mean_texture)
    assert back == pytest.approx(parameters, rel=1e-4, abs=1e-3 * model.deviations[0])


def test_modes_are_orthonormal_in_the_weighted_space_and_deviations_are_theirs(model: ActiveAppearanceModel) -> None:
    shape = model.shape_modes.reshape(model.size, -1) * model.shape_weight
    texture = model.texture_modes.reshape(model.size, -1)
    assert shape @ shape.T + texture @ texture.T == pytest.approx(np.eye(model.size), abs=1e-4)
    found = np.concatenate([measure_clip(model, c).code.parameters for c in clips()])
    assert found.std(axis=0) == pytest.approx(model.deviations, rel=0.02)


def test_reconstruction_of_an_unseen_clip(model: ActiveAppearanceModel) -> None:
    measured = measure_clip(model, clip(100, angle=0.02, move=(1.0, -1.0)))
    total = clip_errors(model, measured)
    rms = np.sqrt(total[0] / total[2])
    assert rms[0] < 0.1 and rms[1] < 1.0
    points, _ = reconstruct(model, measured.code)
    _, truth, _ = clip_arrays(100, angle=0.02, move=(1.0, -1.0))
    gap = points - truth[:, model.layout.rows]
    assert np.sqrt((gap**2).sum(axis=-1).mean()) == pytest.approx(rms[0], rel=1e-3)


@pytest.mark.parametrize(("scale", "angle", "move"), [(1.0, 0.0, (4.0, -3.0)), (1.0, 0.1, (0.0, 0.0)),
                                                       (1.12, -0.06, (2.0, 1.0))])
def test_parameters_do_not_see_head_pose(
    model: ActiveAppearanceModel, scale: float, angle: float, move: tuple[float, float]
) -> None:
    plain = encode_clip(model, *clip_arrays(50), 25.0)
    posed = encode_clip(model, *clip_arrays(50, scale=scale, angle=angle, move=move), 25.0)
    assert np.abs(posed.parameters - plain.parameters).max() < 0.12 * model.deviations[0]  # what resampling leaves
    assert posed.pose[0, :2] == pytest.approx(
        plain.pose[0, 0] * scale * np.array([np.cos(angle), np.sin(angle)]) + plain.pose[0, 1] * scale
        * np.array([-np.sin(angle), np.cos(angle)]), abs=1e-4)


def test_clip_means_are_removed_and_kept_as_offsets(model: ActiveAppearanceModel) -> None:
    plain = encode_clip(model, *clip_arrays(50), 25.0)
    lit = encode_clip(model, *clip_arrays(50, light=12.0), 25.0)
    assert plain.parameters.mean(axis=0) == pytest.approx(0, abs=1e-3)
    assert lit.parameters == pytest.approx(plain.parameters, abs=0.03 * model.deviations[0])
    assert (lit.texture_offset - plain.texture_offset).mean() == pytest.approx(12, abs=0.1)
    kept = fit_aam(clips(), GROUPS, replace(CONFIG, clip_means=False), progress=False)
    code = encode_clip(kept, *clip_arrays(50, light=12.0), 25.0)
    assert not code.shape_offset.any() and not code.texture_offset.any()
    assert np.abs(code.parameters.mean(axis=0)).max() > kept.deviations[0] / 2


def test_encode_of_one_frame_agrees_with_the_clip(model: ActiveAppearanceModel) -> None:
    images, points, valid = clip_arrays(50)
    code = encode_clip(model, images, points, valid, 25.0)
    offset = model.project(code.shape_offset[None], code.texture_offset[None])[0]
    assert model.encode(images[3], points[3]) == pytest.approx(code.parameters[3] + offset, abs=1e-2)


def test_aperture_and_width_are_what_the_points_say(model: ActiveAppearanceModel) -> None:
    parameters = np.random.default_rng(3).normal(0, 1, (4, model.size)) * model.deviations
    points = model.points(parameters)
    assert model.gauges["aperture"](parameters) == pytest.approx(points[:, 9, 1] - points[:, 7, 1])
    assert model.gauges["width"](parameters) == pytest.approx(points[:, 3, 0] - points[:, 0, 0])
    pairs, middle = lip_pairs(face(), np.arange(6, 10))
    assert pairs.tolist() == [[7, 9]] and middle == 0


def test_separate_kind_orders_shape_before_texture() -> None:
    model = fit_aam(clips(), GROUPS, replace(CONFIG, kind="separate", shape_modes=2, texture_modes=0.9), progress=False)
    assert model.names[:3] == ("shape01", "shape02", "texture01")
    parameters = np.zeros(model.size)
    parameters[2:] = 5
    assert model.points(parameters) == pytest.approx(model.mean_shape)
    parameters = np.random.default_rng(2).normal(0, 1, (3, model.size)) * model.deviations
    points, textures = model.decode(parameters)
    assert model.project(points - model.mean_shape, textures - model.mean_texture) == pytest.approx(
        parameters, rel=1e-3, abs=1e-2)


def test_more_shape_weight_means_less_error_in_the_points() -> None:
    errors = []
    for weight in (0.1, 1.0, 10.0):
        model = fit_aam(clips(), GROUPS, replace(CONFIG, modes=2, shape_weight=weight), progress=False)
        total = clip_errors(model, measure_clip(model, clip(100)))
        errors.append(np.sqrt(total[0] / total[2]))
    assert errors[0][0] > errors[1][0] > errors[2][0] and errors[0][1] < errors[2][1]


def test_save_and_load_are_equal(model: ActiveAppearanceModel, tmp_path: Path) -> None:
    loaded = ActiveAppearanceModel.load(model.save(tmp_path / "aam.npz"))
    assert loaded.config == model.config and loaded.landmark_groups == model.landmark_groups
    assert loaded.limits == model.limits
    for name in ("mean_shape", "mean_texture", "shape_modes", "texture_modes", "deviations", "spread"):
        assert (getattr(loaded, name) == getattr(model, name)).all()
    arrays = clip_arrays(60)
    assert (encode_clip(loaded, *arrays, 25.0).parameters == encode_clip(model, *arrays, 25.0).parameters).all()


def test_two_fits_are_equal(model: ActiveAppearanceModel) -> None:
    again = fit_aam(clips(), GROUPS, CONFIG, progress=False)
    assert (again.texture_modes == model.texture_modes).all() and (again.shape_modes == model.shape_modes).all()


def test_a_cut_model_file_says_so(model: ActiveAppearanceModel, tmp_path: Path) -> None:
    path = model.save(tmp_path / "aam.npz")
    path.write_bytes(path.read_bytes()[:2000])
    with pytest.raises(DnnvssError, match=r"aam\.npz: cannot be read"):
        ActiveAppearanceModel.load(path)


def _changed(source: Clip, frames: slice, points: float = 0.0, picture: int | None = None) -> Clip:
    """Return a clip whose mouth points or pictures are wrecked in some frames."""
    marks, valid = source.landmarks()
    images = source.images().copy()
    marks = marks.copy()
    marks[frames, :10] += points * np.random.default_rng(1).normal(size=(len(marks[frames]), 10, 2))
    if picture is not None:
        images[frames] = picture
    return Clip(source.id, 25.0, partial(tuple, (marks, valid)), lambda: images)


def test_ghosts_are_found_left_out_of_the_fit_and_interpolated(model: ActiveAppearanceModel) -> None:
    wrecked = [_changed(clips()[0], slice(0, 3), points=15.0), _changed(clips()[1], slice(5, 7), picture=255)]
    fitted = fit_aam([*wrecked, *clips()[2:]], GROUPS, CONFIG, progress=False)
    assert fitted.mean_shape == pytest.approx(model.mean_shape, abs=0.1)
    assert fitted.deviations[0] == pytest.approx(model.deviations[0], rel=0.1)
    first, second = (measure_clip(fitted, c).code for c in wrecked)
    assert first.outliers == {"shape": [0, 1, 2]} and second.outliers == {"texture": [5, 6]}
    assert not first.valid[:3].any() and first.valid[3:].all()
    assert second.valid.all()  # two frames between measured ones are bridged
    assert (first.parameters[0] == first.parameters[3]).all()
    assert second.parameters[5] == pytest.approx(second.parameters[4] * 2 / 3 + second.parameters[7] / 3, abs=1e-2)


def test_robust_limit_by_hand() -> None:
    assert robust_limit(np.array([1.0, 2.0, 3.0, 4.0, 100.0]), 2.0) == pytest.approx(3 + 2 * 1.4826)
    assert robust_limit(np.ones(5), 10.0, 3.0) == 3.0


def test_invalid_and_missing_points_take_no_part(model: ActiveAppearanceModel) -> None:
    images, points, valid = clip_arrays(50)
    points = points.copy()
    points[4:7] = np.nan
    valid = valid.copy()
    valid[[9, 10, 19]] = False
    code = encode_clip(model, images, points, valid, 25.0)
    assert np.flatnonzero(~code.valid).tolist() == [4, 5, 6, 19] and np.isfinite(code.parameters).all()
    assert code.parameters[9] == pytest.approx(code.parameters[8] * 2 / 3 + code.parameters[11] / 3, abs=1e-3)


@pytest.mark.parametrize(("spoil", "message"), [
    (lambda i, p, v: (i, p, v & False), "no frame has usable landmarks"),
    (lambda i, p, v: (i[:-1], p, v), "has 19 pictures and 20 frames of landmarks"),
    (lambda i, p, v: (i, p[:, :10], v), r"landmarks have shape \(20, 10, 2\)"),
])
def test_clips_that_cannot_be_encoded_say_so(model: ActiveAppearanceModel, spoil: object, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        encode_clip(model, *spoil(*clip_arrays(50)), 25.0)  # type: ignore[operator]


def test_frames_that_are_too_few_to_learn_from_say_so() -> None:
    images, points, valid = clip_arrays(1)
    short = Clip("short", 25.0, lambda: (points[:12], valid[:12]), lambda: images[:12])
    with pytest.raises(DnnvssError, match=r"read from 1 frames, which do not differ\. .*lower aam\.texture_every"):
        fit_aam([short], GROUPS, replace(CONFIG, texture_every=12), progress=False)


def test_no_valid_frame_in_training_says_so() -> None:
    images, points, valid = clip_arrays(1)
    dark = Clip("dark", 25.0, lambda: (points, ~valid), lambda: images)
    with pytest.raises(DnnvssError, match="none of the 1 training clips has a valid frame"):
        fit_aam([dark], GROUPS, CONFIG, progress=False)
    model = fit_aam([dark, *clips()], GROUPS, CONFIG, progress=False)
    with pytest.raises(UnusableClipError):
        measure_clip(model, dark)
