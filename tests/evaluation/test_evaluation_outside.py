"""Runs judged from outside: distances by hand, nulls and ceilings, and what is kept of it."""

from dataclasses import replace
from fractions import Fraction
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dnnvss.corpus import Utterance
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.outside import MEASURES, ROWS, Judged, Lips, laid_over, scores
from dnnvss.evaluation.outside.judge import Sentence, score_all
from dnnvss.evaluation.outside.judged import CEILING, IN_STILL, IN_TEXT, IN_VOICE, LATE, OTHER, OWN, TEXT, VOICE
from dnnvss.evaluation.outside.lips import NOSE, distances
from dnnvss.evaluation.outside.scores import Watched
from dnnvss.evaluation.sections import seen_from_outside
from dnnvss.face.landmarker import ROWS as POINTS
from dnnvss.face.landmarker.layout import LEFT_CORNER, LOWER_LIP, RIGHT_CORNER, UPPER_LIP
from dnnvss.timing import Alignment, FrameClock, Tier

CLOCK = FrameClock(25)
drawing = import_module("dnnvss.evaluation.outside.drawn_in")
judging = import_module("dnnvss.evaluation.outside.judge")  # whose function has its name in the package


def head(turn: float = 0.0, size: float = 1.0) -> np.ndarray:
    """A frame (1, P, 2) whose eyes are 80 apart, lips 20, mouth 40, and the lower lip 50 below the nose."""
    at = {RIGHT_CORNER: (0, 0), LEFT_CORNER: (80, 0), NOSE: (40, 30), UPPER_LIP: (40, 60), LOWER_LIP: (40, 80),
          61: (20, 70), 291: (60, 70)}
    points = np.zeros((len(POINTS), 2))
    for name, place in at.items():
        points[np.flatnonzero(name == POINTS)[0]] = place
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    return size * (points @ rotation)[None] + 7


@pytest.mark.parametrize(("turn", "size"), [(0.0, 1.0), (0.3, 1.0), (-0.2, 2.5)])
def test_distances_by_hand_wherever_the_head_is(turn: float, size: float) -> None:
    np.testing.assert_allclose(distances(head(turn, size)), [[25, 50, 62.5]])


def lips(aperture: np.ndarray) -> Lips:
    return Lips(np.stack([aperture, 50 - aperture / 2, 60 + aperture / 3], axis=1), np.ones(len(aperture), bool))


def moving(seed: int, frames: int = 60) -> Lips:
    rng = np.random.default_rng(seed)
    track = np.convolve(rng.standard_normal(frames + 8), np.ones(5) / 5, "same")[4:-4]
    return lips(np.maximum(8 + 8 * track, 0))


def watched(frames: int, level: float = 1.0) -> Watched:
    return Watched(np.ones(frames, bool), level, CLOCK)


def test_the_same_video_is_itself() -> None:
    truth = moving(0)
    found = scores(truth, truth, watched(60, 4.0))
    for name, (amount, weight) in found.items():
        assert weight > 0 and amount == pytest.approx(weight), name


def test_closures_by_hand() -> None:
    aperture = np.full(20, 10.0)
    truth, made = aperture.copy(), aperture.copy()
    truth[[4, 10, 16]] = 0  # found a frame late, missed, found in time
    made[[5, 16, 1]] = 0
    found = scores(lips(truth), lips(made), watched(20))
    assert found["closures found"] == (2, 3)
    assert found["closures right"] == (2, 3)


@pytest.mark.parametrize("filled", [0.0, np.nan])
def test_closures_beside_which_lips_were_not_seen_do_not_count(filled: float) -> None:
    """The mouth is drawn from frame 5 on, where the talker's lips close, and stays open."""
    aperture = np.full(20, 10.0)
    truth, made = lips(aperture.copy()), lips(aperture.copy())
    truth.tracks[[5, 6, 12], 0] = 0
    made.tracks[:5], made.seen[:5] = filled, False
    assert scores(truth, made, watched(20))["closures found"] == (0, 1)
    made.tracks[[9, 15], 0] = 0
    truth.tracks[8], truth.seen[8] = filled, False
    assert scores(truth, made, watched(20))["closures right"] == (0, 1)


def test_half_as_much_movement_is_a_quarter_of_the_variance() -> None:
    truth = moving(1)
    found = scores(truth, lips(truth.tracks[:, 0] / 2), watched(60))
    assert found["variance"][0] == pytest.approx(0.25)
    assert found["aperture r"][0] == pytest.approx(1)


def test_frames_without_a_face_do_not_count() -> None:
    truth, made = moving(2), moving(2)
    made.tracks[10:20] = np.nan
    made.seen[10:20] = False
    assert scores(truth, made, watched(60))["aperture r"][0] == pytest.approx(1)
    assert scores(truth, Lips(made.tracks, np.zeros(60, bool)), watched(60))["aperture r"] == (0, 0)


def test_words_are_laid_over_each_other() -> None:
    """A word of half the length is slowed to a half; a silence in front is passed."""
    own = Tier("words", [(0, 0.4, ""), (0.4, 0.8, "one"), (0.8, 1.2, "two")])
    tier = Tier("words", [(0, 0.2, ""), (0.2, 1.0, "one"), (1.0, 1.4, "two")])
    made = Lips(np.repeat(CLOCK.centres(30)[:, None], 3, axis=1), np.ones(30, bool))
    places = laid_over(own, tier, CLOCK, 35)
    assert places is not None
    moved = made.at(places)
    moments = CLOCK.centres(35)
    inside = (moments > 0.2) & (moments < 1.0)
    np.testing.assert_allclose(moved.tracks[inside, 0], 0.4 + (moments[inside] - 0.2) / 2, atol=1e-9)
    assert laid_over(own, tier.renamed(["", "one", "three"]), CLOCK, 35) is None


def sentence(seed: int, made: Lips | None) -> Sentence:
    phones = Tier("phones", [(0, 0.2, "sil"), (0.2, 0.6, "P"), (0.6, 2.2, "AA"), (2.2, 2.4, "sil")])
    words = Tier("words", [(0, 0.2, ""), (0.2, 2.2, "par"), (2.2, 2.4, "")])
    truth = moving(seed)
    utterance = Utterance(f"u{seed}", "par", Alignment([phones, words]), "v.mp4", None, None, 25, 60)
    told = {TEXT: "says other words"} if made is None else {}
    own = dict.fromkeys((CEILING, OWN, IN_VOICE, IN_STILL), truth) | dict.fromkeys((VOICE,), made or truth)
    return Sentence(utterance, truth, own if made is None else own | dict.fromkeys((TEXT, IN_TEXT), made), told)


def test_a_sentence_in_which_nobody_speaks_counts_for_nothing() -> None:
    hush = sentence(5, None)
    quiet = Alignment([Tier("phones", [(0, 2.4, "sil")]), Tier("words", [(0, 2.4, "")])])
    hush = replace(hush, utterance=replace(hush.utterance, alignment=quiet))
    judged = score_all([sentence(0, None), hush, sentence(1, None)], "articulated")
    weights = {row: [weight for _, weight in by["aperture r"]] for row, by in judged.pairs.items()}
    assert weights[VOICE] == weights[LATE] == [1, 0, 1] and weights[OTHER] == [0, 0, 1]


def test_clips_of_several_frame_rates_are_each_measured_at_their_own() -> None:
    """One clip with every picture twice says what it did: 50 frames a second in place of 25."""
    alike = [sentence(k, None) for k in range(2)]
    lips = {name: Lips(np.repeat(own.tracks, 2, axis=0), np.repeat(own.seen, 2)) for name, own in alike[1].made.items()}
    twice = replace(alike[1], utterance=replace(alike[1].utterance, rate=Fraction(50), frames=120), truth=lips[VOICE],
                    made=lips)
    one, other = score_all(alike, "a"), score_all([alike[0], twice], "a")
    for row in (VOICE, CEILING):
        for measure in ("closures found", "aperture r", "variance"):
            assert other.pairs[row][measure] == pytest.approx(np.array(one.pairs[row][measure])), (row, measure)


def test_what_was_not_measured_is_not_seen_through_the_face(monkeypatch: pytest.MonkeyPatch) -> None:
    known = np.array([True, False, True, True])
    monkeypatch.setattr(judging, "through_the_face", lambda spoken, utterance: (iter(()), known))
    monkeypatch.setattr(judging, "see", lambda landmarker, pictures: lips(np.arange(4.0)))
    seen = judging._own(None, None, None)  # type: ignore[arg-type]
    assert seen.seen.tolist() == known.tolist() and seen.tracks[:, 0].tolist() == [0, 1, 2, 3]


def test_frames_that_cannot_be_drawn_into_are_not_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three frames of six, from the third; the speech is a frame short, and its last row is held."""
    monkeypatch.setattr(drawing, "revoicer", lambda face, footage, order: SimpleNamespace(frames=list))
    monkeypatch.setattr(drawing, "see", lambda landmarker, pictures: lips(np.array(pictures)[:, 0]))
    redrawn = drawing.Redrawn(None, range(3), 2, 6)
    seen = redrawn.see(None, np.arange(4.0)[:, None])
    assert seen.seen.tolist() == [False, False, True, True, True, False]
    assert seen.tracks[2:5, 0].tolist() == [2, 3, 3]


def test_nulls_are_beaten_and_what_says_other_words_is_told(tmp_path: Path) -> None:
    judged = score_all([sentence(k, None) for k in range(4)], "articulated")
    assert set(judged.pairs) == set(ROWS)
    assert judged.estimate(VOICE, "aperture r").value == pytest.approx(1)
    assert judged.estimate(OTHER, "aperture r").value < judged.estimate(LATE, "aperture r").value < 1
    assert np.isnan(judged.estimate(TEXT, "variance").value)
    assert judged.left_out[0] == "u0: text alone says other words"
    path = judged.save(tmp_path)
    assert "another sentence" in path.read_text()
    again = Judged.load(tmp_path)
    assert again is not None and again.rows(VOICE) == judged.rows(VOICE)
    section = seen_from_outside({"A": tmp_path, "B<": tmp_path / "none"})
    assert section is not None and "Not judged yet (dnnvss outside RUN): B&lt;." in section.html()
    assert seen_from_outside({"B": tmp_path / "none"}) is None
    assert section.markdown().count("\n| A, ") == 4


def test_a_file_of_another_version_is_refused(tmp_path: Path) -> None:
    judged = score_all([sentence(0, None), sentence(1, None)], "plain")
    path = judged.save(tmp_path).with_suffix(".json")
    path.write_text(path.read_text().replace(next(iter(MEASURES)), "something"))
    with pytest.raises(DnnvssError, match="known"):
        Judged.load(tmp_path)
    section = seen_from_outside({"A": tmp_path})
    assert section is not None
    assert "another version: A." in section.markdown() and "another version: A." in section.html()
    judged.save(tmp_path / "B")
    both = seen_from_outside({"A": tmp_path, "B": tmp_path / "B"})
    assert both is not None and "another version: A." in both.note and {row[0][:3] for row in both.rows[:4]} == {"B, "}
