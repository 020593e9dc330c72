"""Points on faces without labels: regions, tracks, the choice of the talker, and the nets where they are installed."""

from pathlib import Path

import numpy as np
import pytest

from dnnvss.corpus.talker.portrait import portrait
from dnnvss.errors import DnnvssError
from dnnvss.face.landmarker import (
    ROWS,
    Landmarker,
    Region,
    Track,
    as_arrays,
    engine,
    engines,
    find_task,
    follow,
    mesh_groups,
    talker,
)
from dnnvss.face.landmarker import task as tasks
from dnnvss.face.landmarker.layout import LEFT_CORNER, LOWER_LIP, RIGHT_CORNER, UPPER_LIP
from dnnvss.face.landmarker.nets import _ANCHORS
from dnnvss.face.point_set import AUTO, KNOWN, PointSet
from dnnvss.formats import LAYOUT_68


def test_a_region_that_is_not_turned_maps_its_corners_to_those_of_the_picture():
    at = Region((50.0, 40.0), 20.0, 0.0).matrix(10)
    assert at @ [4.5, 4.5, 1] == pytest.approx([50, 40])
    assert at @ [0, 0, 1] == pytest.approx([41, 31])  # the middle of the first of ten pixels of two each


def test_a_region_turns_with_the_eyes():
    eyes = np.array([[0.0, 0.0], [1.0, 1.0]])
    region = Region.around(np.array([[0.0, 0], [4, 2]]), eyes, 1.5)
    assert region == Region((2.0, 1.0), 6.0, pytest.approx(np.pi / 4))
    step = region.matrix(6)[:, 0]
    assert step == pytest.approx([np.sqrt(0.5), np.sqrt(0.5)])


def test_the_detector_looks_from_896_centres():
    assert _ANCHORS.shape == (896, 2)
    assert _ANCHORS[0].tolist() == [4, 4] and _ANCHORS[2].tolist() == [12, 4]
    assert _ANCHORS[512].tolist() == [8, 8] and _ANCHORS[-1].tolist() == [120, 120]


def test_the_kept_points_are_named_once_each():
    groups = mesh_groups()
    assert len(set(ROWS.tolist())) == len(ROWS) == 146 == max(end for _, end in groups.values())
    assert ROWS[groups["lips_inner"][0] + 5] == UPPER_LIP and ROWS[groups["lips_inner"][0] + 15] == LOWER_LIP


def mesh_at(x: float, opening: float = 1.0) -> np.ndarray:
    mesh = np.full((478, 2), [x, 50.0], np.float32)
    mesh[RIGHT_CORNER], mesh[LEFT_CORNER] = (x - 10, 40), (x + 10, 40)
    mesh[LOWER_LIP] = (x, 50 + opening)
    mesh[0] = (x, 70)
    return mesh


class Seen:
    """Faces at given places: ``faces[frame]`` is a mapping of x to the opening of the mouth."""

    def __init__(self, faces):
        self.faces = faces
        self.asked = 0

    def detect(self, picture, least=0.5):
        self.asked += 1
        return [Region((x, 55.0), 45.0, 0.0) for x in self.faces[int(picture)]]

    def mesh(self, picture, region):
        faces = self.faces[int(picture)]
        near = [x for x in faces if abs(x - region.centre[0]) < 10]
        return (mesh_at(near[0], faces[near[0]]), 0.9) if near else (mesh_at(0), 0.1)


def test_a_face_is_followed_and_found_again_after_it_was_lost():
    seen = Seen([{100 + k: 1.0} if not 4 <= k < 6 else {} for k in range(12)])
    tracks, frames = follow(seen, np.arange(12))
    assert frames == 12 and len(tracks) == 1 and seen.asked == 1 + 3  # at first, while it is lost, and when it is back
    points, valid = as_arrays(tracks[0], frames)
    assert valid.tolist() == [True] * 4 + [False] * 2 + [True] * 6
    assert points[7, 0].tolist() == [107.0, 50.0] and np.isnan(points[4]).all()


def test_of_two_faces_the_one_talks_whose_lips_move_with_the_sound():
    talks = np.repeat([0.0, 1.0, 0.0, 1.0, 0.0], 20)
    loud, chews = talks * (1 + np.sin(np.arange(100) / 1.1)), talks * (1 + np.sin(np.arange(100) / 1.6))
    faces = [{60: 1.0 + 6 * chews[k], 200: 1.0 + 4 * loud[max(k - 1, 0)] ** 2} for k in range(100)]
    tracks, frames = follow(Seen(faces), np.arange(100))
    chosen, note = talker(tracks, frames, loud)
    assert tracks[chosen].points[0][0][0] == 200 and "2 faces are seen" in note
    assert talker(tracks, frames, None)[0] == 0
    assert talker(tracks[:1], frames, loud) == (0, "")


def test_a_face_that_passes_by_does_not_talk():
    tracks = [Track(Region((0.0, 0.0), 1.0, 0.0)), Track(Region((0.0, 0.0), 1.0, 0.0))]
    tracks[0].points.update(dict.fromkeys(range(90), np.zeros((146, 2))))
    tracks[1].points.update(dict.fromkeys(range(10), np.zeros((146, 2))))
    assert talker(tracks, 100, np.ones(100)) == (0, "2 faces are seen: the one that is there longest is taken")


def test_another_file_is_not_taken_for_the_nets(tmp_path, monkeypatch):
    path = tmp_path / "face_landmarker.task"
    path.write_bytes(b"PK")
    with pytest.raises(DnnvssError, match="is not the face_landmarker"):
        tasks.read_task(find_task(path))
    with pytest.raises(DnnvssError, match="no such file"):
        find_task(tmp_path / "other.task")
    monkeypatch.setattr(tasks, "CARRIERS", {"no_such_package": "x"})
    with pytest.raises(DnnvssError, match="make extras"):
        find_task()


def installed() -> Landmarker:
    try:
        return Landmarker(find_task())
    except DnnvssError:
        pytest.skip("face_landmarker.task is not installed: make extras")


def test_the_nets_find_the_portrait_of_the_built_in_talker():
    landmarker, picture = installed(), portrait(320)
    (region,) = landmarker.detect(picture)
    size = len(picture)
    mesh, certainty = landmarker.mesh(picture, region)
    assert certainty > 0.9
    eyes, lips = mesh[[RIGHT_CORNER, LEFT_CORNER]], mesh[[UPPER_LIP, LOWER_LIP]]
    assert eyes[0, 0] < size / 2 < eyes[1, 0] and abs(lips[:, 0] / size - 0.5).max() < 0.03
    assert eyes[:, 1].max() < lips[:, 1].min()
    turned, _ = landmarker.mesh(np.ascontiguousarray(np.rot90(picture, 2)),
                                Region((size - 1 - region.centre[0], size - 1 - region.centre[1]), region.side, np.pi))
    assert np.abs(size - turned[ROWS] - mesh[ROWS]).max() < 1.0  # the same face upside down


def test_weights_lie_where_they_are_swept_after_a_kill(monkeypatch):
    seen = []
    monkeypatch.setattr(engines, "litert", lambda: None)
    monkeypatch.setattr(engines.cv2.dnn, "readNetFromTFLite",
                        lambda path, *_: seen.append((path, Path(path).read_bytes())))
    engines.load(b"weights", ["out"])
    (path, held), = seen
    assert held == b"weights" and Path(path).parent.name.startswith("dnnvss.scratch-") and not Path(path).exists()


def test_both_engines_find_the_same_points(monkeypatch, capfd):
    if engine() == "opencv":
        pytest.skip("LiteRT is not installed: make extras")
    picture = portrait(320)
    (region,) = installed().detect(picture)
    fast, sure = installed().mesh(picture, region)
    monkeypatch.setattr(engines, "litert", lambda: None)
    assert engine() == "opencv"
    slow, certain = installed().mesh(picture, region)
    assert np.abs(fast - slow).max() < 0.1 and sure == pytest.approx(certain, abs=1e-3)
    assert capfd.readouterr().err == ""


def test_a_corpus_chooses_its_point_set():
    auto = PointSet.from_setting(AUTO, "aam.points")
    assert auto.fitted(mesh_groups()) == PointSet() == KNOWN[0]
    assert auto.fitted(LAYOUT_68).name == "lips_jaw_nostrils_68"
    assert KNOWN[1].layout(LAYOUT_68).needed == 68
    assert KNOWN[1].fitted(mesh_groups()) is KNOWN[1]
    with pytest.raises(DnnvssError, match="none of the known point sets"):
        auto.fitted({"lips_outer": (0, 3)})
