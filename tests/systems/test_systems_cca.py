"""Mappings from sound to face: linear ones come back, regions do what they say, context is all they see."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK, make_example

from dnnvss.acoustics import LogMel
from dnnvss.curves import STATIC_DELTA_DELTA2, derivatives, smoothing_spline
from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable, Settings, encode, expand
from dnnvss.media import Sound
from dnnvss.systems import Example
from dnnvss.systems.cca import CanonicalRegression, CanonicalSettings
from dnnvss.systems.context import offsets, with_context
from dnnvss.systems.mapping import AudioVisual, cluster, fit_mapping, nearest

TABLE = FeatureTable(("logmel", "phone_span"), Settings(logmel=LogMel(bands=4), logmel_offsets=(-2, 2)))


def heard(seed: int) -> Example:
    """Random phones under noise that swells at random; parameters follow its log power linearly, one a step later."""
    example = make_example(f"e{seed}", np.random.default_rng(seed), 2)
    rng, frames = np.random.default_rng(seed + 100), len(example.codes)
    loud = np.exp(np.interp(np.arange(160 * frames) / 1600, np.arange(frames), rng.uniform(-4, -1, frames)))
    sound = Sound(rng.normal(size=160 * frames) * loud, 16000)
    codes = encode(example.alignment, "word", TABLE, CLOCK, sound)
    rows = expand(codes)
    late = with_context(rows, (-4,))
    static = np.stack([rows[:, 0] - 2 * rows[:, 1], late[:, 2] + 1], axis=1)
    return replace(example, codes=codes, targets=derivatives(static, STATIC_DELTA_DELTA2).astype(np.float32))


@pytest.fixture(scope="module")
def material() -> tuple[list[Example], list[Example]]:
    return [heard(k) for k in range(6)], [heard(k) for k in (10, 11)]


def fitted(material: tuple[list[Example], list[Example]], folder: Path, **settings: object) -> CanonicalRegression:
    model = CanonicalRegression(TABLE, CLOCK, CanonicalSettings(**settings))
    model.fit(*material, folder)
    return model


def test_what_is_linear_comes_back(material: tuple, tmp_path: Path) -> None:
    model = fitted(material, tmp_path, context=1, cutoff=None)
    for example in material[1]:
        np.testing.assert_allclose(model.predict(example).mean, example.targets, atol=1e-3)


def test_without_context_what_is_late_is_missed(material: tuple, tmp_path: Path) -> None:
    mean = fitted(material, tmp_path, context=0, cutoff=None).predict(material[1][0]).mean[:, 0]
    targets = material[1][0].targets[:, 0]
    assert np.corrcoef(mean[:, 0], targets[:, 0])[0, 1] > 0.999
    assert np.corrcoef(mean[:, 1], targets[:, 1])[0, 1] < 0.9


def test_groups_apart_with_all_factors_change_nothing_and_fewer_factors_do(material: tuple, tmp_path: Path) -> None:
    together = fitted(material, tmp_path, cutoff=None)
    model = CanonicalRegression(TABLE, CLOCK, CanonicalSettings(cutoff=None))
    model.groups = ((0,), (1,))
    model.fit(*material, tmp_path)
    np.testing.assert_allclose(model.predict(material[1][0]).mean, together.predict(material[1][0]).mean, atol=1e-5)
    single = fitted(material, tmp_path, cutoff=None, factors=1).predict(material[1][0]).mean[:, 0]
    assert np.linalg.matrix_rank(single - single.mean(0), tol=1e-3) == 1


def test_the_trajectory_is_the_spline_of_the_mapping(material: tuple, tmp_path: Path) -> None:
    example = material[1][0]
    raw = fitted(material, tmp_path, cutoff=None).predict(example).mean[:, 0]
    smooth = fitted(material, tmp_path, cutoff=5.0).predict(example).mean[:, 0]
    np.testing.assert_allclose(smooth, smoothing_spline(raw, CLOCK, 5.0), atol=1e-9)


def test_blocks_averaged_are_weighed_by_their_worth(material: tuple, tmp_path: Path) -> None:
    model = fitted(material, tmp_path, blocks="averaged", cutoff=None)
    sound, span = model.weights_
    np.testing.assert_allclose(sound, 1, atol=1e-2)
    assert (span >= 0).all() and (span < 0.05).all()  # the parameters do not follow phones
    np.testing.assert_allclose(model.predict(material[1][0]).mean[:, 0], material[1][0].targets[:, 0], atol=0.3)


def test_a_frame_sees_its_context_and_nothing_else(material: tuple, tmp_path: Path) -> None:
    model = fitted(material, tmp_path, context=2, cutoff=None)
    example = material[1][0]
    changed = example.codes.arrays["logmel"].copy()
    changed[50] += 1
    other = replace(example, codes=replace(example.codes, arrays={**example.codes.arrays, "logmel": changed}))
    moved = np.abs(model.predict(other).mean - model.predict(example).mean)[:, 0].max(axis=1) > 1e-9
    assert set(np.flatnonzero(moved)) <= {42, 46, 50, 54, 58} and moved.sum() >= 2


def test_offsets_are_in_seconds() -> None:
    assert offsets(2, 0.04, CLOCK) == (-8, -4, 0, 4, 8)
    rows = np.arange(4.0)[:, None]
    np.testing.assert_array_equal(with_context(rows, (-1, 0, 2)), [[0, 0, 2], [0, 1, 3], [1, 2, 3], [2, 3, 3]])


def test_regions_have_mappings_of_their_own() -> None:
    rng = np.random.default_rng(0)
    x = np.concatenate([rng.normal(-5, 1, (200, 1)), rng.normal(5, 1, (200, 1))])
    y = np.where(x < 0, 1 - 2 * x, 3 * x)
    one, two = (fit_mapping([(x, y)], [(0,)], regions=count) for count in (1, 2))
    assert np.abs(one(x) - y).max() > 1
    np.testing.assert_allclose(two(x), y, atol=1e-8)
    again = AudioVisual.from_state(two.state())
    np.testing.assert_array_equal(again(x), two(x))


def test_clusters_that_are_apart_come_back_whatever_the_start() -> None:
    rng = np.random.default_rng(0)
    true = rng.normal(size=(6, 3)) * 20
    rows = np.repeat(true, 30, axis=0) + 0.1 * rng.normal(size=(180, 3))
    found = cluster(rows, 6, starts=10)
    np.testing.assert_allclose(found[nearest(true, found)], true, atol=0.2)
    assert len(cluster(rows[:3], 6, starts=1)) == 3


def test_settings_out_of_range() -> None:
    for wrong in ({"context": -1}, {"factors": 0}, {"ridge": -0.1}, {"blocks": "some"}, {"regions": 0}):
        with pytest.raises(DnnvssError, match=f"model.{next(iter(wrong))}="):
            CanonicalSettings(**wrong)
