"""What every kind of face keeps to, and who may look behind the protocol."""

import re
from pathlib import Path

import numpy as np
import pytest
from face import aam_cases, rig_cases
from face.aam_cases import CONFIG, POINTS

from dnnvss.errors import DnnvssError
from dnnvss.face import clips as clips_module
from dnnvss.face import encoding as encoding_module
from dnnvss.face.base import APERTURE, LOWER_LIP, WIDTH, Face, Textured, largest_groups, name_groups, region_form
from dnnvss.face.encoding import encode_corpus
from dnnvss.face.kinds import FACES, FaceSettings, face_kind, load_face, read_face_settings
from dnnvss.face.points.settings import PointsSettings
from dnnvss.face.rig import RigSettings

ROOT = Path(__file__).parents[2]
TOYS: dict[str, FaceSettings] = {"aam": CONFIG, "points": PointsSettings(points=POINTS, modes=4, pose_smoothing=0.0),
                                 "rig": RigSettings()}
"""Settings of each kind for the toy talker."""
CASES = {"aam": aam_cases, "points": aam_cases, "rig": rig_cases}
POINTED = [kind for kind in FACES if kind != "rig"]
"""Kinds that have points: a rig has curves alone."""
AAM_WORDS = r"\.(shape_modes|texture_modes|mean_shape|mean_texture|decode_shape|decode_texture|warp)\b(?!\()"
LAYOUT = r"(?<!frame)\.layout\b(?!\()"
"""Which landmarks are what in a corpus: the business of kinds of faces and of what draws them."""
KNOW_LAYOUTS = {"dnnvss/render/sketch.py", "dnnvss/studio/labelling.py", "dnnvss/evaluation/outside/lips.py"}
DRAWS_AAM = {f"dnnvss/render/{name}.py" for name in
             ("filmed", "footage", "living", "neutral", "patch", "renderer", "views")}


@pytest.fixture(scope="module")
def faces() -> dict[str, Face]:
    """The toy talker's face of each kind."""
    return {name: face_kind(name).fit(CASES[name].clips(), CASES[name].GROUPS, settings, progress=False)
            for name, settings in TOYS.items()}


def movement(face: Face, frames: int = 7) -> np.ndarray:
    """Random parameters (F, D) as large as those of the fit."""
    return np.random.default_rng(3).normal(size=(frames, len(face.names))) * face.deviations


def test_every_kind_has_a_toy() -> None:
    assert set(TOYS) == set(FACES)
    assert all(face_kind(name).name == name for name in FACES)


@pytest.mark.parametrize("kind", FACES)
def test_names_groups_and_sizes(kind: str, faces: dict[str, Face]) -> None:
    face = faces[kind]
    assert face.kind == kind and len(set(face.names)) == len(face.names) == len(face.deviations)
    assert (face.deviations > 0).all() and dict(face.groups) == name_groups(face.names)
    points = face.points(movement(face))
    assert points.shape == (7, *face.jacobian().shape[1:]) and points.shape[2] in (2, 3)
    assert face.points(movement(face)[0]).shape == points.shape[1:]
    assert all(0 <= i < points.shape[1] for line in face.contours.values() for i in line)


@pytest.mark.parametrize("kind", FACES)
def test_points_and_gauges_are_linear(kind: str, faces: dict[str, Face]) -> None:
    face = faces[kind]
    x, zero, size = movement(face), np.zeros(len(face.names)), len(face.names)
    moved = face.points(zero) + np.tensordot(x, face.jacobian(), axes=1)
    assert face.points(x) == pytest.approx(moved, abs=1e-6)
    for name, gauge in face.gauges.items():
        assert gauge.name == name and gauge.vector.shape == (size,) and gauge.at_rest == gauge(zero)
        slope = [gauge(row) - gauge(zero) for row in np.eye(size)]
        assert slope == pytest.approx(gauge.vector, abs=1e-9)
        assert gauge(x).shape == (7,) and gauge(0.5 * x) - gauge(zero) == pytest.approx(0.5 * (gauge(x) - gauge(zero)))


@pytest.mark.parametrize("kind", POINTED)
def test_regions_are_as_large_as_what_changes_in_them(kind: str, faces: dict[str, Face]) -> None:
    face = faces[kind]
    change, line = movement(face)[0], next(iter(face.contours.values()))
    moved = (face.points(change) - face.points(np.zeros(len(change))))[list(line)]
    form, whole = region_form(face, list(line)), region_form(face, range(face.jacobian().shape[1]))
    assert np.linalg.eigvalsh(form).min() > -1e-9 and np.linalg.eigvalsh(whole - form).min() > -1e-6
    if kind != "aam":
        assert change @ form @ change == pytest.approx((moved**2).sum())
        return
    weight, seen = face.shape_weight, face.decode_texture(change) - face.mean_texture
    assert change @ form @ change > weight**2 * (moved**2).sum()
    assert whole == pytest.approx(np.eye(len(change)), abs=1e-4)
    assert change @ whole @ change == pytest.approx(
        weight**2 * ((face.points(change) - face.mean_shape) ** 2).sum() + (seen.astype(float)**2).sum(), rel=1e-4)


def test_the_largest_groups_share_no_parameter() -> None:
    names = ("shape01", "shape02", "texture01", "texture02", "texture03")
    assert largest_groups(name_groups(names)) == {"shape": (0, 1), "texture": (2, 3, 4)}
    assert largest_groups(name_groups(("a", "b"))) == {"a": (0,), "b": (1,)}


@pytest.mark.parametrize("kind", POINTED)
def test_gauges_of_the_mouth_are_what_the_points_say(kind: str, faces: dict[str, Face]) -> None:
    face = faces[kind]
    x = movement(face)
    points, left, right = face.points(x), *(list(face.contours["lips_outer"])[i] for i in (0, 3))
    upper, lower = (list(face.contours["lips_inner"])[i] for i in (1, 3))
    said = {APERTURE: points[:, lower, 1] - points[:, upper, 1], LOWER_LIP: points[:, lower, 1],
            WIDTH: points[:, right, 0] - points[:, left, 0]}
    for name, values in said.items():
        assert face.gauges[name](x) == pytest.approx(values) and face.gauges[name].unit == face.unit


@pytest.mark.parametrize("kind", FACES)
def test_faces_survive_the_disk_and_say_their_kind(kind: str, faces: dict[str, Face], tmp_path: Path) -> None:
    face = faces[kind]
    back = load_face(face.save(tmp_path / "face.npz"))
    assert type(back) is type(face) and back.names == face.names and back.unit == face.unit
    x = movement(face)
    assert np.array_equal(back.points(x), face.points(x)) and list(back.gauges) == list(face.gauges)
    for name, gauge in face.gauges.items():
        assert np.array_equal(back.gauges[name](x), gauge(x))
    assert isinstance(face, Textured) == (kind == "aam")


@pytest.mark.parametrize("kind", FACES)
def test_codes_are_the_same_each_time_and_survive_the_disk(kind: str, faces: dict[str, Face], tmp_path: Path) -> None:
    about, clip = face_kind(kind), CASES[kind].clips(1)[0]
    encoded, again = about.encode(faces[kind], clip), about.encode(faces[kind], clip)
    assert encoded.code.parameters.dtype == np.float32
    assert np.array_equal(encoded.code.parameters, again.code.parameters) and encoded.code.valid.all()
    back = about.load_code(encoded.code.save(tmp_path / "code.npz", **encoded.notes))
    assert np.array_equal(back.parameters, encoded.code.parameters) and np.array_equal(back.valid, encoded.code.valid)
    still = about.stabilise(faces[kind], clip.landmarks()[0], back)
    assert np.abs(still - faces[kind].points(back.parameters)).sum() < 0.1 * max(still.size, 1)  # pixels, of modes


@pytest.mark.parametrize("kind", FACES)
def test_a_corpus_is_encoded_once(kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clips_module, "video_frames", np.load if face_kind(kind).pictures else None)
    toy = CASES[kind].corpus(tmp_path / "toy")
    splits = {"train": list(toy.utterances)[:4], "test": list(toy.utterances)[4:]}
    encoded = encode_corpus(toy, splits, TOYS[kind], tmp_path / "face", progress=False)
    assert encoded.kind == encoded.report["face"] == encoded.face.kind == kind and not encoded.dropped
    monkeypatch.setattr(encoding_module, "corpus_clips", None)
    opened = encode_corpus(toy, splits, TOYS[kind], tmp_path / "face", progress=False)
    assert opened == encoded and len(opened.clip("toy5").valid) == 20


def test_a_face_of_a_long_corpus_is_fitted_to_every_so_many_th_clip(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    toy, settings = CASES["points"].corpus(tmp_path / "toy"), TOYS["points"]
    train = list(toy.utterances)[:5]
    assert sum(toy.utterances[i].frames for i in train) == 100
    monkeypatch.setattr(encoding_module, "ENOUGH", 60)
    long = encode_corpus(toy, {"train": train}, settings, tmp_path / "long", progress=False)
    monkeypatch.setattr(encoding_module, "ENOUGH", 100)
    whole = encode_corpus(toy, {"train": train}, settings, tmp_path / "whole", progress=False)
    every_second = encode_corpus(toy, {"train": train[::2]}, settings, tmp_path / "second", progress=False)
    means = [encoded.face.points(np.zeros(len(encoded.face.names))) for encoded in (long, whole, every_second)]
    assert (means[0] == means[2]).all() and (means[0] != means[1]).any()
    assert all(long.clip(i).valid.any() for i in train)


@pytest.mark.parametrize("kind", FACES)
def test_settings_are_read_from_plain_containers(kind: str) -> None:
    about = face_kind(kind)
    assert read_face_settings(kind, about.plain(TOYS[kind])) == TOYS[kind]
    with pytest.raises(DnnvssError, match="mode"):
        read_face_settings(kind, {"mode": 3})


def test_no_file_outside_the_aam_and_its_drawing_names_its_arrays() -> None:
    texts = {p.relative_to(ROOT).as_posix(): p.read_text("utf-8")
             for folder in ("dnnvss", "data_prep") for p in (ROOT / folder).rglob("*.py")}
    for words, rooms, drawing in ((AAM_WORDS, "dnnvss/face/aam/", DRAWS_AAM),
                                  (LAYOUT, "dnnvss/face/", DRAWS_AAM | KNOW_LAYOUTS)):
        found = [name for name, text in texts.items()
                 if re.search(words, text) and not name.startswith(rooms) and name not in drawing]
        assert found == []
