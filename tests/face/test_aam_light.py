"""Light and clothes that change: few frames are lost, and what the face shows stays what was tracked."""

from dataclasses import replace

import numpy as np
import pytest
from face.aam_cases import CONFIG, GROUPS, clip, clips

from dnnvss.face.aam import ActiveAppearanceModel, fit_aam
from dnnvss.face.aam.coding import measure_clip, with_lips
from dnnvss.face.aam.light import Skin, steadied
from dnnvss.face.base import APERTURE, LOWER_LIP
from dnnvss.face.clips import Clip
from dnnvss.face.lips import lip_pairs
from dnnvss.timing import bridged


@pytest.fixture(scope="module")
def model() -> ActiveAppearanceModel:
    return fit_aam(clips(), GROUPS, CONFIG, progress=False)


def lit(source: Clip, light: np.ndarray) -> Clip:
    """A clip whose pictures have the gain, offset and slope across of ``light`` (F, 3) in each frame."""
    def images() -> np.ndarray:
        x = source.images().astype(float)
        across = np.linspace(-1, 1, x.shape[2])[:, None]
        gain, offset, slope = (light[:, i, None, None, None] for i in range(3))
        return np.clip(gain * x + offset + slope * across, 0, 255).astype(np.uint8)

    return replace(source, images=images)


def test_light_is_measured_and_taken_out_exactly(model: ActiveAppearanceModel) -> None:
    skin = model.skin
    centre = np.random.default_rng(1).uniform(60, 180, model.mean_texture.shape)
    light = np.array([[0.8, 12.0, -5.0, 3.0]] * 3)
    shown = np.stack([light[c, 0] * centre[:, c] + light[c, 1] + skin.places @ light[c, 2:] for c in range(3)], axis=-1)
    found = skin.lights(shown[None], centre)
    assert found[0] == pytest.approx(light, abs=0.05)
    assert skin.taken_out(shown[None].round().astype(np.uint8), found)[0] == pytest.approx(centre, abs=1.6)
    assert skin.change(found, centre) > 5
    assert skin.change(np.array([[[1.0, 0, 0, 0]] * 3]), centre) == pytest.approx(0)


def test_steady_light_is_left_alone_and_a_white_frame_is_no_light(model: ActiveAppearanceModel) -> None:
    textures = np.tile(np.random.default_rng(2).uniform(60, 180, model.mean_texture.shape), (6, 1, 1)).astype(np.uint8)
    assert steadied(model.skin, textures, np.ones(6, bool)) is textures
    textures[2] = 255
    assert (steadied(model.skin, textures, np.ones(6, bool))[2] == 255).all()


@pytest.mark.parametrize("kind", ["other light", "a step", "a drift"])
def test_no_frame_is_lost_to_light_and_the_lips_stay_where_they_were_tracked(model: ActiveAppearanceModel,
                                                                             kind: str) -> None:
    source = clip(60)
    frames = len(source.landmarks()[0])
    at = np.arange(frames) / frames
    share = {"other light": np.ones(frames), "a step": (at > 0.45).astype(float), "a drift": at}[kind]
    light = np.column_stack([1 - 0.3 * share, 12 * share, 9 * share])
    code = measure_clip(model, lit(source, light)).code
    assert code.valid.all()
    pairs, middle = lip_pairs(model.mean_shape, model.layout.inner)
    upper, lower = pairs[middle]
    tracked = model.stabilise(source.landmarks()[0], code)
    aperture = tracked[:, lower, 1] - tracked[:, upper, 1]
    assert np.corrcoef(model.gauges["aperture"](code.parameters), aperture)[0, 1] > 0.97


def test_gaps_up_to_a_tenth_of_a_second_are_bridged() -> None:
    measured = np.ones(20, bool)
    measured[[0, 3, 4, 8, 9, 10, 19]] = False
    assert np.flatnonzero(bridged(measured, 25.0)).tolist() == [3, 4]
    assert np.flatnonzero(bridged(measured, 30.0)).tolist() == [3, 4, 8, 9, 10]
    assert not bridged(np.zeros(5, bool), 25.0).any()


def test_skin_is_outside_the_lips(model: ActiveAppearanceModel) -> None:
    skin = Skin.of(model.warp, model.layout)
    lips = model.warp.matrix[skin.rows][:, np.union1d(model.layout.inner, model.layout.outer)]
    assert len(skin.rows) and (np.asarray(lips.sum(axis=1)) < 0.5).all()


def test_a_texture_that_says_shut_lips_does_not_shut_the_mouth(model: ActiveAppearanceModel) -> None:
    """Projected parameters miss the points' aperture by so many of its deviations; the toy's upper lip stands still."""
    vector, variance = model.gauges[APERTURE].vector, np.asarray(model.deviations, float) ** 2
    assert model.gauges[LOWER_LIP].vector == pytest.approx(vector, abs=1e-6)
    deviation, least = np.sqrt(variance @ vector**2), variance * vector / (variance @ vector**2)
    true = np.random.default_rng(3).normal(0, 1, (5, model.size)) * model.deviations
    missed = np.array([0.0, 0.3, -0.3, 1.0, -2.0])
    projected = true - np.outer(missed * deviation, least)
    held = with_lips(model, projected, np.tensordot(true, model.shape_modes, axes=1))
    assert held[:3] == pytest.approx(projected[:3], abs=1e-6)
    assert (true - held) @ vector / deviation == pytest.approx([0, 0.3, -0.3, 0.4, -0.4], abs=1e-5)
    assert held[3:] - projected[3:] == pytest.approx(np.outer([0.6 * deviation, -1.6 * deviation], least), abs=1e-4)
