"""The whole chain: plain by default, and each setting does what it says."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import make_example
from face.face_cases import LinearFace, rig
from scipy.ndimage import gaussian_filter1d

from dnnvss import DnnvssError
from dnnvss.curves import derivatives, equations, mlpg, passages
from dnnvss.curves.constraints import Constraints, hold
from dnnvss.face.lips import mouth_gauges
from dnnvss.style.generation import Style, generate, generate_in_passages, speech_weight
from dnnvss.style.generator import Generator
from dnnvss.style.rules import silent_frames
from dnnvss.style.talker import Talker, speech_variances
from dnnvss.systems import Prediction
from dnnvss.timing import FrameClock, Tier

CLOCK = FrameClock(100)
TIER = Tier("phones", [(0, 0.5, "sil"), (0.5, 0.8, "AA"), (0.8, 0.9, "B"), (0.9, 1.2, "AA"), (1.2, 1.3, "F"),
                       (1.3, 1.6, "AA"), (1.6, 2.0, "sil")])
SPEECH = slice(50, 160)


def face() -> LinearFace:
    """Six points of lips in two modes: the first lowers the lower lip, the second raises the upper one."""
    shape = np.array([[-10.0, 0], [-3, -1], [3, -1], [10, 0], [3, 1], [-3, 1]])
    modes = np.zeros((2, 6, 2))
    modes[0, 4:, 1], modes[1, 1:3, 1] = 1.0, -1.0
    return LinearFace(shape, modes, mouth_gauges(shape, modes, np.arange(6), np.arange(6)))


def movement(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    x = gaussian_filter1d(rng.normal(size=(200, 2)), 5, axis=0)
    x = x / x.std(axis=0) + 3.0
    at_rest = silent_frames(TIER, CLOCK, 200)
    x[at_rest] = [-1.0, -0.5] + 0.1 * rng.normal(size=(int(at_rest.sum()), 2))
    x[80:90] = [-1.5, -1.0]
    x[120:130, 0] = -0.7
    return gaussian_filter1d(x, 1.5, axis=0)


@pytest.fixture(scope="module")
def talker() -> Talker:
    references = [movement(seed) for seed in range(8)]
    return Talker.of(references, [TIER] * 8, CLOCK, face())


def prediction(gain=0.6):
    x = movement(99)
    mean = derivatives(3 + gain * (x - 3)).astype(np.float32)
    return mean, np.array([0.3, 0.03, 0.01])[:, None] * np.ones(2)


def test_what_is_learnt_of_the_talker(talker):
    assert talker.rest == pytest.approx([-1.0, -0.5], abs=0.05) and (talker.rest_deviation < 0.2).all()
    assert talker.levels["aperture"] == pytest.approx(2 - 1.5 - 1.0, abs=0.2)  # aperture 2 + x1 + x2 at its least on B
    assert talker.levels["lower_lip"] == pytest.approx(1 - 0.7, abs=0.1)
    assert talker.natural == pytest.approx(np.mean(speech_variances([movement(s) for s in range(8)], [TIER] * 8, CLOCK),
                                                   axis=0), rel=0.1)


def test_the_default_is_plain_mlpg_bit_for_bit(talker):
    mean, variance = prediction()
    x = generate(mean, variance, TIER, CLOCK, talker)
    assert x.dtype == np.float32 and np.array_equal(x, mlpg(mean, variance))


def test_the_dial_restores_the_variance_of_speech_and_leaves_silence(talker):
    mean, variance = prediction()
    flat = [mlpg(derivatives(3 + 0.6 * (movement(s) - 3)), variance) for s in range(20, 28)]
    knowing = talker.knowing(flat, [movement(s) for s in range(20, 28)], [TIER] * 8, CLOCK)
    assert knowing.own / talker.natural == pytest.approx([0.36, 0.36], rel=0.05)
    plain = mlpg(mean, variance)
    x = generate(mean, variance, TIER, CLOCK, knowing, Style(articulation=1.0))
    assert x[SPEECH].var(axis=0) / plain[SPEECH].var(axis=0) == pytest.approx([1 / 0.36] * 2, rel=0.05)
    assert np.array_equal(x[:40], plain[:40]) and np.array_equal(x[171:], plain[171:])
    assert np.corrcoef(x[SPEECH, 0], plain[SPEECH, 0])[0, 1] == pytest.approx(1, abs=1e-6)
    still = generate(mean, variance, TIER, CLOCK, knowing, Style(articulation=0.0))
    assert still[SPEECH].var(axis=0).max() < 1e-8
    groups = Style(articulation=1.0, groups={"upper": [1]}, by_group={"upper": 0.0})
    one = generate(mean, variance, TIER, CLOCK, knowing, groups)
    assert one[SPEECH, 1].var() < 1e-8 and np.array_equal(one[:, 0], x[:, 0])


def test_without_held_out_trajectories_every_utterance_gets_the_talkers_variance(talker):
    mean, variance = prediction()
    x = generate(mean, variance, TIER, CLOCK, talker, Style(articulation=1.0))
    assert x[SPEECH].var(axis=0) == pytest.approx(talker.natural, rel=1e-4)


def test_lips_close_and_touch(talker):
    mean, variance = prediction(0.3)
    plain = generate(mean, variance, TIER, CLOCK, talker)
    assert talker.gauges["aperture"](plain)[80:90].min() > talker.levels["aperture"] + 0.3
    x = generate(mean, variance, TIER, CLOCK, talker, Style(closures=True, contacts=True))
    assert talker.gauges["aperture"](x)[83:87].max() < talker.levels["aperture"] + 1e-5
    assert talker.gauges["lower_lip"](x)[123:127].max() < talker.levels["lower_lip"] + 1e-5
    all_of_it = Style(articulation=1.0, closures=True, contacts=True, rest=True)
    own = hold([100], np.array([1.0, 0.0]), value=5.0, label="key")
    y = generate(mean, variance, TIER, CLOCK, talker, all_of_it, constraints=own)
    assert y[100, 0] == pytest.approx(5.0, abs=1e-5)
    assert talker.gauges["aperture"](y)[83:87].max() < talker.levels["aperture"] + 1e-5


def test_rest_in_silence(talker):
    mean, variance = prediction(0.3)
    x = generate(mean, variance, TIER, CLOCK, talker, Style(rest=True))
    plain = generate(mean, variance, TIER, CLOCK, talker)
    assert np.abs(x[:30] - talker.rest).max() < 0.5 * np.abs(plain[:30] - talker.rest).max()


def test_the_dial_fades_by_half_a_cosine():
    weight = speech_weight(TIER, CLOCK, 200)
    assert (weight[SPEECH] == 1).all() and (weight[:40] == 0).all() and weight[45] == pytest.approx(0.5)
    assert (np.diff(weight[40:51]) >= 0).all()
    assert (speech_weight(Tier("phones", [(0, 1, "sil")]), CLOCK, 100) == 0).all()


def test_a_talker_is_saved_and_loaded(talker, tmp_path):
    for own in (talker, talker.knowing([movement(1)] * 2, [movement(2)] * 2, [TIER] * 2, CLOCK)):
        back = Talker.load(own.save(tmp_path / "talker.npz"))
        assert np.array_equal(back.natural, own.natural) and back.levels == own.levels
        for name in ("aperture", "lower_lip"):
            assert np.array_equal(back.gauges[name].vector, own.gauges[name].vector)
        assert back.gauges["lower_lip"].constant == 1.0 and back.gauges["lower_lip"].unit == "px"
        assert (back.own is None) == (own.own is None)
    np.savez(tmp_path / "other.npz", natural=np.ones(2))
    with pytest.raises(DnnvssError, match=r"other\.npz.*lacks"):
        Talker.load(tmp_path / "other.npz")


def test_what_the_talker_never_showed_is_left_out(tmp_path):
    spoken = Tier("phones", [(0, 2.0, "AA")])
    learnt = Talker.of([movement(0)], [spoken], CLOCK, face())
    talker = Talker.load(learnt.save(tmp_path / "talker.npz"))
    assert talker.unknown == {name: f"the talker's recordings hold no {what}" for name, what in
                              (("closures", "p, b or m"), ("contacts", "f or v"), ("rest", "silence"))}
    mean, variance = prediction()
    everything = generate(mean, variance, TIER, CLOCK, talker, Style(closures=True, contacts=True, rest=True))
    assert np.array_equal(everything, mlpg(mean, variance))
    with pytest.raises(DnnvssError, match="speech"):
        Talker.of([movement(0)], [Tier("phones", [(0, 2.0, "sil")])], CLOCK, face())


@pytest.mark.parametrize("silent", [0, 1])
def test_clips_cut_to_their_speech_make_a_talker_that_can_be_read(tmp_path, silent):
    """A silence shorter than the ramp beside speech holds no frame at rest, and one a little longer a single one."""
    end = 0.1 + silent / 100
    tight = Tier("phones", [(0, end, "sil"), (end, 2.0, "AA")])
    talker = Talker.of([movement(0)], [tight], CLOCK, face())
    assert "rest" in talker.unknown
    assert talker.rest_deviation == pytest.approx(1e-3 * np.sqrt(talker.natural))  # the least of a coefficient
    assert np.array_equal(Talker.load(talker.save(tmp_path / "talker.npz")).rest_deviation, talker.rest_deviation)


@pytest.mark.parametrize("held_out", [1, 2, 3])
def test_a_curve_that_stands_still_in_the_held_out_sentences_keeps_its_movement(talker, tmp_path, held_out):
    """What an utterance without movement says of how much less a model moves is nothing: the gain is 1, by hand."""
    predicted, true = ([movement(seed + k) for k in range(held_out)] for seed in (30, 40))
    for x in true:
        x[:, 1] = 0.0
    knowing = talker.knowing(predicted, true, [TIER] * held_out, CLOCK)
    assert knowing.own[1] == pytest.approx(talker.natural[1])
    mean, variance = prediction()
    plain, dialled = (generate(mean, variance, TIER, CLOCK, knowing, Style(articulation=a)) for a in (None, 1.0))
    assert dialled[SPEECH, 1].std() == pytest.approx(plain[SPEECH, 1].std())
    assert Talker.load(knowing.save(tmp_path / "talker.npz")).own == pytest.approx(knowing.own)


def test_held_out_sentences_without_speech_change_no_gain(talker):
    quiet = Tier("phones", [(0, 2.0, "sil")])
    assert talker.knowing([movement(30)], [movement(40)], [quiet], CLOCK).own == pytest.approx(talker.natural)


def test_of_the_held_out_sentences_those_count_in_which_a_coefficient_moves(talker):
    true = [movement(40), movement(41), movement(42)]
    predicted = [0.5 * x for x in true]
    alone = talker.knowing(predicted[:2], true[:2], [TIER] * 2, CLOCK)
    true[2] = true[2] * [1.0, 0.0]
    both = talker.knowing(predicted, true, [TIER] * 3, CLOCK)
    assert both.own[1] == pytest.approx(alone.own[1]) == pytest.approx(0.25 * talker.natural[1])


def test_rules_of_a_gauge_that_the_face_lacks_are_left_out(tmp_path):
    references = [movement(seed) for seed in range(3)]
    talker = Talker.of(references, [TIER] * 3, CLOCK, rig(2))
    assert talker.unknown == {"closures": "this kind of face has no gauge aperture",
                              "contacts": "this kind of face has no gauge lower_lip"}
    assert Talker.load(talker.save(tmp_path / "talker.npz")).unknown == talker.unknown
    mean, variance = prediction()
    lips = generate(mean, variance, TIER, CLOCK, talker, Style(closures=True, contacts=True))
    assert np.array_equal(lips, mlpg(mean, variance))
    rested = generate(mean, variance, TIER, CLOCK, talker, Style(rest=True))
    assert np.abs(rested[:30] - talker.rest).max() < 0.5 * np.abs(lips[:30] - talker.rest).max()


def test_a_coefficient_that_stands_still_in_silence_can_be_pulled_to_rest():
    references = [movement(seed) for seed in range(3)]
    for x in references:
        x[silent_frames(TIER, CLOCK, 200), 1] = -0.5
    talker = Talker.of(references, [TIER] * 3, CLOCK, face())
    mean, variance = prediction()
    x = generate(mean, variance, TIER, CLOCK, talker, Style(rest=True))
    assert np.isfinite(x).all() and x[2, 1] == pytest.approx(-0.5, abs=0.02)


def test_a_key_that_opens_the_mouth_on_b_wins_over_the_rule(talker):
    mean, variance = prediction(0.3)
    style = Style(closures=True, contacts=True)
    key = hold([85], talker.gauges["aperture"].vector, talker.gauges["aperture"].constant, value=6.0, label="key")
    x = generate(mean, variance, TIER, CLOCK, talker, style, constraints=key)
    assert talker.gauges["aperture"](x)[85] == pytest.approx(6.0, abs=1e-4)
    assert talker.gauges["lower_lip"](x)[123:127].max() < talker.levels["lower_lip"] + 1e-5
    agreeing = hold([85], talker.gauges["aperture"].vector, talker.gauges["aperture"].constant, high=6.0, label="key")
    y = generate(mean, variance, TIER, CLOCK, talker, style, constraints=agreeing)
    assert talker.gauges["aperture"](y)[83:87].max() < talker.levels["aperture"] + 1e-5


@pytest.mark.parametrize("least, softness, open_", [((1.0, 0.5), 0.0, True), ((1.0, -np.inf), 0.0, False),
                                                    ((1.0, 0.5), 3.0, False)])
def test_keys_that_together_open_the_mouth_on_b_win_over_the_rule(talker, least, softness, open_):
    """The aperture is 2 and both coefficients: two keys hold it at 3.5 or above, one alone leaves the lips free, and
    soft ones give way."""
    mean, variance = prediction(0.3)
    jaw, lip = (hold([85], row, low=low, high=9.0, softness=softness, label=f"key of {row}")
                for row, low in zip(np.eye(2), least, strict=True))
    x = generate(mean, variance, TIER, CLOCK, talker, Style(closures=True), constraints=Constraints.joined([jaw, lip]))
    aperture = talker.gauges["aperture"](x)[83:87]
    if open_:
        assert (x[85] >= np.array(least) - 1e-4).all() and aperture[2] >= 3.5 - 1e-4
    else:
        assert aperture.max() < talker.levels["aperture"] + 1e-5


@pytest.mark.parametrize("wrong", [{"articulation": -1.0}, {"articulation": float("nan")}, {"release": "long"},
                                   {"by_group": {"jaw": -0.5}}])
def test_a_dial_that_is_no_number_is_named(wrong):
    with pytest.raises(DnnvssError, match=f"style.{next(iter(wrong))}"):
        Style(**wrong)


EVERYTHING = Style(articulation=1.0, closures=True, contacts=True, rest=True)


def test_one_frame_is_enough(talker):
    mean, variance = prediction()
    for label in ("B", "F", "AA", "sil"):
        x = generate(mean[:1], variance, Tier("phones", [(0, 0.01, label)]), CLOCK, talker, EVERYTHING)
        assert x.shape == (1, 2) and np.isfinite(x).all()
        if label == "B":
            assert talker.gauges["aperture"](x)[0] < talker.levels["aperture"] + 1e-5


@pytest.mark.parametrize("takes, style", [(1830, Style(articulation=1.0, rest=True)), (90, EVERYTHING)])
def test_an_hour_or_minutes_of_constraints_in_one_call(talker, takes, style):
    """A take of 2 s again and again, for 61 or 3 minutes: in the middle it is as it is between a few neighbours."""
    mean, variance = prediction()
    segments = [(2 * k + s.start, 2 * k + s.end, s.label) for k in range(takes) for s in TIER]
    long = np.tile(mean, (takes, 1, 1))
    x = generate(long, variance, Tier("phones", segments), CLOCK, talker, style)
    few = generate(long[:1800], variance, Tier("phones", segments[: 9 * len(TIER)]), CLOCK, talker, style)
    assert x.shape == (200 * takes, 2)
    assert np.abs(x[600:1200] - few[600:1200]).max() < 1e-3 * few.std()
    if style.closures:
        assert talker.gauges["aperture"](x.reshape(takes, 200, 2)[:, 83:87]).max() < talker.levels["aperture"] + 1e-4


@pytest.mark.parametrize("value", [0.0, np.nan, -1.0])
@pytest.mark.parametrize("style", [Style(), EVERYTHING])
def test_bad_variances_are_named_in_every_style(talker, value, style):
    mean, variance = prediction()
    spread = np.broadcast_to(variance, mean.shape).copy()
    spread[10, 0, 1] = value  # in silence
    with pytest.raises(DnnvssError, match=r"variance .* frame 10, stream 0, parameter 1"):
        generate(mean, spread, TIER, CLOCK, talker, style)


def test_infinite_variances_say_nothing_in_every_style(talker):
    mean, variance = prediction()
    spread = np.broadcast_to(variance, mean.shape).copy()
    spread[20:25], spread[82:88, 0] = np.inf, np.inf
    mean[20:25] = 1e6  # nobody listens
    x = generate(mean, spread, TIER, CLOCK, talker, EVERYTHING)
    assert np.isfinite(x).all() and np.abs(x).max() < 100
    assert talker.gauges["aperture"](x)[83:87].max() < talker.levels["aperture"] + 1e-4


def test_contradictory_wishes_of_an_artist_are_named(talker):
    mean, variance = prediction()
    keys = [hold([100], np.array([1.0, 0.0]), value=v, label=f"key {v:g}") for v in (1.0, 2.0)]
    with pytest.raises(DnnvssError, match="contradict one another: 'key"):
        generate(mean, variance, TIER, CLOCK, talker, EVERYTHING, constraints=Constraints.joined(keys))


@pytest.mark.parametrize("own", [None, 0.4])
def test_a_long_trajectory_is_made_in_passages_as_it_is_at_once(
        talker: Talker, own: float | None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Rest, dial, range, closures, contacts and keys: nothing needs all frames at once."""
    mean, variance = prediction(1.4)
    count = 12
    segments = [(s.start + 2.0 * k, s.end + 2.0 * k, s.label) for k in range(count) for s in TIER]
    tier, long = Tier("phones", segments), np.concatenate([mean] * count)
    own_talker = replace(talker, own=None if own is None else np.full(2, own))
    key = hold([390, 900, 1777], np.array([1.0, 0.5]), low=4.2, high=4.5, label="key")
    everything = replace(EVERYTHING, within=True)
    for constraints in (None, key):
        whole = generate(long, variance, tier, CLOCK, own_talker, everything, constraints=constraints)
        asked: list[slice] = []

        def predicted(around: slice) -> tuple[np.ndarray, np.ndarray]:
            asked.append(around)  # noqa: B023
            return long[around], variance

        with monkeypatch.context() as small:
            for name, value in (("LONG", 500), ("_PASSAGE", 450), ("_MARGIN", 200)):
                small.setattr(passages, name, value)
            found = generate_in_passages(predicted, len(long), tier, CLOCK, own_talker, everything,
                                         constraints=constraints)
        np.testing.assert_allclose(found, whole, atol=2e-6)
        assert max(s.stop - s.start for s in asked) == 850 and found.dtype == whole.dtype
    assert not np.allclose(whole, generate(long, variance, tier, CLOCK, own_talker))


class Counting:
    """A model that counts how often it is asked."""

    asked = 0

    def predict(self, example: object) -> Prediction:
        self.asked += 1
        return Prediction(np.full((4, 3, 1), self.asked, dtype=float), np.ones((3, 1)))


def test_the_last_predictions_are_at_hand_for_who_drags_a_key() -> None:
    model, rng = Counting(), np.random.default_rng(0)
    generator = Generator(None, model, None)
    examples = [make_example(str(k), rng) for k in range(6)]
    first = generator._predicted(examples[0])
    assert generator._predicted(examples[0]) is first and model.asked == 1
    for example in examples[1:]:
        generator._predicted(example)
    assert generator._predicted(examples[5]).mean[0, 0, 0] == 6 and model.asked == 6
    assert generator._predicted(examples[0]) is not first and len(generator._lately) == 4


@pytest.mark.parametrize("style", [Style(), EVERYTHING])
def test_the_equations_are_factorised_once(talker: Talker, style: Style, monkeypatch: pytest.MonkeyPatch) -> None:
    """MLPG and what holds closures, contacts and keys share them."""
    made = []
    original = equations.NormalEquations.__init__

    def counted(self: equations.NormalEquations, *given: object) -> None:
        made.append(1)
        original(self, *given)  # type: ignore[arg-type]

    monkeypatch.setattr(equations.NormalEquations, "__init__", counted)
    mean, variance = prediction(1.4)
    generate(mean, variance, TIER, CLOCK, talker, style, constraints=hold([100], np.array([1.0, 0.5]), low=4.2))
    assert len(made) == 1
