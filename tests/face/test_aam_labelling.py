"""Labels by hand: schemes, guesses, the folder of labels, other tools' files, and what looks wrong."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from face.aam_cases import SIZE, face, picture

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.face.aam.labelling import export
from dnnvss.face.aam.labelling.doubts import doubts
from dnnvss.face.aam.labelling.guess import moving_mouth, place
from dnnvss.face.aam.labelling.imports import import_into
from dnnvss.face.aam.labelling.mesh import on_mesh
from dnnvss.face.aam.labelling.schemes import SCHEMES, Group, Scheme, find_scheme
from dnnvss.face.aam.labelling.sheet import Label, Sheet
from dnnvss.face.aam.labelling.suggest import FIRST, FROM, suggest
from dnnvss.face.landmarker import Region
from dnnvss.formats.landmarks import LAYOUT_68, read_pts, write_pts
from dnnvss.media.pictures import write_picture

GROUPS = {"lips": (0, 4), "jaw": (4, 6)}
POINTS = np.array([[30, 40], [40, 36], [50, 40], [40, 44], [28, 60], [52, 60]], dtype=float)


def sheet(folder: Path, count: int = 3, done: bool = False) -> Sheet:
    labels = []
    for i in range(count):
        labels.append(Label("a.mp4", i, f"a_{i}.png", f"a_{i}.pts"))
        write_picture(folder / f"a_{i}.png", picture(i))
        write_pts(folder / f"a_{i}.pts", POINTS + i)
    names = frozenset(each.image for each in labels) if done else frozenset()
    return Sheet(folder, GROUPS, tuple(labels), names, "own", "videos").save()


def test_schemes_have_the_points_that_papers_and_tools_count() -> None:
    assert SCHEMES["ibug68"].groups == LAYOUT_68 and len(SCHEMES["face100"]) == 100
    small = SCHEMES["lips_jaw_nostrils"].groups
    assert sum(small[g][1] - small[g][0] for g in ("lips_outer", "lips_inner", "jaw", "nose_base")) == 34
    for scheme in SCHEMES.values():
        layout = {g: scheme.layout[a:b] for g, (a, b) in scheme.groups.items()}
        assert layout["lips_outer"][0, 0] == layout["lips_outer"][:, 0].min()  # from the left corner
        assert layout["lips_outer"][2, 1] < layout["lips_outer"][0, 1]  # over the top
        assert np.sort(scheme.layout[:, 0]) == pytest.approx(np.sort(-scheme.layout[:, 0]))  # a mirror image
        assert layout["right_eye"][:, 0].max() < 0 < layout["left_eye"][:, 0].min()
    with pytest.raises(DnnvssError, match=r"no scheme of points 'x'.*ibug68"):
        find_scheme("x")


def test_a_guess_lies_on_the_mouth_that_moves_or_in_the_middle() -> None:
    scheme = SCHEMES["lips_jaw_nostrils"]
    frames = np.stack([picture(o) for o in 3 + 3 * np.sin(np.arange(12))])
    mouth = moving_mouth(frames.mean(axis=-1).astype(np.uint8))
    assert mouth == pytest.approx((48, 51), abs=4)
    guess = place(scheme, frames[0], mouth)
    lips = guess.points[slice(*scheme.groups["lips_outer"])]
    assert lips.mean(axis=0) == pytest.approx(mouth) and guess.how == "where the picture moves"
    assert moving_mouth(np.repeat(frames[:1, ..., 0], 5, axis=0)) is None
    still = place(scheme, frames[0], None)
    assert still.how == "middle of the picture" and still.points[:, 0].mean() == pytest.approx(SIZE[1] / 2, abs=1)


class Detector:
    """Two faces: a mesh whose points lie on a circle of the region's size, numbered round it."""

    def __init__(self, certainty: float = 0.9) -> None:
        self.certainty = certainty

    def detect(self, image: np.ndarray) -> list[Region]:
        assert image.shape == (*SIZE, 3)
        return [Region((5.0, 5.0), 10.0, 0.0), Region((45.0, 30.0), 40.0, 0.0)]

    def refined(self, image: np.ndarray, region: Region) -> tuple[np.ndarray, float]:
        angle = np.linspace(0, 2 * np.pi, 478)
        circle = np.column_stack([np.cos(angle), np.sin(angle)])
        return np.array(region.centre) + region.side / 2 * circle, self.certainty


def test_a_landmarker_places_the_points_on_the_largest_face() -> None:
    scheme = SCHEMES["ibug68"]
    guess = place(scheme, picture(0), None, Detector())
    mesh, _ = Detector().refined(picture(0), Region((45.0, 30.0), 40.0, 0.0))
    assert guess.points.shape == (68, 2) and guess.how == "face landmarks"
    lips, eye = (guess.points[slice(*scheme.groups[g])] for g in ("lips_outer", "right_eye"))
    assert lips[0] == pytest.approx(mesh[61]) and lips[6] == pytest.approx(mesh[291])  # its corners
    assert eye[0] == pytest.approx(mesh[33]) and eye[3] == pytest.approx(mesh[133])
    assert place(scheme, picture(0), None, Detector(0.2)).how == "middle of the picture"


def test_points_of_a_line_are_evenly_spaced_between_its_ends() -> None:
    scheme = Scheme("one", "", (Group("nose_base", np.zeros((7, 2))), Group("right_eye", np.zeros((2, 2)))))
    mesh = np.zeros((478, 2))
    mesh[[129, 98, 97, 2, 326, 327, 358]] = [[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [3, 2], [3, 3]]
    mesh[133] = [4, 4]
    assert on_mesh(scheme, mesh).tolist() == [[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [3, 2], [3, 3], [0, 0], [4, 4]]


def test_guesses_learn_from_the_finished_labels(tmp_path: Path) -> None:
    openings = [0, 1.5, 3, 4.5, 6, 2, 5, 3.5]
    labels = tuple(Label("a.mp4", i, f"a_{i}.png", f"a_{i}.pts") for i in range(len(openings)))
    truth = [face(o).astype(float) for o in openings]
    for label, opening, points in zip(labels, openings, truth, strict=True):
        write_picture(tmp_path / label.image, picture(opening))
        write_pts(tmp_path / label.points, points + np.array([2, -1]))  # the guess
    own = Sheet(tmp_path, {"face": (0, len(truth[0]))}, labels).save()
    for label, points in list(zip(labels, truth, strict=True))[:FROM]:
        assert suggest(own, labels[-1]).how == FIRST
        own = own.write(label.image, points, done=True)
    found = suggest(own, labels[-1])
    assert found.how == "6 finished labels"
    assert np.linalg.norm(found.points - truth[-1], axis=1).mean() < 0.5  # the first guess is 2.2 pixels away
    assert own.read(labels[-1]) == pytest.approx(truth[-1] + np.array([2, -1]), abs=1e-4)  # nothing is written
    moved = own.write(labels[-1].image, truth[-1] + 1, done=False)
    assert Sheet.open(tmp_path).moved == moved.moved == {label.image for label in (*labels[:FROM], labels[-1])}
    assert suggest(moved, labels[-1]).points == pytest.approx(truth[-1] + 1, abs=1e-4)


def test_points_written_are_read_back_and_finished_ones_are_known(tmp_path: Path) -> None:
    before = sheet(tmp_path)
    moved = POINTS + np.array([0.25, -1])
    after = before.write("a_1.png", moved, done=True)
    again = Sheet.open(tmp_path)
    assert again == after and again.done == {"a_1.png"}
    assert again.read(again.label("a_1.png")) == pytest.approx(moved)
    assert files.read_json(tmp_path / "labels.json")["groups"] == {"lips": [0, 4], "jaw": [4, 6]}
    with pytest.raises(DnnvssError, match=r"a_0\.pts: its points are still a guess"):
        again.finished()
    assert sheet(tmp_path, done=True).finished().shape == (3, 6, 2)


@pytest.mark.parametrize("points, message", [
    (POINTS[:5], r"a_0\.pts: holds 5 points, and the labels have 6"),
    (np.where(np.arange(6)[:, None] == 5, np.nan, POINTS), r"a_0\.pts: jaw 1 is \[nan, nan\]"), (None, "no such file")])
def test_labels_that_do_not_fit_are_refused_by_file(tmp_path: Path, points: np.ndarray | None, message: str) -> None:
    whole = sheet(tmp_path)
    if points is None:
        (tmp_path / "a_0.pts").unlink()
    else:
        write_pts(tmp_path / "a_0.pts", points)
    with pytest.raises(DnnvssError, match=message):
        whole.read(whole.labels[0])
    if points is not None:
        before = (tmp_path / "a_1.pts").read_bytes()
        with pytest.raises(DnnvssError, match=message.replace("a_0", "a_1")):
            whole.write("a_1.png", points, done=True)
        assert (tmp_path / "a_1.pts").read_bytes() == before


def test_a_folder_without_labels_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match=r"labels\.json: no such file.*label choose"):
        Sheet.open(tmp_path)
    sheet(tmp_path)
    value = files.read_json(tmp_path / "labels.json")
    files.write_json(tmp_path / "labels.json", {**value, "labels": value["labels"][:1] * 2})
    with pytest.raises(DnnvssError, match="1 different ones"):
        Sheet.open(tmp_path)


def labelme(named: list[tuple[str, list]]) -> dict:
    shapes = [{"label": n, "points": p, "shape_type": "point" if len(p) == 1 else "polygon"} for n, p in named]
    return {"version": "5.4.1", "shapes": shapes, "imagePath": "frames/a_1.png", "imageHeight": 80, "imageWidth": 96}


def coco(points: np.ndarray) -> dict:
    row = np.column_stack([points, np.full(6, 2)]).ravel().tolist()
    return {"images": [{"id": 7, "file_name": "a_1.png"}], "categories": [],
            "annotations": [{"id": 1, "image_id": 7, "keypoints": row}, {"id": 2, "image_id": 7}]}


def via(points: np.ndarray) -> dict:
    regions = [{"shape_attributes": {"name": "point", "cx": x, "cy": y}, "region_attributes": {}} for x, y in points]
    return {"_via_settings": {}, "_via_img_metadata": {"a_1.png123": {"filename": "a_1.png", "size": 123,
                                                                      "regions": regions}}}


MOVED = POINTS + np.array([0.5, 2])
SINGLE = [(f"lips {i}" if i < 4 else f"jaw_{i - 4}", [MOVED[i].tolist()]) for i in (5, 4, 3, 2, 1, 0)]


@pytest.mark.parametrize("value", [
    labelme(SINGLE), labelme([("lips", MOVED[:4].tolist()), ("4", [MOVED[4].tolist()]), ("5", [MOVED[5].tolist()])]),
    labelme([("jaw", [p.tolist()]) for p in MOVED[4:]] + [("lips", MOVED[:4].tolist())]), coco(MOVED), via(MOVED),
    via(MOVED)["_via_img_metadata"]])
def test_files_of_labelling_tools_are_read(tmp_path: Path, value: dict) -> None:
    sheet(tmp_path)
    (tmp_path / "tool.json").write_text(json.dumps(value))
    after, names = import_into(Sheet.open(tmp_path), tmp_path / "tool.json")
    assert names == ["a_1.png"] and after.done == {"a_1.png"}
    assert read_pts(tmp_path / "a_1.pts") == pytest.approx(MOVED)
    assert read_pts(tmp_path / "a_0.pts") == pytest.approx(POINTS)


def named_coco(points: np.ndarray, order: list[int], names: list[str], **image: int) -> dict:
    value = coco(points[order])
    value["categories"] = [{"id": 3, "name": "face", "keypoints": [names[i] for i in order]}]
    value["annotations"][0]["category_id"] = 3
    value["annotations"].append({"id": 9, "image_id": 7, "bbox": [1, 2, 3, 4], "keypoints": [0] * 18})
    value["images"][0] |= image
    return value


NAMES = ["lips 0", "lips_1", "lips 2", "lips 3", "jaw 0", "jaw-1"]
BOX = {"label": "face", "shape_type": "rectangle", "points": [[0, 0], [9, 9]]}
TWICE = [(name, (2 * np.array(points)).tolist()) for name, points in SINGLE]


@pytest.mark.parametrize("value", [
    named_coco(MOVED, [4, 5, 0, 2, 1, 3], NAMES), named_coco(MOVED, [0, 1, 2, 3, 4, 5], list("123456")),
    named_coco(MOVED, [4, 5, 0, 2, 1, 3], list("123456")), named_coco(MOVED, [1, 0, 5, 4, 3, 2], list("012345")),
    named_coco(MOVED, [1, 0, 5, 4, 3, 2], ["Lips 1", "LIPS_2", "lips 3", "lips 4", "Jaw 1", "jaw-2"]),
    labelme([(str(k + 1), [MOVED[k].tolist()]) for k in range(6)]),
    named_coco(2 * MOVED, [5, 0, 1, 2, 3, 4], NAMES, width=192, height=160),
    {**labelme(SINGLE), "shapes": [BOX, *labelme(SINGLE)["shapes"]]}, {**labelme(SINGLE), "imagePath": "a_1.jpg"},
    {**labelme(TWICE), "imageWidth": 192, "imageHeight": 160}])
def test_points_go_by_their_names_and_the_size_of_the_picture(tmp_path: Path, value: dict) -> None:
    sheet(tmp_path)
    (tmp_path / "tool.json").write_text(json.dumps(value))
    import_into(Sheet.open(tmp_path), tmp_path / "tool.json")
    assert read_pts(tmp_path / "a_1.pts") == pytest.approx(MOVED, abs=1e-4)


@pytest.mark.parametrize("value, message", [
    (named_coco(MOVED, [0, 1, 2, 3, 4, 5], ["chin", *NAMES[1:]]), "point 'chin' is unknown"),
    (coco(MOVED / 96), "its points lie within 2 pixels, as shares"),
    ({**labelme(SINGLE), "imageWidth": 100}, "labelled at 100 x 80 pixels, and has 96 x 80"),
    ({**coco(MOVED), "annotations": [{"id": 1, "image_id": 7, "keypoints": [1.0] * 17}]}, "17 numbers are not x, y")])
def test_points_without_a_place_are_refused(tmp_path: Path, value: dict, message: str) -> None:
    sheet(tmp_path)
    (tmp_path / "tool.json").write_text(json.dumps(value))
    with pytest.raises(DnnvssError, match=message):
        import_into(Sheet.open(tmp_path), tmp_path / "tool.json")


@pytest.mark.parametrize("value, message", [
    (labelme(SINGLE[1:]), r"tool\.json: picture a_1\.png: jaw 1 is missing"),
    (labelme([*SINGLE, SINGLE[0]]), r"point 'jaw_1' is one too many"),
    (labelme([("chin", [[1, 2]])]), "point 'chin' is unknown"),
    (labelme([("jaw", [[1, 2]] * 3)]), "point 'jaw' is one too many"),
    ({**labelme(SINGLE), "imagePath": "b.png"}, r"names the picture 'b\.png'"),
    (coco(POINTS[:5].repeat([1, 1, 1, 1, 2], axis=0) * np.nan), "lips 0 is"),
    ({**coco(POINTS), "images": []}, "belongs to no picture"), ({"a": 1}, "no JSON of a labelling tool"),
    ([1], "no JSON of a labelling tool"), ({**coco(POINTS), "annotations": []}, "holds no points")])
def test_files_that_do_not_fit_are_refused_and_nothing_is_written(tmp_path: Path, value: dict, message: str) -> None:
    sheet(tmp_path)
    (tmp_path / "tool.json").write_text(json.dumps(value))
    with pytest.raises(DnnvssError, match=message):
        import_into(Sheet.open(tmp_path), tmp_path / "tool.json")
    assert read_pts(tmp_path / "a_1.pts") == pytest.approx(POINTS + 1) and not Sheet.open(tmp_path).done


@pytest.mark.parametrize("value", [
    {"shapes": 3, "imagePath": "a_1.png"}, {"shapes": ["x"], "imagePath": "a_1.png"},
    labelme([("lips", [[1, 2, 3]] * 4)]), labelme([("lips", [["a", "b"]])]), labelme([("jaw_\u00b2", [[1, 2]])]),
    {"images": [{}], "annotations": []}, {"images": [], "annotations": 3},
    {"images": [{"id": 7, "file_name": "a_1.png"}], "annotations": [{"image_id": 7, "keypoints": [1, 2]}]},
    {"images": [{"id": 7, "file_name": "a_1.png"}], "annotations": [{"image_id": 7, "keypoints": "abc"}]},
    {"a": {"regions": [{}]}}, {"a": {"regions": [{"shape_attributes": {"name": "point"}}], "filename": "a_1.png"}},
    {"a": {"regions": [{"shape_attributes": {"name": "polygon", "all_points_x": [1], "all_points_y": [1, 2]}}],
           "filename": "a_1.png"}}])
def test_files_that_are_damaged_are_refused_in_one_line(tmp_path: Path, value: dict) -> None:
    sheet(tmp_path)
    (tmp_path / "tool.json").write_text(json.dumps(value))
    with pytest.raises(DnnvssError, match=r"tool\.json: .*\. (Export|Name points|Label every)"):
        import_into(Sheet.open(tmp_path), tmp_path / "tool.json")
    assert not Sheet.open(tmp_path).done


def test_a_picture_that_is_labelled_twice_is_refused(tmp_path: Path) -> None:
    sheet(tmp_path)
    for name in ("one.json", "two.json"):
        files.write_json(tmp_path / "tool" / name, labelme(SINGLE))
    with pytest.raises(DnnvssError, match=r"two\.json: picture a_1\.png is labelled twice"):
        import_into(Sheet.open(tmp_path), tmp_path / "tool")
    one = next(iter(via(MOVED)["_via_img_metadata"].values()))
    files.write_json(tmp_path / "via.json", {"a": one, "b": one})
    with pytest.raises(DnnvssError, match=r"via\.json: picture a_1\.png is labelled twice"):
        import_into(Sheet.open(tmp_path), tmp_path / "via.json")


@pytest.mark.parametrize("name", ["../a_0.png", "/etc/passwd", "deep/../../a.png", "..\\a.png", ""])
@pytest.mark.parametrize("field", ["image", "points"])
def test_labels_name_files_of_their_folder_alone(tmp_path: Path, name: str, field: str) -> None:
    sheet(tmp_path)
    value = files.read_json(tmp_path / "labels.json")
    value["labels"][0][field] = name
    files.write_json(tmp_path / "labels.json", value)
    with pytest.raises(DnnvssError, match=r"labels\.json: .* leads out of the folder"):
        Sheet.open(tmp_path)


def test_a_long_video_is_not_held_as_a_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []

    def frames(video: Path) -> Iterator[np.ndarray]:
        for number in range(100):
            read.append(number)
            yield np.full((4, 6, 3), number, np.uint8)

    looked: list[int] = []
    monkeypatch.setattr(export, "video_frames", frames)
    monkeypatch.setattr(export, "moving_mouth", lambda grey: looked.append(len(grey)) or (1.0, 2.0))
    monkeypatch.setattr(export, "_LOOKED_AT", 10 * 4 * 6 * 3)
    images, mouth = export._seen(tmp_path / "a.mp4", {3, 50})
    assert {n: int(image[0, 0, 0]) for n, image in images.items()} == {3: 3, 50: 50} and mouth == (1.0, 2.0)
    assert looked == [10] and max(read) < 52


def test_labels_that_look_wrong_are_found(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    whole = sheet(tmp_path, 8, done=True)
    for i, label in enumerate(whole.labels):
        whole = whole.write(label.image, POINTS + random.normal(0, 0.3, POINTS.shape) + (i, 0), done=i != 6)
    assert [(d.image, d.problem) for d in doubts(whole)] == [("a_6.png", "not finished")]
    swapped = POINTS[[2, 1, 0, 3, 4, 5]] + (3, 0)  # the corners of the mouth, each in the other's place
    whole = whole.write("a_3.png", swapped, True)
    whole = whole.write("a_4.png", POINTS + np.array([4, 60]), True).write("a_5.png", POINTS[[0, 0, 2, 3, 4, 5]], True)
    (tmp_path / "a_7.pts").unlink()
    said = {(d.image, d.problem) for d in doubts(whole)}
    assert ("a_4.png", "lips 0 lies outside the picture") in said
    assert ("a_5.png", "lips 0 and lips 1 are one point") in said
    assert any(image == "a_3.png" and "lips" in problem and "pixels from where" in problem for image, problem in said)
    assert any(image == "a_7.png" and "no such file" in problem for image, problem in said)
    assert not any(image in ("a_0.png", "a_1.png", "a_2.png") for image, _ in said)


def test_the_toy_face_is_no_stranger_to_itself(tmp_path: Path) -> None:
    """Open and closed mouths are all right."""
    groups = {"lips_outer": (0, 6), "lips_inner": (6, 10), "jaw": (10, 15), "eyes": (15, 19)}
    labels = tuple(Label("a.mp4", i, f"{i}.png", f"{i}.pts") for i in range(6))
    whole = Sheet(tmp_path, groups, labels, frozenset(each.image for each in labels))
    for i, label in enumerate(labels):
        write_picture(tmp_path / label.image, picture(i))
        whole.write(label.image, face(1.2 * i), True)
    assert doubts(whole) == []


def test_points_in_one_place_are_doubtful_and_spoil_no_other(tmp_path: Path) -> None:
    whole = sheet(tmp_path, 8, done=True)
    for i, label in enumerate(whole.labels):
        whole = whole.write(label.image, POINTS + i if i else np.full_like(POINTS, 9.0), done=True)
    assert [(d.image, d.problem) for d in doubts(whole)] == [("a_0.png", "lips 0 and lips 1 are one point")]


def test_points_that_a_file_cannot_hold_are_not_written(tmp_path: Path) -> None:
    whole = sheet(tmp_path)
    before = (tmp_path / "a_1.pts").read_bytes()
    with pytest.raises(DnnvssError, match=r"a_1\.pts: lips 0 is \[1e\+300, 40.0\]"):
        whole.write("a_1.png", np.where(POINTS[0, 0] == POINTS, 1e300, POINTS), done=True)
    assert (tmp_path / "a_1.pts").read_bytes() == before
