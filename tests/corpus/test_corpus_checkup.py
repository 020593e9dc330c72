"""Broken pictures, off-colour clips and ghosts are found in made-up clips where we know them, and nothing else is."""

import numpy as np
import pytest

from dnnvss.corpus import checkup

FRAMES, POINTS = 40, 12


def picture(rng: np.random.Generator, count: int = FRAMES, tint: tuple[float, ...] = (0, 0, 0)) -> np.ndarray:
    """A face on a background that sways a little: frames (F, 48, 64, 3)."""
    y, x = np.mgrid[0:48, 0:64]
    frames = []
    for t in range(count):
        centre = 32 + 1.5 * np.sin(t / 6)
        face = ((x - centre) / 12) ** 2 + ((y - 26) / 18) ** 2 < 1
        grey = np.where(face, 180.0, 60 + y)
        frames.append(grey[..., None] + np.array([10, 0, -10]) + np.array(tint) + rng.normal(0, 2, (48, 64, 3)))
    return np.clip(np.stack(frames), 0, 255).astype(np.uint8)


def face(rng: np.random.Generator, count: int = FRAMES) -> np.ndarray:
    """Points (F, P, 2) of a face that speaks, sways and jitters."""
    angle = 2 * np.pi * np.arange(POINTS) / POINTS
    shape = np.stack([100 + 40 * np.cos(angle), 120 + 60 * np.sin(angle)], axis=1)
    t = np.arange(count)[:, None, None]
    open_ = 3 * np.sin(t / 3) * (np.arange(POINTS) < 6)[None, :, None] * np.array([0, 1])
    return shape + open_ + 2 * np.sin(t / 15) + rng.normal(0, 0.2, (count, POINTS, 2))


@pytest.fixture
def rng():
    return np.random.default_rng(0)


def test_thumbnails_are_means_of_areas():
    frame = np.zeros((1, 48, 64, 3), np.uint8)
    frame[:, :24] = 200
    small = checkup.thumbnails(frame)
    assert small.shape == (1, 12, 16, 3)
    assert (small[0, :6] == 200).all()
    assert (small[0, 6:] == 0).all()


def test_a_broken_start_is_found_and_whole_clips_are_left_alone(rng):
    clips = {f"c{k}": checkup.thumbnails(picture(rng)) for k in range(8)}
    clips["c3"] = clips["c3"].copy()
    clips["c3"][:12] = rng.integers(0, 255, (1, 12, 16, 3))
    broken = checkup.broken_pictures(clips)
    assert np.flatnonzero(broken["c3"]).tolist() == list(range(12))
    assert not any(mask.any() for name, mask in broken.items() if name != "c3")


def test_at_an_editors_cut_both_sides_are_kept(rng):
    clips = {f"c{k}": checkup.thumbnails(picture(rng)) for k in range(8)}
    clips["c3"] = clips["c3"].copy()
    clips["c3"][18:] = np.roll(clips["c3"][18:], 1, axis=2)  # the head has moved between two takes
    broken = checkup.broken_pictures(clips)
    assert np.flatnonzero(broken["c3"]).tolist() == [16, 17, 18, 19]


def test_a_clip_that_is_broken_but_for_its_end_keeps_the_end(rng):
    clips = {f"c{k}": checkup.thumbnails(picture(rng)) for k in range(8)}
    clips["c0"] = clips["c0"].copy()
    clips["c0"][:20], clips["c0"][20:37] = 128, clips["c0"][20:37, ::-1]
    assert np.flatnonzero(~checkup.broken_pictures(clips)["c0"]).tolist() == [37, 38, 39]


def test_pictures_that_are_stored_twice_are_not_broken(rng):
    clips = {f"c{k}": checkup.thumbnails(picture(rng)) for k in range(8)}
    clips["c3"] = clips["c3"].copy()
    clips["c3"][:12] = rng.integers(0, 255, (1, 12, 16, 3))
    twice = {name: np.repeat(clip, 2, axis=0) for name, clip in clips.items()}
    for clip in twice.values():
        clip[1::2, 0, :8] += 1  # compression: 0.04 grey levels in the mean
    assert {n: m.tolist() for n, m in checkup.broken_pictures(twice).items()} == {
        n: np.repeat(m, 2).tolist() for n, m in checkup.broken_pictures(clips).items()}
    assert not any(mask.any() for mask in checkup.jumps(twice).values())


def test_points_outside_the_picture_count_beyond_a_few():
    points = np.full((4, 40, 2), 50.0)
    points[1, :3, 0], points[2, :2, 1], points[3] = 105, 105, np.nan
    assert checkup.outside(points, (100, 100)).tolist() == [False, True, False, False]
    assert checkup.outside(points - 52, (100, 100)).tolist() == [True, True, True, False]
    assert checkup.outside(points + 50.5, (100, 100)).tolist() == [False, True, False, False]  # a rounded edge


def test_off_colour_clips_are_named_and_exposure_does_not_count(rng):
    clips = {f"c{k}": checkup.thumbnails(picture(rng, 5, (0, 0, 0))) for k in range(9)}
    clips["tinted"] = checkup.thumbnails(picture(rng, 5, (40, 0, -40)))
    clips["bright"] = checkup.thumbnails(picture(rng, 5, (25, 25, 25)))
    assert list(checkup.off_colour(clips)) == ["tinted"]


@pytest.mark.parametrize("what", ["shape", "place"])
def test_ghosts_are_found_where_they_are(rng, what):
    points = {f"c{k}": face(rng) for k in range(10)}
    valid = {name: np.ones(FRAMES, bool) for name in points}
    valid["c1"][:3] = False
    points["c1"][:3] = np.nan
    if what == "shape":
        points["c4"][10:14] += rng.normal(0, 12, (4, POINTS, 2))
    else:
        points["c4"][10:14] += 90
    found = checkup.ghosts(points, valid)
    assert np.flatnonzero(found["c4"]).tolist() in ([10, 11, 12, 13], [9, 10, 11, 12, 13, 14])
    assert not any(mask.any() for name, mask in found.items() if name != "c4")


def test_ghosts_do_not_depend_on_scale_and_place_of_the_face(rng):
    points = {f"c{k}": face(rng) for k in range(10)}
    points["c4"][10:14] += rng.normal(0, 12, (4, POINTS, 2))
    valid = {name: np.ones(FRAMES, bool) for name in points}
    first = checkup.ghosts(points, valid)
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    second = checkup.ghosts({name: 3 * p @ turn + 500 for name, p in points.items()}, valid)
    assert {n: m.tolist() for n, m in first.items()} == {n: m.tolist() for n, m in second.items()}


def test_ghosts_of_a_long_corpus_are_told_by_some_of_its_frames(rng, monkeypatch):
    points = {f"c{k}": face(rng) for k in range(10)}
    points["c4"][10:14] += rng.normal(0, 12, (4, POINTS, 2))
    valid = {name: np.ones(FRAMES, bool) for name in points}
    valid["c2"][:] = False
    first = checkup.ghosts(points, valid)
    monkeypatch.setattr(checkup, "ENOUGH", 100)
    taken = checkup._some(points, valid, slice(None))
    everything = np.concatenate([points[n][valid[n]] for n in points])
    assert len(everything) == 9 * FRAMES and (taken == everything[::4]).all()
    second = checkup.ghosts(points, valid)
    assert {n: m.tolist() for n, m in first.items()} == {n: m.tolist() for n, m in second.items()}


def test_ghosts_are_looked_for_among_some_points(rng):
    points = {f"c{k}": face(rng) for k in range(10)}
    points["c4"][10:14, 3] += 60
    valid = {name: np.ones(FRAMES, bool) for name in points}
    others = [k for k in range(POINTS) if k != 3]
    assert checkup.ghosts(points, valid)["c4"][10:14].all()
    found = checkup.ghosts(points, valid, rows=others)
    alone = checkup.ghosts({n: p[:, others] for n, p in points.items()}, valid)
    assert not any(mask.any() for mask in found.values())
    assert {n: m.tolist() for n, m in found.items()} == {n: m.tolist() for n, m in alone.items()}
