"""The built-in talker's pictures: what is drawn lies where the landmarks say."""

import numpy as np
import pytest

from dnnvss.corpus.talker import LANDMARK_GROUPS, SHEET, TARGETS, Articulators, film, landmark_track, landmarks
from dnnvss.corpus.talker import render_frame as draw
from dnnvss.corpus.talker.geometry import carried, mouth_outlines, moved
from dnnvss.corpus.talker.targets import SHAPES, shape_centre

MOVED = {"sway_x": 9.0, "sway_y": -6.0, "roll": 2.0}


def face(phone: str, **changes: float) -> Articulators:
    return Articulators(*TARGETS[phone].lips, *TARGETS[phone].tongue)._replace(**changes)


def group(points: np.ndarray, name: str) -> np.ndarray:
    return points[slice(*LANDMARK_GROUPS[name])]


def redness(picture: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return red over green at points, averaged over the four pixels about each."""
    column, row = (points.T - 0.5).round().astype(int)
    patch = picture.astype(float)
    return patch[row, column, 0] / patch[row, column, 1]


@pytest.mark.parametrize("phone", ["sil", "AA", "IY", "UW", "SH", "F", "P"])
@pytest.mark.parametrize("head", [{}, MOVED])
def test_lips_are_drawn_inside_their_outer_landmarks(phone: str, head: dict[str, float]):
    state = face(phone, **head)
    picture, outer = draw(state), group(landmarks(state), "lips_outer")
    middle = outer.mean(axis=0)
    across = outer[[2, 3, 4, 5, 6, 7, 8, 12, 13, 14, 15, 16, 17, 18]]  # off the corners, where the lips are thin
    inward = (middle - across) / np.linalg.norm(middle - across, axis=1, keepdims=True)
    inside, outside = across + 1.6 * inward, across - 2.5 * inward
    assert (redness(picture, inside) > redness(picture, outside) + 0.15).mean() > 0.9


@pytest.mark.parametrize("phone", ["AA", "AE", "AO"])
def test_an_open_mouth_is_dark_between_its_inner_landmarks(phone: str):
    state = face(phone, **MOVED)
    inner = group(landmarks(state), "lips_inner")
    column, row = (inner.mean(axis=0) - 0.5).round().astype(int)
    assert draw(state)[row + 1, column].mean() < 80
    assert draw(face("sil"))[row + 1, column].mean() > 80


def test_chin_is_drawn_at_its_landmark():
    for state in (face("sil"), face("AA"), face("AA", **MOVED)):
        chin = group(landmarks(state), "jaw")[7]
        column, row = (chin - 0.5).round().astype(int)
        light = draw(state)[row - 9 : row + 10, column].astype(float).mean(axis=1)
        edge = np.argmin(np.diff(light)) + 0.5 - 9  # skin to the shadow on the neck
        assert abs(edge) <= 2.5


def test_eyes_and_nose_do_not_move_with_speech():
    rest, wide = landmarks(face("sil")), landmarks(face("AA"))
    for name in ("right_eye", "left_eye", "nose_bridge", "right_brow", "left_brow"):
        assert np.abs(group(rest, name) - group(wide, name)).max() < 0.05
    assert group(wide, "jaw")[7, 1] - group(rest, "jaw")[7, 1] > 14


def test_landmarks_have_two_like_halves():
    points = landmarks(face("AA"))
    for name in ("lips_outer", "jaw", "nose_base"):
        xs = np.sort(group(points, name)[:, 0])
        np.testing.assert_allclose(xs + xs[::-1], SHEET, atol=1e-9)
    mirrored = group(points, "left_eye") * (-1, 1) + (SHEET, 0)
    np.testing.assert_allclose(mirrored, group(points, "right_eye"), atol=1e-9)


def test_points_move_as_the_picture_does():
    """p + d(q) = q; and where only the head carries points, both ways to move them agree."""
    state = face("sil", **MOVED)
    mouth = mouth_outlines(face("sil"))["upper_outer"]
    np.testing.assert_allclose(moved(mouth, np.array([state]))[0], carried(mouth, state), atol=1e-6)


def test_landmarks_scale_with_the_picture():
    state = face("EY", **MOVED)
    np.testing.assert_allclose(landmarks(state, 160) * 2, landmarks(state, 320), atol=1e-9)


def test_a_closed_mouth_shows_no_gap_and_teeth_show_in_s():
    def whitest(phone: str) -> float:
        state = face(phone)
        inner = group(landmarks(state), "lips_inner")
        (left, top), (right, bottom) = inner.min(axis=0).astype(int), inner.max(axis=0).astype(int) + 1
        return draw(state)[top:bottom, left:right].min(axis=2).max()

    assert whitest("P") < 140 < 190 < whitest("S")


def test_pictures_follow_from_the_seed():
    rows = np.array([face("AA"), face("P")])
    films = [list(film(rows, 96, np.random.default_rng(seed))) for seed in (3, 3, 4)]
    assert films[0][1].tobytes() == films[1][1].tobytes() != films[2][1].tobytes()
    assert films[0][0].shape == (96, 96, 3)
    noise = films[0][0].astype(float) - draw(face("AA"), 96)
    assert 0.5 < noise.std() < 2.5


def test_motion_does_not_pop():
    """Steps of a hundredth of a movement change the picture by little anywhere, whatever appears or vanishes."""
    centres = {shape: shape_centre(shape) for shape in SHAPES}
    for one, two in (("closed", "open"), ("tucked", "round"), ("rest", "spread"), ("flared", "mid")):
        steps = [Articulators(*(centres[one] + s * (centres[two] - centres[one]))) for s in np.linspace(0, 1, 60)]
        pictures = np.stack([draw(state, 160) for state in steps]).astype(float)
        jumps = np.abs(np.diff(pictures, axis=0)).mean(axis=(1, 2, 3))
        assert jumps.max() < 4 * np.median(jumps) + 0.02


def test_a_blink_shuts_the_eye_and_leaves_its_landmarks():
    open_, shut = face("sil"), face("sil", blink=1.0)
    np.testing.assert_array_equal(landmarks(open_), landmarks(shut))
    column, row = group(landmarks(open_), "right_eye").mean(axis=0).round().astype(int)
    assert draw(open_)[row, column].mean() < 90 < draw(shut)[row, column].mean()


def test_track_is_the_landmarks_of_each_frame():
    rows = np.array([face("AA", **MOVED), face("UW"), face("M")])
    np.testing.assert_allclose(landmark_track(rows, 200), [landmarks(Articulators(*row), 200) for row in rows])
