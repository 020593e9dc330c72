"""The painter and the renderer on a toy talker whose pictures are known."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from face.aam_cases import CONFIG, GROUPS, SIZE, clip_arrays, clips, corpus, face, picture
from face.face_cases import rig

from dnnvss.errors import DnnvssError
from dnnvss.face import clips as clips_module
from dnnvss.face.aam import ActiveAppearanceModel, encode_clip, fit_aam, triangulate
from dnnvss.face.aam.mesh import signed_area
from dnnvss.face.aam.painter import Painter
from dnnvss.face.encoding import encode_corpus
from dnnvss.render import Neutral, Renderer, choose_neutral, plots, revoicer
from dnnvss.render import neutral as neutral_module
from dnnvss.render.patch import Patch
from dnnvss.render.pictures import open_pictures, still


@pytest.fixture(scope="module")
def model() -> ActiveAppearanceModel:
    return fit_aam(clips(), GROUPS, CONFIG, progress=False)


@pytest.fixture(scope="module")
def shown(model: ActiveAppearanceModel) -> tuple[Neutral, np.ndarray, np.ndarray]:
    """A neutral frame, the pictures and the parameters of its clip."""
    images, points, valid = clip_arrays(50)
    code = encode_clip(model, images, points, valid, 25.0)
    frame = int(np.abs(code.parameters / model.deviations).sum(axis=1).argmin())
    neutral = Neutral(images[frame], points[frame, model.layout.rows], code.pose[frame], code.shape_offset,
                      code.texture_offset, f"toy50:{frame}")
    return neutral, images, code.parameters


SQUARE = np.array([[2.0, 2.0], [22.0, 2.0], [22.0, 18.0], [2.0, 18.0], [12.0, 10.0]])
EMPTY = np.array([], dtype=int)


def test_painting_at_the_source_returns_the_source() -> None:
    image = np.random.default_rng(1).integers(0, 256, (20, 24, 3), dtype=np.uint8)
    painter = Painter(triangulate(SQUARE), SQUARE, EMPTY, (20, 24), np.eye(2, 3))
    assert (painter.paint(image, SQUARE) == image).all()


def test_maps_are_the_affine_map_inside_and_the_background_outside() -> None:
    matrix, move = np.array([[0.8, 0.1], [-0.05, 0.9]]), np.array([3.0, 1.0])
    target = SQUARE @ matrix.T + move
    painter = Painter(triangulate(SQUARE), SQUARE, EMPTY, (30, 30), np.array([[1.0, 0, 5], [0, 1, 7]]))
    x, y = painter.maps(target)
    back = (np.array([12.5, 10.5]) - move) @ np.linalg.inv(matrix).T
    assert (x[10, 12] + 0.5, y[10, 12] + 0.5) == pytest.approx(tuple(back), abs=1e-4)
    assert (x[28, 1] + 0.5, y[28, 1] + 0.5) == pytest.approx((6.5, 35.5))


def test_a_mesh_of_many_triangles_is_drawn_as_one_of_few_is() -> None:
    """Above 255 triangles the owners no longer fit a byte."""
    image = np.random.default_rng(1).integers(0, 256, (40, 40, 3), dtype=np.uint8)
    grid = np.stack(np.meshgrid(np.linspace(2, 38, 15), np.linspace(2, 38, 15)), axis=-1).reshape(-1, 2)
    corners = np.array([[2.0, 2], [38, 2], [38, 38], [2, 38]])
    turn = np.array([[0.9, 0.1], [-0.1, 0.9]])
    many, few = (Painter(triangulate(p), p, EMPTY, (40, 40), np.eye(2, 3)) for p in (grid, corners))
    assert len(many.triangles) > 255 > len(few.triangles)
    drawn = many.paint(image, grid @ turn).astype(int) - few.paint(image, corners @ turn)
    assert np.abs(drawn[8:30, 10:30]).max() <= 1


def test_a_pixel_on_an_edge_is_read_by_the_first_of_two_triangles() -> None:
    """What is thin in the result and wide in the source reads far beyond its corners half a pixel from its edge."""
    own, after = [[0.0, 0], [10, 0], [14, 20], [0, 20]], [[30.0, 0], [34, 20]]
    triangles = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 2], [4, 5, 2]])
    painter = Painter(triangles, np.array(own + after), EMPTY, (20, 24), np.eye(2, 3))
    x, _ = painter.maps(np.array([*own, [11.0, 0], [15, 20]]))
    row, column = np.mgrid[1:19, 1:18]
    inside = column + 0.5 < 10 + 4 * (row + 0.5) / 20
    assert x[1:19, 1:18][inside] == pytest.approx(column[inside])


def test_what_is_squeezed_in_the_result_never_owns_a_pixel_that_another_reaches() -> None:
    """The corner of lips that shut, first in order: half a pixel beside it would be read ten pixels away."""
    source = np.array([[0.0, 0], [8, 0], [16, 0], [24, 0], [0, 20], [8, 20], [16, 20], [24, 20]])
    thin = [[1, 2, 5], [2, 6, 5]]
    triangles = np.array([*thin, [0, 1, 4], [1, 5, 4], [2, 3, 6], [3, 7, 6]])
    target = source + np.where(np.arange(8)[:, None] % 4 > 1, [-7.7, 0], [0, 0])  # the middle is .3 pixels wide
    painter = Painter(triangles, source, EMPTY, (20, 16), np.eye(2, 3))
    x, _ = painter.maps(target)
    column = np.arange(16)
    assert np.minimum(np.abs(x - column), np.abs(x - column - 7.7)).max() < 1e-4


def test_round_the_texture_lies_the_skin_below_a_closed_mouth(model: ActiveAppearanceModel) -> None:
    """The texture's mouth is open: its chin lies below a ring round a picture whose mouth is shut."""
    patch = Patch(model)
    shut = model.mean_shape.mean(axis=0) + (model.mean_shape - model.mean_shape.mean(axis=0)) * (1, 0.5)
    points = shut - shut.min(axis=0) + 60
    image = np.full((160, 160, 3), 200, np.uint8)
    image[:30] = 0  # where pixels that no triangle owns would be read
    canvas = patch.canvas(image, points, patch.around(points))
    mesh = np.zeros(patch.size, np.uint8)
    cv2.fillConvexPoly(mesh, cv2.convexHull(patch.place.round().astype(np.int32)), 1)
    assert (canvas[cv2.dilate(mesh, np.ones((5, 5), np.uint8)) > 0] > 150).all()


def test_a_chin_that_moves_much_stays_within_the_ring(model: ActiveAppearanceModel) -> None:
    lively = replace(model, deviations=3 * model.deviations)
    patch, shape = Patch(lively), lively.mean_shape
    chin = int(patch.width.argmax())
    assert patch.width[chin] > patch.ring == Patch(replace(model, deviations=0 * model.deviations)).width.max()
    way = shape[patch.edge[chin]] - shape[patch.edge].mean(axis=0)
    outwards = lively.shape_modes[:, patch.edge[chin]] @ way / np.linalg.norm(way)
    carried = lively.deviations**2 * outwards
    moved = lively.points(5.5 * carried / np.sqrt(carried @ outwards))
    at = patch.edge[chin]
    touching = patch.triangles[patch.own :][(patch.triangles[patch.own :] == at).any(axis=1)]
    reached = np.array(shape)
    reached[at] = moved[at]
    assert (signed_area(np.vstack([reached, patch.around(shape)]), touching) > 0).all()


def test_pictures_drawn_together_are_those_drawn_alone() -> None:
    image = np.random.default_rng(2).integers(0, 256, (20, 24, 3), dtype=np.uint8)
    painter = Painter(triangulate(SQUARE), SQUARE, np.array([0]), (20, 24), np.eye(2, 3))
    several = np.stack([SQUARE, SQUARE * 0.8 + 1, SQUARE[::-1]])
    plan = painter.plan(several)
    for index, points in enumerate(several):
        assert (painter.paint_planned(image, plan, index) == painter.paint(image, points)).all()


def test_fine_triangles_own_exactly_the_pixels_whose_centres_they_hold() -> None:
    points = np.array([[1.0, 4.0], [19.0, 4.2], [10.0, 5.1], [10.0, 1.0]])
    triangles = np.array([[0, 1, 2], [0, 3, 1]])
    painter = Painter(triangles, points, np.array([0]), (8, 20), np.eye(2, 3))
    owner = painter._owners(painter.plan(points[None]), 0)
    y, x = np.mgrid[:8, :20] + 0.5
    below = (y >= 4 + 0.2 * (x - 1) / 18) & (y <= 4 + 1.1 * (x - 1) / 9) & (y <= 4.2 + 0.9 * (19 - x) / 9)
    assert ((owner == 0) == below).all()


def test_turned_over_and_flat_triangles_are_not_drawn() -> None:
    triangles = triangulate(SQUARE[:4])
    painter = Painter(triangles, SQUARE[:4], np.arange(2), (20, 24), np.array([[1.0, 0, 100], [0, 1, 0]]))
    x, _ = painter.maps(SQUARE[[1, 0, 3, 2]])
    assert (x >= 100).all()
    x, _ = painter.maps(SQUARE[:4] * [1, 0] + [0, 5])
    assert (x >= 100).all() and np.isfinite(x).all()


def test_neutral_parameters_draw_the_neutral_frame(
    model: ActiveAppearanceModel, shown: tuple[Neutral, np.ndarray, np.ndarray]
) -> None:
    neutral, images, parameters = shown
    frame = int(neutral.source.split(":")[1])
    drawn = next(Renderer(model, neutral).frames(parameters[frame:frame + 1]))
    assert drawn.shape == (*SIZE, 3) and drawn.dtype == np.uint8
    assert np.abs(drawn.astype(int) - images[frame]).max() <= 6


def test_other_frames_of_the_clip_are_drawn_as_they_were(
    model: ActiveAppearanceModel, shown: tuple[Neutral, np.ndarray, np.ndarray]
) -> None:
    neutral, images, parameters = shown
    mouth = np.s_[44:60, 36:60]
    for drawn, image in zip(Renderer(model, neutral).frames(parameters), images, strict=True):
        assert np.sqrt(((drawn[mouth].astype(float) - image[mouth]) ** 2).mean()) < 4
    still = np.sqrt(((images[:, 44:60, 36:60].astype(float) - neutral.image[mouth]) ** 2).mean())
    assert still > 7  # the clip does move


def test_what_lies_outside_the_ring_never_changes(
    model: ActiveAppearanceModel, shown: tuple[Neutral, np.ndarray, np.ndarray]
) -> None:
    neutral, _, parameters = shown
    for drawn in Renderer(model, neutral).frames(parameters[:5]):
        assert (drawn[:30] == neutral.image[:30]).all() and (drawn[:, :10] == neutral.image[:, :10]).all()


@pytest.mark.parametrize("scale", [1.0, 2.0, 1.5])
def test_points_lie_where_the_picture_has_them(
    model: ActiveAppearanceModel, shown: tuple[Neutral, np.ndarray, np.ndarray], scale: float
) -> None:
    neutral, _, parameters = shown
    renderer = Renderer(model, neutral, scale)
    assert renderer.size == (round(SIZE[1] * scale), round(SIZE[0] * scale))
    points = renderer.points_in_image(parameters)
    truth = clip_arrays(50)[1][:, model.layout.rows] * scale
    assert np.sqrt(((points - truth) ** 2).sum(axis=-1).mean()) < 0.1 * scale
    assert next(renderer.frames(parameters[:1])).shape == (*renderer.size[::-1], 3)


def test_lips_never_pass_through_each_other(
    model: ActiveAppearanceModel, shown: tuple[Neutral, np.ndarray, np.ndarray]
) -> None:
    neutral, _, _ = shown
    shut = model.gauges["aperture"].vector / np.square(model.gauges["aperture"].vector).sum()
    parameters = np.outer([0.0, -30.0], shut)
    points = model.drawn(parameters, neutral.shape_offset)
    gap = points[:, 9, 1] - points[:, 7, 1]
    assert gap[0] > 1 and gap[1] == pytest.approx(0, abs=1e-6)
    assert Renderer(model, neutral).points_in_image(parameters) == pytest.approx(model.place(points, neutral.pose))
    assert list(Renderer(model, neutral).frames(parameters))[1].shape == (*SIZE, 3)


def test_frames_of_a_tall_jaw_have_no_tear(
    model: ActiveAppearanceModel, shown: tuple[Neutral, np.ndarray, np.ndarray]
) -> None:
    """The toy's skin is smooth, so a tear would be the steepest step in the picture."""
    neutral, _, parameters = shown
    widest = parameters[model.gauges["aperture"](parameters).argmax()] * 1.3
    drawn = next(Renderer(model, neutral).frames(widest[None])).astype(int)
    assert np.abs(np.diff(drawn[56:], axis=0)).max() <= 12 and np.abs(np.diff(drawn[56:], axis=1)).max() <= 14


def test_a_neutral_frame_of_another_model_is_refused(
    model: ActiveAppearanceModel, shown: tuple[Neutral, np.ndarray, np.ndarray]
) -> None:
    neutral, _, _ = shown
    other = Neutral(neutral.image, neutral.points[:5], neutral.pose, neutral.shape_offset[:5], neutral.texture_offset)
    with pytest.raises(DnnvssError, match="belongs to another model"):
        Renderer(model, other)
    with pytest.raises(DnnvssError, match="render scale is 0"):
        Renderer(model, neutral, scale=0)


def test_neutral_survives_the_disk(shown: tuple[Neutral, np.ndarray, np.ndarray], tmp_path: Path) -> None:
    neutral = shown[0]
    back = Neutral.load(neutral.save(tmp_path / "neutral.npz"))
    assert back.source == neutral.source
    for name in ("image", "points", "pose", "shape_offset", "texture_offset"):
        assert (getattr(back, name) == getattr(neutral, name)).all()
    (tmp_path / "neutral.npz").write_bytes(b"PK")
    with pytest.raises(DnnvssError, match=r"neutral\.npz: cannot be read"):
        Neutral.load(tmp_path / "neutral.npz")


def test_the_neutral_frame_is_silent_valid_and_sharp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clips_module, "video_frames", np.load)
    toy = corpus(tmp_path / "toy")
    splits = {"train": [f"toy{i}" for i in range(5)], "test": ["toy5"]}
    encoded = encode_corpus(toy, splits, CONFIG, tmp_path / "aam", progress=False)
    sharp = np.random.default_rng(1).integers(-9, 10, (*SIZE, 1))
    monkeypatch.setattr(neutral_module, "read_video", lambda path: np.clip(
        np.load(path) + (sharp if "toy3" in str(path) else 0), 0, 255).astype(np.uint8))
    neutral = choose_neutral(toy, encoded)
    name, frame = neutral.source.split(":")
    assert name == "toy3" and not 5 <= int(frame) < 15  # speech runs from 0.2 to 0.6 s
    points, _ = toy.landmarks(toy.utterances[name])
    assert neutral.points == pytest.approx(points[int(frame), encoded.face.layout.rows])


def test_modes_and_the_models_own_picture(model: ActiveAppearanceModel, tmp_path: Path) -> None:
    own = still(model, np.zeros(model.size))
    at = np.rint(model.mean_shape[model.layout.groups["jaw"][2]] - model.warp.origin + 6).astype(int)
    truth = picture(3.0)[tuple(np.rint(face(3.0)[12] - [0, 3]).astype(int)[::-1])]
    assert np.abs(own[at[1] - 3, at[0]].astype(int) - truth).max() < 10 and (own[0, 0] == 255).all()
    assert plots.plot_modes(tmp_path / "modes.png", model, count=3).stat().st_size > 5000


def test_one_door_opens_pictures_of_every_kind_that_can_be_drawn(
    model: ActiveAppearanceModel, shown: tuple[Neutral, np.ndarray, np.ndarray], tmp_path: Path
) -> None:
    neutral, parameters = shown[0], np.zeros((2, model.size))
    pictures = open_pictures(model, neutral.save(tmp_path / "neutral.npz"), scale=0.5)
    assert pictures.size == (48, 40) and pictures.views[0] == "face"
    for view in pictures.views:
        drawn = list(pictures.view(view, parameters))
        assert [p.shape for p in drawn] == [(40, 48, 3)] * 2
    assert np.array_equal(next(pictures.view("face", parameters)), next(pictures.frames(parameters)))
    for draw in (lambda: open_pictures(rig(3), tmp_path), lambda: still(rig(3), np.zeros(3)),
                 lambda: revoicer(rig(3), None, np.arange(2))):
        with pytest.raises(DnnvssError, match="kind linear"):
            draw()
