"""Markers are repaired: head motion, names, gaps and noise, against a session whose truth is known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from data_prep.capture.gaps import filled
from data_prep.capture.head import find_head, jig_of
from data_prep.capture.kalman import noise_of, smoothed
from data_prep.capture.learnt import learn_usual
from data_prep.capture.names import renamed
from data_prep.capture.repair import Repaired, settled, usual_places, whole
from data_prep.capture.stages import groups_of
from dnnvss.corpus.similarity import fit_similarity
from dnnvss.corpus.talker.hours import DAY_INFO, SPOKEN_FORMS, times_of_day
from dnnvss.corpus.talker.session import FACE_MARKERS, MARKERS, RATE, CapturedTake, Faults, capture
from dnnvss.errors import DnnvssError

JIG = np.array(
    [(-90, 60, 0), (-50, 120, 20), (0, 150, 60), (50, 120, 40), (90, 60, 10)], dtype=float
)


@pytest.fixture(scope="module")
def session() -> tuple[list[CapturedTake], list[Repaired], list[Repaired]]:
    """Takes of the built-in talker, without head motion and under right names, and whole."""
    takes = [capture(k, text) for k, text in enumerate(times_of_day(2))]
    jig = jig_of([t.seen[:, 66:] for t in takes])
    still = [find_head(t.seen[:, 66:], jig, RATE).taken_out(t.seen[:, :66]) for t in takes]
    rest = usual_places(np.concatenate(still))
    first = [settled(t.seen[:, :66], t.seen[:, 66:], jig, rest, RATE, FACE_MARKERS) for t in takes]
    usual = learn_usual([r.points.reshape(len(r.points), -1) for r in first])
    return takes, first, [whole(r.points, usual, RATE, FACE_MARKERS) for r in first]


def errors(takes: list[CapturedTake], done: list[Repaired]) -> np.ndarray:
    """Millimetres (F, 66) from the truth, whose frame is another one than the jig's."""
    own, true = (np.concatenate(x) for x in ([d.points for d in done], [t.truth for t in takes]))
    middle = np.median(true, axis=0)
    frame = fit_similarity(np.median(own, axis=0)[None], middle, rigid=True)
    return np.linalg.norm(frame.back(own, middle.mean(axis=0)) - true, axis=-1)


def test_a_session_is_as_it_was_before_the_cameras_saw_it(
    session: tuple[list[CapturedTake], list[Repaired], list[Repaired]],
) -> None:
    takes, first, done = session
    off = errors(takes, done)
    missing = np.concatenate([~np.isfinite(r.points).all(axis=2) for r in first])
    brow = [k for k, name in enumerate(FACE_MARKERS) if name.startswith("forehead")]
    assert missing.mean() > 0.09
    assert np.sqrt((off[:, brow] ** 2).mean()) < 0.1  # nothing moves there but the head
    assert np.sqrt((off[missing] ** 2).mean()) < 0.3 and np.sqrt((off**2).mean()) < 0.2


def test_all_swaps_are_found_and_no_others(
    session: tuple[list[CapturedTake], list[Repaired], list[Repaired]],
) -> None:
    takes, first, _ = session
    missed = 0
    for take, done in zip(takes, first, strict=True):
        told = {
            (frozenset(pair[:2]), k) for pair in done.told["swaps"] for k in range(pair[2], pair[3])
        }
        true = {
            (frozenset((FACE_MARKERS[a], FACE_MARKERS[b])), k)
            for a, b, c, d in take.swaps
            for k in range(c, d)
        }
        assert {pair for pair, _ in told} == {pair for pair, _ in true} and told <= true
        thrown = {tuple(sample) for sample in done.told["flickers"]}
        seen = {
            (FACE_MARKERS[m], int(f))
            for f, m in take.flickers
            if np.isfinite(take.seen[f, m]).all()
        }
        missed += len(seen - thrown)
    assert missed <= 1  # beside a gap a sample that was thrown is near enough


def test_head_motion_without_noise_is_taken_out_exactly() -> None:
    times = np.arange(200) / 100
    turn = Rotation.from_rotvec(
        np.stack([0.2 * np.sin(times), 0.1 * times, 0.15 * np.cos(times)], 1)
    ).as_matrix()
    shift = np.stack([30 * times, 5 * np.sin(times), 1000 + 0 * times], axis=1)
    face = np.array([(10.0, -20, 80), (0, 0, 90)])
    seen = np.einsum("fij,mj->fmi", turn, np.concatenate([JIG, face])) + shift[:, None]
    seen[40:60, 1] = np.nan
    seen[100, 2] += 50  # one that is somewhere else
    jig = jig_of([seen[:, :5]])
    still = find_head(seen[:, :5], jig, 100).taken_out(seen[:, 5:])
    assert np.ptp(still, axis=0).max() < 5e-3  # micrometres are what smoothing the pose costs
    assert np.linalg.norm(still[0, 0] - still[0, 1]) == pytest.approx(
        np.linalg.norm(face[0] - face[1]), abs=1e-3
    )


def test_jigs_that_tell_no_pose_are_refused() -> None:
    seen = np.tile(JIG, (9, 1, 1))
    with pytest.raises(DnnvssError, match="has 2 markers"):
        jig_of([seen[:, :2]])
    line = np.tile(np.outer(np.arange(5.0), [10, 20, 30]), (9, 1, 1))
    with pytest.raises(DnnvssError, match="on a line"):
        jig_of([line])
    with pytest.raises(DnnvssError, match="never seen together"):
        jig_of([np.where(np.arange(5)[:, None] == 3, np.nan, seen)])
    with pytest.raises(DnnvssError, match="seen in 0 of 9"):
        find_head(np.full((9, 5, 3), np.nan), JIG, 100)


def test_smoothing_takes_noise_and_leaves_movement() -> None:
    random, times = np.random.default_rng(0), np.arange(600) / 120
    true = np.stack([3 * np.sin(2 * np.pi * 2 * times), 5 * times, np.zeros(600)], axis=1)
    noisy = true + random.normal(0, 0.1, true.shape)
    assert noise_of(noisy) == pytest.approx(0.1, rel=0.15)
    off = np.sqrt(((smoothed(noisy, 120) - true)[20:-20] ** 2).mean(axis=0))
    assert (off < 0.065).all()
    assert smoothed(true[:5], 120) == pytest.approx(true[:5])


def test_gaps_of_a_slow_course_are_filled_and_the_rest_stays() -> None:
    times = np.arange(240) / 120
    true = np.stack([np.sin(2 * np.pi * 1.5 * times), 0.5 * times], axis=1)
    known = np.ones(true.shape, bool)
    known[100:118, 0] = known[30:40, 1] = known[:5, 1] = known[200:, 0] = False
    found = filled(np.where(known, true, np.nan), known)
    assert np.array_equal(found[known], true[known])
    assert (
        np.abs(found - true)[100:118, 0].max() < 0.04  # of 1, over 150 ms
        and np.abs(found - true)[30:40, 1].max() < 0.02
    )
    assert (found[:5, 1] == true[5, 1]).all() and (found[200:, 0] == true[199, 0]).all()


def test_a_marker_that_comes_back_far_away_is_believed_in_the_end() -> None:
    points = np.tile(np.array([(0.0, 0, 0), (30, 0, 0), (0, 30, 0)]), (60, 1, 1))
    points[20:, 0] += 20  # it slipped
    found = renamed(points, points[0], 120)
    assert np.isnan(found.points[20:30, 0]).all() and np.isfinite(found.points[40:, 0]).all()


def test_groups_are_names_without_their_digits_or_as_given() -> None:
    found = groups_of(MARKERS, "jig", None)
    assert found.rows["lips"] == (0, 12) and found.rows["jig"] == (66, 73) and len(found.face) == 66
    own = groups_of(
        MARKERS,
        ["forehead01", "forehead02", "nose06"],
        {"lips": MARKERS[:6], "jaw": MARKERS[12:15]},
    )
    assert list(own.rows) == ["lips", "jaw", "jig"] and own.rows["jig"] == (9, 12)
    for given, said in (
        (("jug", None), "0 markers are known to sit"),
        (("jig", {"lips": ["mouth"]}), "'mouth'"),
        (("jig", {"lips": MARKERS[:3]}), "has 3 markers"),
        (("jig", {"lips": MARKERS[:4], "jaw": MARKERS[:2]}), "two groups"),
    ):
        with pytest.raises(DnnvssError, match=said):
            groups_of(MARKERS, *given)  # type: ignore[arg-type]


def test_the_session_says_the_time_of_day() -> None:
    texts = times_of_day(55)
    assert len(set(texts)) == 55 and texts == times_of_day(55)
    words = {w.strip(",.").lower() for t in texts for w in t.replace("-", " ").split()}
    assert words <= set(SPOKEN_FORMS) and all(t.startswith("The time is now, ") for t in texts)
    assert all(t.rstrip(".").endswith(DAY_INFO) for t in texts)
    assert not set(texts) & set(times_of_day(12, 1, without=texts))


def test_a_take_keeps_its_truth() -> None:
    take = capture(
        4, "The time is now, one, pm.", faults=Faults(noise=0, missing=0, swaps=0, flickers=0)
    )
    assert (
        take.seen.shape[1:] == (73, 3)
        and take.truth.shape[1:] == (66, 3)
        and np.isfinite(take.seen).all()
    )
    apart = np.linalg.norm(take.seen[:, 0] - take.seen[:, 6], axis=1)
    assert apart == pytest.approx(np.linalg.norm(take.truth[:, 0] - take.truth[:, 6], axis=1))
