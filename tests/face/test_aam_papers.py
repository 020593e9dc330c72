"""The choices of the papers: each file of conf/aam, and on the toy talker what rigid, luminance and parts mean."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT
from face.aam_cases import CONFIG, GROUPS, clip_arrays, clips, face, similarity
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.errors import DnnvssError
from dnnvss.face.aam import AAMConfig, ActiveAppearanceModel, encode_clip, fit_aam, reconstruct
from dnnvss.face.aam.colour import ColourBank, luminance
from dnnvss.face.aam.labelling.schemes import SCHEMES
from dnnvss.face.aam.parts import Part
from dnnvss.face.pose import fit_pose
from dnnvss.render import Neutral, Renderer

MESH_146 = {"face_oval": (0, 36), "lips_outer": (36, 56), "lips_inner": (56, 76), "nose_base": (76, 83),
            "nose_bridge": (83, 90), "nostril_wings": (90, 94), "right_eye": (94, 110), "left_eye": (110, 126),
            "right_brow": (126, 136), "left_brow": (136, 146)}
PARTS = (Part("mouth", ("lips_outer", "lips_inner"), 4), Part("jaw", ("jaw",), 3))


def settings(name: str) -> AAMConfig:
    with initialize_config_dir(str(ROOT / "conf" / "aam"), version_base="1.3"):
        return AAMConfig.from_dict(OmegaConf.to_container(compose(name), resolve=True))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def models() -> Iterator[dict[str, ActiveAppearanceModel]]:
    """The toy talker under the settings of each paper, with the toy's points."""
    found = {}
    for name in ("th07", "c04"):
        paper = settings(name)
        config = replace(CONFIG, kind=paper.kind, shape_modes=paper.shape_modes, texture_modes=paper.texture_modes,
                         texture_shape=paper.texture_shape, alignment=paper.alignment, colour=paper.colour,
                         parts=PARTS if paper.parts else ())
        found[name] = fit_aam(clips(5), GROUPS, config, progress=False)
    yield found


@pytest.mark.parametrize("name, points", [("grid", 34), ("th07", 34), ("c04", 82), ("th03", 102)])
def test_settings_choose_their_points_of_the_face_mesh(name: str, points: int) -> None:
    layout = settings(name).points.layout(MESH_146)
    assert len(layout.rows) == points == len(set(layout.rows))


def test_train_takes_the_settings_by_their_name() -> None:
    with initialize_config_dir(str(ROOT / "conf"), version_base="1.3"):
        chosen = compose("train", ["corpus=grid", "aam=c04", "aam.modes=20"]).aam
    config = AAMConfig.from_dict(OmegaConf.to_container(chosen, resolve=True))  # type: ignore[arg-type]
    assert (config.alignment, config.colour, config.modes) == ("rigid", "luminance", 20)
    assert [part.name for part in config.parts] == ["mouth", "jaw", "eyes"]


def test_hand_labels_have_settings_of_their_own() -> None:
    layout = settings("labelled").points.layout(SCHEMES["lips_jaw_nostrils"].groups)
    assert sorted(layout.rows.tolist()) == list(range(34)) and layout.stable.tolist() == list(range(34, 40))


def test_what_is_at_its_default_is_left_out_of_plain_containers() -> None:
    late = {"alignment": "rigid", "colour": "luminance", "parts": PARTS}
    assert not set(late) & set(AAMConfig().to_dict())
    for name, value in late.items():
        assert name in replace(CONFIG, **{name: value}).to_dict()
    again = AAMConfig.from_dict(replace(CONFIG, parts=PARTS, colour="luminance").to_dict())
    assert again == replace(CONFIG, parts=PARTS, colour="luminance")


@pytest.mark.parametrize("change, message", [
    ({"alignment": "affine"}, "one of similarity, rigid"), ({"colour": "yiq"}, "one of rgb, luminance"),
    ({"parts": [{"name": "mouth"}]}, r"aam\.parts\[0\]\.groups is not set"),
    ({"parts": [{"name": "mouth", "groups": []}]}, "no groups"),
    ({"parts": [{"name": "a", "groups": ["b"], "k": 1}]}, r"aam\.parts\[0\]\.k is no setting"),
    ({"parts": [{"name": "a", "groups": ["b"]}] * 2}, "two parts of one name")])
def test_choices_that_mean_nothing_are_refused(change: dict, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        AAMConfig.from_dict(change)


@pytest.mark.parametrize("parts, message", [
    ((Part("m", ("lips_outer", "lips_inner")),), "'jaw' is in no part"),
    ((*PARTS, Part("x", ("jaw",))), "'jaw' is in two parts"),
    ((*PARTS, Part("x", ("brow",))), "'brow', which is not modelled")])
def test_parts_share_out_the_points(parts: tuple[Part, ...], message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        fit_aam(clips(2), GROUPS, replace(CONFIG, parts=parts), progress=False)


def test_separate_models_refuse_modes_of_a_part_which_they_do_not_use() -> None:
    apart = replace(CONFIG, kind="separate", shape_modes=1, texture_modes=3)
    with pytest.raises(DnnvssError, match="gives mouth modes of its own"):
        fit_aam(clips(2), GROUPS, replace(apart, parts=PARTS), progress=False)
    parts = tuple(replace(part, modes=0) for part in PARTS)
    assert fit_aam(clips(2), GROUPS, replace(apart, parts=parts), progress=False).size == 2 * (1 + 3)


def test_a_rigid_pose_keeps_the_scale() -> None:
    points = np.stack([similarity(face(), s, a, (3.0, -2.0)) for s, a in ((1.1, 0.05), (0.9, -0.1))])
    pose = fit_pose(points, face(), rigid=True)
    assert np.hypot(pose[:, 0], pose[:, 1]) == pytest.approx([1, 1])
    assert np.arctan2(pose[:, 1], pose[:, 0]) == pytest.approx([0.05, -0.1])
    assert pose[:, 2:] == pytest.approx(points.mean(axis=1))


def test_separate_models_keep_the_share_of_variance_of_each(models: dict[str, ActiveAppearanceModel]) -> None:
    model = models["th07"]
    assert model.names[0] == "shape01" and "texture01" in model.names
    more = fit_aam(clips(5), GROUPS, replace(model.config, shape_modes=0.9999, texture_modes=2), progress=False)
    shapes = [n for n in model.names if n.startswith("shape")]
    full = more.deviations[:len([n for n in more.names if n.startswith("shape")])] ** 2
    kept = np.cumsum(full) / full.sum()
    assert kept[len(shapes) - 1] >= 0.949 and (len(shapes) == 1 or kept[len(shapes) - 2] < 0.951)


def test_parts_are_models_of_their_own(models: dict[str, ActiveAppearanceModel]) -> None:
    model = models["c04"]
    assert model.names == ("mouth01", "mouth02", "mouth03", "mouth04", "jaw01", "jaw02", "jaw03")
    at = model.layout.groups
    lips = np.concatenate([at["lips_outer"], at["lips_inner"]])
    assert (model.shape_modes[:4, at["jaw"]] == 0).all() and (model.shape_modes[4:, lips] == 0).all()
    own = [np.abs(model.texture_modes[part]).sum(axis=(0, 2)) > 0 for part in (slice(0, 4), slice(4, 7))]
    assert not (own[0] & own[1]).any() and (own[0] | own[1]).mean() > 0.95
    middle = np.abs(model.warp.matrix @ model.warp.shape - model.mean_shape[lips].mean(axis=0)).sum(axis=1).argmin()
    assert own[0][middle]
    weighted = np.concatenate([model.shape_weight * model.shape_modes.reshape(7, -1),
                               model.texture_modes.reshape(7, -1)], axis=1)
    assert weighted @ weighted.T == pytest.approx(np.eye(7), abs=1e-4)


@pytest.mark.parametrize("name", ["th07", "c04"])
def test_each_paper_encodes_and_draws_the_toy_talker(name: str, models: dict[str, ActiveAppearanceModel]) -> None:
    model = models[name]
    images, points, valid = clip_arrays(50)
    code = encode_clip(model, images, points, valid, 25.0)
    placed, textures = reconstruct(model, code)
    assert np.sqrt(((placed - points[:, model.layout.rows]) ** 2).sum(axis=-1).mean()) < 0.25
    seen = np.stack([model.warp.sample(i, p) for i, p in zip(images, points[:, model.layout.rows], strict=True)])
    assert np.sqrt(((textures - seen) ** 2).mean()) < 4.5
    neutral = Neutral(images[0], points[0, model.layout.rows], code.pose[0], code.shape_offset, code.texture_offset)
    for drawn, image in zip(Renderer(model, neutral).frames(code.parameters), images, strict=True):
        assert np.sqrt(((drawn[44:60, 36:60].astype(float) - image[44:60, 36:60]) ** 2).mean()) < 7


def test_colour_is_that_of_the_nearest_training_frame() -> None:
    random = np.random.default_rng(0)
    textures = [random.integers(0, 256, (3, 5, 3), dtype=np.uint8) for _ in range(2)]
    parameters = np.arange(12.0).reshape(6, 2)
    bank = ColourBank.fit(textures, parameters, centred=False)
    for frame, texture in enumerate(np.concatenate(textures)):
        found = bank.nearest(parameters[frame] + 0.3) + luminance(texture)
        assert np.abs(found - texture).max() <= 128  # the strongest colours do not fit a byte
        mild = np.abs(texture.astype(int) - luminance(texture)).max(axis=-1) < 127
        assert np.abs(found - texture)[mild].max() <= 0.5
    assert (luminance(np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255]], np.uint8))[:, 0] == [76, 150, 29]).all()
    centred = ColourBank.fit([60 + t // 3 for t in textures], parameters, centred=True)
    assert centred.chroma[:3].mean(axis=0) == pytest.approx(centred.chroma[3:].mean(axis=0), abs=1.1)


def test_models_of_both_formats_survive_the_disk(models: dict[str, ActiveAppearanceModel], tmp_path: Path) -> None:
    model = models["c04"]
    again = ActiveAppearanceModel.load(model.save(tmp_path / "aam.npz"))
    parameters = np.random.default_rng(0).normal(size=(3, model.size)) * model.deviations
    for mine, other in zip(model.decode(parameters), again.decode(parameters), strict=True):
        assert (mine == other).all()
    assert again.config == model.config and again.reference.rigid and again.names == model.names
    arrays = read_arrays(tmp_path / "aam.npz")
    assert '"format": 2' in str(arrays["settings"])
    models["th07"].save(tmp_path / "old.npz")
    assert '"format": 1' in str(read_arrays(tmp_path / "old.npz")["settings"])
    arrays["settings"] = np.array(str(arrays["settings"]).replace('"format": 2', '"format": 3'))
    files.write_arrays(tmp_path / "new.npz", **arrays)
    with pytest.raises(DnnvssError, match=r"new\.npz: format=3 is unknown"):
        ActiveAppearanceModel.load(tmp_path / "new.npz")
