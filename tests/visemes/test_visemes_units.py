"""Dynamic visemes: learnt, named, written as a tier, and compared with the gestures of the built-in talker."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from conftest import run_command
from face.face_cases import LinearFace, rig
from omegaconf import OmegaConf

from dnnvss.corpus import Corpus
from dnnvss.corpus.talker import LANDMARK_GROUPS, RATE, perform_take, script
from dnnvss.corpus.talker.geometry import landmark_track
from dnnvss.curves import resample
from dnnvss.errors import DnnvssError
from dnnvss.face.encoding import newest_encoding
from dnnvss.features import FeatureTable, Settings, encode, expand
from dnnvss.timing import Alignment, FrameClock, Tier
from dnnvss.visemes import (
    GestureSettings,
    Movement,
    Visemes,
    VisemeSettings,
    aligned_clip,
    boundary_scores,
    compare_units,
    gesture_view,
    label_agreement,
    learn,
    viseme_tier,
)
from dnnvss.visemes import corpus as of_corpus
from dnnvss.visemes.clusters import KMeans, partition
from dnnvss.visemes.corpus import learnt_from, viseme_clips, viseme_settings
from dnnvss.visemes.gestures import cut, reference_speed
from dnnvss.visemes.report import report
from dnnvss.visemes.units import shapes

CLOCK = FrameClock(100)
Talker = tuple[list[Alignment], list[Movement]]


@pytest.fixture(scope="module")
def talker() -> Talker:
    """Shape parameters of 60 sentences: tracked lips and jaw, eight principal components, 30 to 100 frames a second."""
    takes = [perform_take(name, text) for name, text in script(60).items()]
    rows = [i for g in ("jaw", "lips_outer", "lips_inner") for i in range(*LANDMARK_GROUPS[g])]
    tracks = []
    for take in takes:
        still = take.articulators.copy()
        still[:, 8:11] = 0  # the head does not move
        points = landmark_track(still, 320)[:, rows]
        jitter = np.random.default_rng(take.seed).normal(0, 0.05, points.shape)
        tracks.append((points + jitter).reshape(take.frames, -1))
    everything = np.concatenate(tracks)
    _, _, modes = np.linalg.svd(everything - everything.mean(0), full_matrices=False)
    alignments = [take.alignment for take in takes]
    clips = []
    for track, alignment in zip(tracks, alignments, strict=True):
        parameters = (track - everything.mean(0)) @ modes[:8].T
        count = CLOCK.edge(alignment.end)
        clips.append(aligned_clip(resample(parameters, FrameClock(RATE), CLOCK, count=count), alignment, CLOCK))
    return alignments, clips


def test_gestures_look_at_the_points_of_the_face_or_at_coefficients() -> None:
    model = LinearFace(np.zeros((3, 2)), np.arange(12.0).reshape(2, 3, 2))
    assert gesture_view(model, GestureSettings()).shape == (2, 6)
    assert gesture_view(model, GestureSettings(looks="coefficients", coefficients=1)) is None
    with pytest.raises(DnnvssError, match=r"looks=points.*looks=coefficients"):
        gesture_view(model, GestureSettings(coefficients=1))
    with pytest.raises(DnnvssError, match=r"no points.*looks=coefficients"):
        gesture_view(rig(2), GestureSettings())
    with pytest.raises(DnnvssError, match="looks=lips is unknown"):
        GestureSettings(looks="lips")


@pytest.mark.parametrize(("method", "units"), [("kmeans", 55), ("kmeans", 100), ("dtw", 40)])
def test_the_talkers_gestures_are_recovered(talker: Talker, method: str, units: int) -> None:
    alignments, clips = talker
    settings = VisemeSettings(units=units, method=method, least=4, starts=1 if method == "dtw" else 3)
    visemes = learn(clips[:40], CLOCK, settings)
    assert len(visemes) <= units
    tiers = [visemes.tier(clip) for clip in clips[40:]]  # sentences that were not learnt from
    true = [alignment["gestures"] for alignment in alignments[40:]]
    scores = boundary_scores([(t.edges[1:-1], g.edges[1:-1]) for t, g in zip(tiers, true, strict=True)], 0.02)
    assert scores.f1 > 0.9
    assert label_agreement(list(zip(tiers, true, strict=True))) > 0.7
    resting = [s.duration for t in tiers for s in t if s.label == "0"]
    assert sum(resting) == pytest.approx(sum(s.duration for g in true for s in g if s.label == "rest"), rel=0.15)


def test_units_are_numbered_by_use_and_rest_is_0(talker: Talker) -> None:
    visemes = learn(talker[1][:20], CLOCK, VisemeSettings(units=20, least=4))
    assert (np.diff(visemes.counts[1:]) <= 0).all()
    assert visemes.counts[1:].min() >= 4
    assert visemes.means.shape == (len(visemes), 8, 8)
    assert visemes.centres.shape == (len(visemes) - 1, 8, 8)
    np.testing.assert_allclose(visemes.means[1:] * visemes.scale, visemes.centres, atol=1e-9)
    assert 0.1 < visemes.seconds[0] < 0.5
    assert np.abs(np.diff(visemes.means[0], axis=0)).max() < 0.1 * np.abs(np.diff(visemes.means, axis=1)).max()


def test_description_survives(talker: Talker) -> None:
    visemes = learn(talker[1][:10], CLOCK, VisemeSettings(units=12, least=3))
    description = {key: value.copy() if isinstance(value, np.ndarray) else value
                   for key, value in visemes.describe().items()}
    again = Visemes.from_description(description)
    assert again.settings == visemes.settings
    assert again.tier(talker[1][11]) == visemes.tier(talker[1][11])


def test_the_tier_feeds_the_feature_table(talker: Talker) -> None:
    alignments, clips = talker
    visemes = learn(clips[:10], CLOCK, VisemeSettings(units=12, least=3))
    alignment = alignments[0].with_tier(visemes.tier(clips[0]))
    table = FeatureTable(("centre_viseme", "viseme_frames"), Settings(units=12))
    dense = expand(encode(alignment, "", table, CLOCK))
    assert dense.shape == (len(clips[0].trajectory), 13)
    assert (dense[:, :12].sum(1) == 1).all()


def test_a_view_chooses_what_is_cut(talker: Talker) -> None:
    _, clips = talker
    noise = np.random.default_rng(0)
    mixed = [Movement(np.hstack([c.trajectory, noise.normal(0, 5, (len(c.trajectory), 2))]), c.silence)
             for c in clips[:10]]
    view = np.vstack([np.eye(8), np.zeros((2, 8))])
    visemes = learn(mixed, CLOCK, VisemeSettings(units=8, least=3), view)
    plain = learn(clips[:10], CLOCK, VisemeSettings(units=8, least=3))
    for m, c in zip(mixed, clips, strict=False):
        np.testing.assert_array_equal(visemes.gestures(m).edges, plain.gestures(c).edges)


def test_shapes_by_hand() -> None:
    trajectory = np.arange(10.0)[:, None]  # frame i holds i at time i + 1/2
    found = shapes(trajectory, np.array([0.0, 4, 10]), 2)
    np.testing.assert_allclose(found[:, :, 0], [[0.5, 2.5], [5, 8]])
    whole = shapes(trajectory, np.array([0.0, 10]), 10)
    np.testing.assert_allclose(whole[0, :, 0], np.arange(10))


def test_tier_joins_rests_and_nothing_else() -> None:
    tier = viseme_tier(np.array([0, 10.4, 20, 30, 40, 50]), np.array([0, 0, 3, 3, 0]), CLOCK, (1.0, 1.496))
    assert tier == Tier("visemes", [(1.0, 1.2, "0"), (1.2, 1.3, "3"), (1.3, 1.4, "3"), (1.4, 1.496, "0")])
    with pytest.raises(DnnvssError, match="no visemes"):
        viseme_tier(np.zeros(1), np.zeros(0, int), CLOCK)


def test_boundary_scores_by_hand() -> None:
    found, true = np.array([1.0, 2.0, 5.0, 9.0]), np.array([1.5, 2.2, 7.0])
    scores = boundary_scores([(found, true)], 0.6)
    assert (scores.precision, scores.recall) == (2 / 4, 2 / 3)
    assert scores.f1 == pytest.approx(4 / 7)
    assert scores.error == pytest.approx((0.5 + 0.2) / 2)
    assert boundary_scores([(found, found)], 0).f1 == 1
    assert boundary_scores([(np.array([1.0, 1.1]), np.array([1.05]))], 0.1).precision == 0.5  # one partner each
    assert boundary_scores([(np.zeros(0), true)], 1).f1 == 0


def test_agreement_does_not_depend_on_names() -> None:
    one = Tier("gestures", [(0, 1, "a"), (1, 2, "b"), (2, 3, "a"), (3, 4, "c")])
    two = Tier("visemes", [(0, 1.1, "7"), (1.1, 2.2, "1"), (2.2, 3, "7"), (3, 4, "4")])
    assert label_agreement([(two, one)]) == pytest.approx(1)


def test_held_out_likelihood_peaks_at_the_number_of_classes() -> None:
    random = np.random.default_rng(0)
    poses = random.normal(0, 1, (4, 3))
    clips = []
    for _ in range(30):  # between four poses: twelve movements
        order = [random.integers(4)]
        while len(order) < 25:
            order.append(random.choice([p for p in range(4) if p != order[-1]]))
        keys, s = poses[order] + random.normal(0, 0.15, (25, 3)), (np.arange(15) + 0.5) / 15
        ease = (s**3 * (10 - 15 * s + 6 * s**2))[:, None]
        movement = np.concatenate([a + (b - a) * ease for a, b in pairwise(keys)])
        clips.append(Movement(movement, np.zeros(len(movement), bool)))
    choices = compare_units(clips, CLOCK, VisemeSettings(least=2, starts=5), [5, 13, 40])
    assert max(choices, key=lambda c: c.likelihood).units == 13
    assert choices[0].distortion > 3 * choices[1].distortion
    with pytest.raises(DnnvssError, match="2 clips cannot be held out in 3 folds"):
        compare_units(clips[:2], CLOCK, VisemeSettings(), [5])


def test_measurements_are_a_table(talker: Talker, capsys: pytest.CaptureFixture[str]) -> None:
    alignments, clips = talker
    pairs = list(zip(alignments, clips, strict=True))
    text = report(pairs[:24], pairs[24:36], CLOCK, VisemeSettings(least=3, starts=1), [20, 40], np.eye(8))
    rows = [line.strip("| ").split(" | ") for line in text.splitlines() if line.startswith("|")]
    looks = ("points", "coefficients", "first coefficient")
    cuts = [f"{rule} of {look}" for rule in ("speed", "acceleration") for look in looks]
    assert [r[0] for r in rows] == ["cut by", "---", *cuts, "units", "---", "20", "40"]
    assert float(rows[2][5]) > 0.9
    assert float(rows[2][5]) > float(rows[5][5])
    assert run_command("visemes", "/nowhere") == 1
    assert "corpus.json: no such file" in capsys.readouterr().err


def test_configuration() -> None:
    config = OmegaConf.load(Path(__file__).parents[2] / "conf" / "visemes" / "default.yaml")
    assert viseme_settings(config) == VisemeSettings()
    with pytest.raises(DnnvssError, match=r"visemes\.unit is no setting. Did you mean visemes\.units\?"):
        VisemeSettings.from_config({"unit": 3})
    with pytest.raises(DnnvssError, match=r"visemes\.gestures\.shortes.*gestures\.shortest\?"):
        VisemeSettings.from_config({"gestures": {"shortes": 3}})
    with pytest.raises(DnnvssError, match="method=gmm is unknown"):
        VisemeSettings(method="gmm")
    with pytest.raises(DnnvssError, match="units=1 is too little"):
        VisemeSettings(units=1)


def test_units_learnt_clip_by_clip_are_those_of_all_gestures_in_one_array(talker: Talker) -> None:
    clips = [Movement(c.trajectory, c.silence, c.span, np.arange(len(c.trajectory)) != 40) for c in talker[1]]
    settings = VisemeSettings(units=20, least=4)
    seen = [c.trajectory for c in clips]
    reference = reference_speed(seen, [c.silence | ~c.known for c in clips], CLOCK, settings.gestures)
    cuts = [cut(y, c.silence, CLOCK, settings.gestures, reference) for y, c in zip(seen, clips, strict=True)]
    found = np.concatenate([shapes(c.trajectory, g.edges, 8) for c, g in zip(clips, cuts, strict=True)])
    away = np.concatenate([(np.floor(g.edges[:-1]) > 40) | (np.ceil(g.edges[1:]) <= 40) for g in cuts])
    moving = found[away & ~np.concatenate([g.rest for g in cuts])]
    scale = np.concatenate([c.trajectory[c.known] for c in clips]).std(axis=0) ** -settings.whitening
    expected = partition(moving * scale, settings.units - 1, KMeans(), settings.least, settings.starts, settings.seed)
    made = learn(clips, CLOCK, settings)
    order = np.argsort(-np.bincount(expected.members), kind="stable")
    np.testing.assert_array_equal(made.centres, expected.centres[order])
    np.testing.assert_array_equal(made.counts[1:], np.bincount(expected.members)[order])
    assert made.counts.sum() == away.sum()


def test_long_corpora_are_learnt_from_clips_spread_over_them(encoded: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    corpus = Corpus.open(encoded)
    codes, train = newest_encoding(corpus), corpus.split("train")
    assert learnt_from(train, codes) == [u for u in train if u.id not in codes.dropped]
    seconds = sum(u.frames / float(u.clock.rate) for u in learnt_from(train, codes))
    monkeypatch.setattr(of_corpus, "MOST", 0.4 * seconds)
    some = learnt_from(train, codes)
    assert some == [u for u in train if u.id not in codes.dropped][::3]
    assert [i for i, _ in viseme_clips(some, codes, CLOCK)] == [u.id for u in some]
