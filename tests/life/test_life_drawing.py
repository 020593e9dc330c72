"""A life drawn from a seed: the talker's own moves, where speech is alike, and the file that keeps them."""

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.life import CONTEXTS, EyeModel, EyeRegion, Life, Tracks, draw_moves, find_blinks, shut_share
from dnnvss.timing import FrameClock

RATE, FRAMES, CLIPS = 25.0, 75, 12
RING = np.array([[10.0, 20], [20, 17], [30, 20], [20, 23]])
LID = np.array([1, 0.9, 0.4, 0.1, 0.1, 0.5, 0.8, 0.95])


@pytest.fixture(scope="module")
def life() -> Life:
    """A talker whose first mode is how shut the eyes are, and who blinks at the end of speech alone."""
    random, region = np.random.default_rng(4), EyeRegion.around([RING])
    modes = np.linalg.qr(random.normal(size=(3 * region.weight.size, 3)))[0].T.astype(np.float32)
    opening, context = np.ones((CLIPS, FRAMES)), np.zeros((CLIPS, FRAMES), int)
    context[:, 15:60], context[:, 50:60] = CONTEXTS.index("unstressed"), CONTEXTS.index("phrase end")
    for clip in opening:
        start = int(random.integers(48, 56))
        clip[start : start + len(LID)] = LID
    eyes = np.stack([1 - opening, *random.normal(0, 0.05, (2, CLIPS, FRAMES)).cumsum(axis=2)], axis=-1)
    head = lfilter([1], [1, -0.9], random.normal(0, 0.1, (CLIPS, FRAMES, 4)), axis=1) * [0.01, 0.01, 1, 1]
    whole = shut_share(opening, 0.55)
    tracks = Tracks(np.arange(CLIPS + 1) * FRAMES, eyes.reshape(-1, 3), whole.ravel(), opening.ravel(),
                    head.reshape(-1, 4), context.ravel(), RATE)
    return Life(EyeModel(region, modes), tracks)


def _said(seconds: float = 24.0) -> np.ndarray:
    context = np.zeros(round(seconds * RATE), int)
    for start in range(15, len(context) - 60, 75):
        context[start : start + 45] = CONTEXTS.index("unstressed")
        context[start + 35 : start + 45] = CONTEXTS.index("phrase end")
    return context


def test_the_same_seed_gives_the_same_life_and_another_another(life: Life) -> None:
    first, again, other = (draw_moves(life, _said(), seed) for seed in (1, 1, 2))
    assert (first.eyes == again.eyes).all() and (first.head == again.head).all()
    assert (first.eyes != other.eyes).any() and list(first.blinks) != list(other.blinks)
    assert (draw_moves(life, _said(), 1, "other words").head != first.head).any()


def test_no_share_is_a_still_face(life: Life) -> None:
    moves = draw_moves(life, _said(), 3, share=0.0)
    assert not moves.eyes.any() and not moves.head.any() and not len(moves.blinks)


def test_half_a_share_moves_half_as_far_and_lids_still_shut(life: Life) -> None:
    half, whole = draw_moves(life, _said(), 3, share=0.5), draw_moves(life, _said(), 3)
    assert half.head == pytest.approx(whole.head / 2)
    assert 0 < len(half.blinks) < len(whole.blinks)
    assert half.eyes[half.blinks.astype(int) + 1, 0] == pytest.approx(1.0)


def test_blinks_are_as_frequent_as_long_and_where_the_talker_has_them(life: Life) -> None:
    moves = [draw_moves(life, _said(), seed) for seed in range(20)]
    blinks = [b for m in moves for b in find_blinks(1 - m.eyes[:, 1], 0.55, RATE)]
    recorded = [b for clip in life.tracks.blinks for b in clip]
    assert len(blinks) / 20 == pytest.approx(len(recorded) / CLIPS * 8, rel=0.2)
    assert np.mean([b.seconds for b in blinks]) == pytest.approx(recorded[0].seconds, rel=0.1)
    late = [_said()[max(0, b.first - 8) : b.first + 8].max() == CONTEXTS.index("phrase end") for b in blinks]
    assert np.mean(late) > 0.7  # a third of the time


def test_eyes_and_head_move_as_far_and_as_fast_as_recorded(life: Life) -> None:
    heads = np.concatenate([draw_moves(life, _said(), seed).head for seed in range(20)])
    recorded = life.tracks.head
    assert np.abs(np.diff(heads, axis=0)).mean() == pytest.approx(np.abs(np.diff(recorded, axis=0)).mean(), rel=0.1)
    assert heads.std(axis=0) == pytest.approx(recorded.std(axis=0), rel=0.25)


def test_another_rate_holds_the_same_times_and_no_lid_overshoots(life: Life) -> None:
    moves = draw_moves(life, _said(), 5)
    double = moves.at(FrameClock(25), FrameClock(50), 2 * len(moves.eyes))
    assert double.blinks == pytest.approx(2 * moves.blinks)
    assert double.eyes.min() >= moves.eyes.min() and double.eyes.max() <= moves.eyes.max()
    assert moves.part(slice(4, 9)).eyes.shape == (5, 4)


@pytest.mark.parametrize("frames", [1, 2, 30])
def test_short_speech_lives_too(life: Life, frames: int) -> None:
    assert draw_moves(life, np.zeros(frames, int), 1).eyes.shape == (frames, 4)


def test_what_is_kept_is_read_again(life: Life, tmp_path: Path) -> None:
    again = Life.load(life.save(tmp_path / "life.npz"))
    assert again.tracks.eyes == pytest.approx(life.tracks.eyes, abs=2e-3)
    assert [len(clip) for clip in again.tracks.blinks] == [len(clip) for clip in life.tracks.blinks]
    assert again.model.modes == pytest.approx(life.model.modes, abs=1e-3)


def test_clips_that_do_not_fit_are_refused(life: Life, tmp_path: Path) -> None:
    path = life.save(tmp_path / "life.npz")
    arrays = dict(np.load(path))
    for wrong in ({"edges": arrays["edges"][:-1]}, {"context": arrays["context"] + 99},
                  {"modes": arrays["modes"][:, 3:]}, {"edges": arrays["edges"][::-1]}):
        with pytest.raises(DnnvssError, match="do not fit"):
            Life.load(files.write_arrays(path, **{**arrays, **wrong}))


def test_the_part_model_draws_what_it_was_fitted_to() -> None:
    region, random = EyeRegion.around([RING, RING + np.array([40, 0])]), np.random.default_rng(2)
    shapes = random.normal(size=(3, *region.weight.shape, 3))
    looks = np.tensordot(random.normal(size=(20, 3)), shapes, axes=1)
    model = EyeModel.fit(region, looks)
    drawn = (model.code(looks) @ model.modes).reshape(looks.shape)
    assert len(model.modes) == 3 and drawn == pytest.approx(looks * region.weight[..., None], abs=1e-3)
    assert model.modes @ model.modes.T == pytest.approx(np.eye(3), abs=1e-4)
    rim = np.concatenate([region.weight[0], region.weight[-1], region.weight[:, 0], region.weight[:, -1]])
    assert rim.max() == pytest.approx(0, abs=1e-6) and region.weight.max() == 1
