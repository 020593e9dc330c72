"""Point sets and settings: rows by group, and the YAML files against the defaults."""

from pathlib import Path

import numpy as np
import pytest
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from dnnvss.corpus.talker.geometry import LANDMARK_GROUPS
from dnnvss.errors import DnnvssError
from dnnvss.face.aam import AAMConfig, PointSet
from dnnvss.face.aam.labelling.schemes import SCHEMES
from dnnvss.formats import LAYOUT_68

CONF = Path(__file__).parents[2] / "conf" / "aam"
GRID = {"face_oval": (0, 36), "lips_outer": (36, 56), "lips_inner": (56, 76), "nose_base": (76, 83),
        "nose_bridge": (83, 90), "nostril_wings": (90, 94), "right_eye": (94, 110), "left_eye": (110, 126)}


def _yaml(name: str) -> dict:
    with initialize_config_dir(str(CONF), version_base=None):
        return OmegaConf.to_container(compose(name), resolve=True)


def test_default_yaml_is_the_default() -> None:
    assert AAMConfig.from_dict(_yaml("default")) == AAMConfig()


@pytest.mark.parametrize("name", [p.stem for p in CONF.glob("*.yaml")])
def test_every_yaml_is_understood_and_survives_plain_containers(name: str) -> None:
    config = AAMConfig.from_dict(_yaml(name))
    assert AAMConfig.from_dict(config.to_dict()) == config


def test_default_set_has_34_points_in_the_groups_of_a_face_mesh() -> None:
    layout = PointSet().layout(GRID)
    assert len(layout.rows) == len(set(layout.rows.tolist())) == 34
    assert layout.rows[layout.outer].tolist() == [36, 38, 40, 41, 42, 44, 46, 48, 50, 51, 52, 54]
    assert layout.rows[layout.inner].tolist() == [56, 59, 61, 63, 66, 69, 71, 73]
    assert layout.rows[layout.groups["face_oval"]].tolist() == [11, 13, 14, 16, 18, 20, 22, 23, 25]
    assert layout.stable.tolist() == [*range(94, 126), *range(83, 87), *range(90, 94), 0, 1, 2, 33, 34, 35]
    assert layout.needed == 126


def test_grid_uses_the_default_and_the_other_layouts_fit_their_corpora() -> None:
    assert AAMConfig.from_dict(_yaml("grid")) == AAMConfig()
    assert len(AAMConfig.from_dict(_yaml("folder")).points.fitted(LAYOUT_68).layout(LAYOUT_68).rows) == 36
    assert len(AAMConfig.from_dict(_yaml("demo")).points.layout(LANDMARK_GROUPS).rows) == 56


def test_each_labelling_scheme_has_settings_that_fit_it_and_others_refuse_it() -> None:
    fitting = {"lips_jaw_nostrils": ("labelled", 34), "ibug68": ("folder", 36), "face100": ("face100", 100)}
    for scheme, (name, points) in fitting.items():
        groups = SCHEMES[scheme].groups
        assert len(AAMConfig.from_dict(_yaml(name)).points.fitted(groups).layout(groups).rows) == points
    labelled = SCHEMES["lips_jaw_nostrils"].groups
    chosen = PointSet.from_setting("auto", "aam.points").fitted(labelled)
    assert chosen == AAMConfig.from_dict(_yaml("labelled")).points and len(chosen.layout(labelled).rows) == 34
    with pytest.raises(DnnvssError, match=r"none of the known point sets fits.*face_oval \(23\).*aam=face100"):
        PointSet.from_setting("auto", "aam.points").fitted(SCHEMES["face100"].groups)


@pytest.mark.parametrize(("change", "message"), [
    ({"points": {"lips_outer": "all", "lips_inner": "all", "chin": "all"}}, "no landmark group 'chin'"),
    ({"points": {"lips_outer": [0, 1, 2, 20], "lips_inner": "all"}}, "has 20 points, and index 20"),
    ({"points": {"lips_outer": [0, 1, 2, 2], "lips_inner": "all"}}, "names a landmark twice"),
    ({"points": {"lips_outer": "all"}}, "models 0 points of 'lips_inner'"),
    ({"points": {"lips_outer": "some"}}, "lips_outer=some is no all or list"),
    ({"stable": {"nose_bridge": [0]}}, "1 stable points"),
    ({"colour": 1}, r"aam\.points\.colour is no setting"),
])
def test_point_sets_that_do_not_fit_say_so(change: dict, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        PointSet.from_setting(change, "aam.points").layout(GRID)


@pytest.mark.parametrize("change", [{"kind": "both"}, {"modes": 0}, {"pose_smoothing": -1.0}, {"outlier": float("nan")},
                                    {"mode": 3}])
def test_settings_out_of_range_say_so(change: dict) -> None:
    with pytest.raises(DnnvssError, match=r"aam\."):
        AAMConfig.from_dict(change)


def test_rows_are_numpy_integers() -> None:
    assert np.issubdtype(PointSet().layout(GRID).rows.dtype, np.integer)
