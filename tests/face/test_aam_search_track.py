"""Tracking: what is lost is said to be lost, and found again."""

import weakref
from collections.abc import Iterator
from functools import partial

import cv2
import numpy as np
from face import search_cases as cases

from dnnvss.face.aam.search import track
from dnnvss.face.aam.search.bootstrap import Labelled, gather, retrain
from dnnvss.face.aam.search.track import FLAGS, Track


def _names(found: Track) -> list[str]:
    return [FLAGS[f] for f in found.flag]


def test_every_frame_of_a_sentence_is_tracked() -> None:
    pictures, points = cases.clip(5)
    found = track(cases.model(), pictures)
    errors = cases.error(found.points, points)
    assert found.valid.all() and set(_names(found)) == {"ok"}
    assert errors.mean() < 0.25 and errors.max() < 0.6
    assert found.error.max() < cases.model().limits.error


def test_a_piece_goes_on_where_the_last_ended() -> None:
    pictures, points = cases.clip(5)
    found = track(cases.model(), pictures[20:], before=points[19])
    assert found.valid.all() and cases.error(found.points, points[20:]).max() < 0.6


def test_a_face_that_goes_is_lost_and_found_again() -> None:
    pictures, points = cases.clip(5)
    empty = np.full_like(pictures[:6], 90)
    found = track(cases.model(), np.concatenate([pictures[:8], empty, pictures[14:22]]))
    assert _names(found)[8:14] == ["lost"] * 6
    assert found.valid[:8].all() and found.valid[14:].all()
    assert cases.error(found.points, points[:22])[found.valid].max() < 0.6


def test_pictures_without_a_face_are_refused() -> None:
    noise = np.random.default_rng(0).integers(0, 255, (6, cases.SIZE, cases.SIZE, 3)).astype(np.uint8)
    for pictures in (noise, np.stack([cv2.GaussianBlur(n, (0, 0), 6) for n in noise]), np.full_like(noise, 128)):
        assert not track(cases.model(), pictures).valid.any()


def test_after_a_cut_the_face_is_found_elsewhere() -> None:
    pictures, points = cases.clip(5)
    later = np.stack([cases.moved(p, 30, -12, 0.8) for p in pictures[10:18]])
    found = track(cases.model(), np.concatenate([pictures[:8], later]))
    true = np.concatenate([points[:8], points[10:18] * 0.8 + [30, -12]])
    assert found.valid.all() and "restarted" in _names(found)
    assert cases.error(found.points, true).max() < 0.7


def test_two_faces_that_fit_alike_are_ambiguous() -> None:
    pictures, _ = cases.clip(5, 6)
    found = track(cases.model(), np.concatenate([pictures, pictures], axis=2))
    assert set(_names(found)) == {"ambiguous"} and not found.valid.any()


def test_a_doubtful_face_that_is_lost_and_found_again_stays_doubtful() -> None:
    pictures, _ = cases.clip(5, 10)
    both = np.concatenate([pictures, pictures], axis=2)
    both[5:] = np.roll(both[5:], 15, axis=1)  # a jump that only detection follows
    found = track(cases.model(), both)
    assert set(_names(found)) == {"ambiguous"} and not found.valid.any()


def test_of_two_faces_the_one_that_continues_is_followed() -> None:
    pictures, points = cases.clip(5, 12)
    alone = np.concatenate([pictures, np.full_like(pictures, 90)], axis=2)
    both = np.concatenate([pictures, pictures], axis=2)
    found = track(cases.model(), np.concatenate([alone[:6], both[6:]]))
    assert found.valid.all() and cases.error(found.points, points).max() < 0.6


def test_a_face_half_out_of_the_picture_is_not_valid() -> None:
    pictures, points = cases.clip(5, 6)
    low = points[0].max(axis=0)[1]
    for out in (0.3, 0.6):
        down = cases.SIZE - low + out * np.ptp(points[0], axis=0)[1]
        assert not track(cases.model(), np.stack([cases.moved(p, 0, down) for p in pictures])).valid.any()


def test_blurred_pictures_are_flagged() -> None:
    pictures, _ = cases.clip(5, 20)
    blurred = np.stack([cv2.GaussianBlur(p, (0, 0), 2.0) for p in pictures[6:10]])
    found = track(cases.model(), np.concatenate([pictures[:6], blurred, pictures[10:]]))
    assert not found.valid[6:10].any() and found.valid[:6].all() and found.valid[10:].all()


def test_another_resolution_is_tracked_in_its_own_pixels() -> None:
    pictures, points = cases.clip(5, 8)
    larger = np.stack([cv2.resize(p, None, fx=1.75, fy=1.75, interpolation=cv2.INTER_LINEAR) for p in pictures])
    found = track(cases.model(), larger)
    assert found.valid.all() and cases.error(found.points, 1.75 * points).max() < 1.0


def test_drifting_light_is_followed() -> None:
    pictures, points = cases.clip(5, 20)
    light = np.linspace(1.0, 0.55, len(pictures))[:, None, None, None]
    found = track(cases.model(), np.clip(pictures * light + 20, 0, 255).astype(np.uint8))
    assert found.valid.all() and cases.error(found.points, points).max() < 0.6


def test_the_models_own_frames_teach_it() -> None:
    model, (images, points) = cases.model(), cases.labelled()
    clip = cases.clip(3)[0]
    found = gather(model, [(lambda: clip, track(model, clip))], 12)
    again = retrain(model, Labelled(images, points), found)
    pictures, true = cases.clip(5)
    before, after = (track(m, pictures) for m in (model, again))
    assert len(found.images) == 12 and after.valid.all()
    assert after.error.mean() < before.error.mean()
    assert cases.error(after.points, true).mean() < cases.error(before.points, true).mean() + 0.05


def test_frames_to_learn_from_are_read_one_by_one_and_the_chosen_ones_again() -> None:
    model, clips = cases.model(), [cases.clip(n)[0][:12] for n in (3, 5)]
    held: list[weakref.ref[np.ndarray]] = []

    def frames(clip: np.ndarray) -> Iterator[np.ndarray]:
        for picture in clip:
            copy = picture.copy()
            held.append(weakref.ref(copy))
            assert sum(r() is not None for r in held) <= 3 + 3  # those chosen, and the few at hand
            yield copy

    found = gather(model, [(partial(frames, clip), track(model, clip)) for clip in clips], 3)
    assert len(found.images) == len(found.points) == 3
    for image, points in zip(found.images, found.points, strict=True):
        number = next(n for n in (0, 1) if (clips[n] == image).all(axis=(1, 2, 3)).any())
        frame = int((clips[number] == image).all(axis=(1, 2, 3)).argmax())
        assert cases.error(points, cases.clip((3, 5)[number])[1][frame]) < 0.6


def test_nothing_confident_teaches_nothing() -> None:
    pictures = np.full((5, 64, 64, 3), 90, np.uint8)
    model = cases.model()
    assert len(gather(model, [(lambda: pictures, track(model, pictures))], 30).images) == 0
