"""Sound that is late beside its picture is found from the clips themselves, and moved."""

import numpy as np
import pytest

from data_prep import heard_lips, sync
from data_prep.align import given
from data_prep.stages import Workshop
from data_prep.sync import Sync, find_sync, in_step, shrunk
from dnnvss.errors import DnnvssError
from dnnvss.formats import write_alignment
from dnnvss.media import SPEECH_RATE, read_audio, write_wav
from dnnvss.timing import Alignment, Tier

GROUPS = {"lips_outer": (0, 4), "nose_base": (4, 6), "right_eye": (6, 8)}
STILL = np.array([[-3.0, 0], [3, 0], [0, -3], [0, 3], [-2, -8], [2, -8], [-6, -14], [6, -14]])


def clip(late, rng, seconds=2.5):
    """Return landmarks and a hiss that is loud while the mouth is open, ``late`` seconds after it."""
    starts = 0.4 + np.cumsum(rng.uniform(0.15, 0.4, 5))

    def opening(t):
        return sum(np.exp(-0.5 * ((t - s) / 0.05) ** 2) for s in starts)

    frames, samples = (np.arange(round(seconds * 25)) + 0.5) / 25, np.arange(round(seconds * SPEECH_RATE)) / SPEECH_RATE
    points = np.tile(STILL, (len(frames), 1, 1))
    points[:, 3, 1] += 6 * opening(frames)
    points += rng.normal(0, 0.1, points.shape) + rng.normal(0, 2, (1, 1, 2))
    sound = 0.2 * opening(samples - late) * rng.normal(0, 1, len(samples)) + rng.normal(0, 1e-3, len(samples))
    return points.astype(np.float32), np.clip(sound, -1, 1).astype(np.float32)


def test_late_sound_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr(heard_lips, "_STEPS", 60)
    rng = np.random.default_rng(0)
    late = dict(zip([f"c{k:02}" for k in range(64)], rng.normal(0, 0.03, 64).round(3), strict=True))
    seen, sounds = {}, {}
    for name, seconds in late.items():
        points, sound = clip(seconds, rng)
        seen[name] = points, np.ones(len(points), bool)
        write_wav(tmp_path / f"{name}.wav", sound, SPEECH_RATE)
        sounds[name] = f"{name}.wav"
    shop = Workshop(tmp_path, jobs=1)
    found = find_sync(shop, sounds, seen, GROUPS, 25.0)
    truth = np.array([late[n] for n in late])
    measured = np.array([found.late[n] for n in late])
    assert (measured - truth).std() < 0.012 and np.corrcoef(measured, truth)[0, 1] > 0.92
    assert abs(found.spread - truth.std()) < 0.01 and not found.unknown
    monkeypatch.setattr(sync, "crossfitted", None)  # a second run does not hear the lips again
    assert find_sync(shop, sounds, seen, GROUPS, 25.0) == found
    seen["c00"][0][-1] += 1  # its last frame
    with pytest.raises(TypeError, match="not callable"):
        find_sync(shop, sounds, seen, GROUPS, 25.0)


def test_late_sound_of_a_few_clips_is_found_and_what_is_in_step_stays(tmp_path):
    rng = np.random.default_rng(0)
    shop, late = Workshop(tmp_path, jobs=1), rng.normal(0, 0.03, 12).round(3)
    for apart in (late, np.zeros(12)):
        seen, sounds = {}, {}
        for k, seconds in enumerate(apart):
            points, sound = clip(seconds, rng)
            seen[f"c{k:02}"] = points, np.ones(len(points), bool)
            sounds[f"c{k:02}"] = f"c{k:02}.wav"
            write_wav(tmp_path / f"c{k:02}.wav", sound, SPEECH_RATE)
        found = find_sync(shop, sounds, seen, GROUPS, 25.0)
        measured = np.array([found.late[n] for n in sorted(seen)])
        if apart.any():
            assert (measured - apart).std() < 0.012 and np.corrcoef(measured, apart)[0, 1] > 0.85
        else:
            assert found.spread < 0.006 and np.abs(measured).max() < 0.012


def test_groups_without_lips_are_an_error(tmp_path):
    points = np.zeros((10, 8, 2), np.float32)
    seen = {"a": (points, np.ones(10, bool))}
    with pytest.raises(DnnvssError, match="named after lip or mouth"):
        write_wav(tmp_path / "a.wav", np.zeros(6400, np.float32), SPEECH_RATE)
        find_sync(Workshop(tmp_path, jobs=1), {"a": "a.wav"}, seen, {"all": (0, 8)}, 25.0)


def test_estimates_are_shrunk_by_what_the_halves_disagree():
    whole, names = np.array([-0.04, -0.02, 0.0, 0.02, 0.04]), "abcde"
    apart = np.array([-0.02, 0.02, 0.0, 0.02, -0.02])  # the whole clip errs by half its median deviation
    few = shrunk(names, whole, whole + apart / 2, whole - apart / 2)
    error, spread = 0.02 * np.sqrt(0.8) / 2, np.sqrt(0.0008 - 0.00008)
    assert (few.error, few.spread) == pytest.approx((error, spread), abs=1e-5)
    assert few.late["e"] == pytest.approx(0.9 * 0.04, abs=1e-4)
    weak = shrunk(names, whole, whole + 1.3 * apart, whole - 1.3 * apart)
    assert weak.error > weak.spread > 0 and set(weak.late.values()) == {0.0}
    names, whole, apart = [f"{n}{k}" for k in range(12) for n in names], np.tile(whole, 12), np.tile(apart, 12)
    agreed = shrunk(names, whole, whole, whole)
    assert agreed.error == 0 and agreed.late["a0"] == -0.04 and agreed.late["d3"] == 0.02
    assert agreed.spread == pytest.approx(1.4826 * 0.02, abs=1e-5)
    half = shrunk(names, whole, whole + apart / 2, whole - apart / 2)
    assert half.error == pytest.approx(1.4826 * 0.01, abs=1e-5)
    assert half.late["e1"] == pytest.approx(0.75 * 0.04, abs=1e-4)  # 1 - (1/2)^2


def test_a_clip_whose_halves_contradict_stays():
    whole, other = np.array([0.01, -0.01, 0.03]), np.array([0.01, -0.01, -0.09])
    found = shrunk("abc", whole, whole, other)
    assert found.unknown == ("c",) and found.late["c"] == 0.0
    assert isinstance(found, Sync)


def test_sound_is_moved_and_keeps_its_length(tmp_path):
    sound = np.zeros(SPEECH_RATE, np.float32)
    sound[8000] = 0.5
    write_wav(tmp_path / "raw.wav", sound, SPEECH_RATE)
    for late, at in ((0.05, 7200), (-0.05, 8800), (0.0, 8000)):
        moved = read_audio(tmp_path / in_step("a", tmp_path, tmp_path / "raw.wav", late)["audio"], SPEECH_RATE)
        assert len(moved) == SPEECH_RATE and int(np.argmax(moved)) == at


def test_given_times_move_with_the_sound(tmp_path):
    tiers = [Tier("phones", [(0, 0.1, "sil"), (0.1, 0.4, "AY"), (0.4, 1, "sil")]),
             Tier("words", [(0, 0.1, ""), (0.1, 0.4, "i"), (0.4, 1, "")])]
    write_alignment(tmp_path / "a.TextGrid", Alignment(tiers))
    for late, edges in ((0.04, [0, 0.06, 0.36, 1]), (-0.04, [0, 0.14, 0.44, 1]), (0.2, [0, 0.2, 1])):
        found = given("a", tmp_path, tmp_path / "a.TextGrid", [("i", [("AY",)])], 25, "25", late)
        assert Alignment.from_json(found["alignment"])["phones"].edges == pytest.approx(edges)


def test_steps_of_adam_are_those_of_its_authors(monkeypatch):
    """Two steps by hand: rate 3e-3 and, half way down a cosine of two steps, 1.5e-3; a hundredth of it decays."""
    monkeypatch.setattr(heard_lips, "_STEPS", 2)
    weights, mean, square = (np.array([[x]], np.float32) for x in (2.0, 0.0, 0.0))
    heard_lips._moved(weights, np.array([[0.5]], np.float32), mean, square, 0)
    first = 2 * (1 - 3e-5) - 3e-3  # the mean slope over its root mean square is 1
    assert weights[0, 0] == pytest.approx(first, rel=1e-6)
    heard_lips._moved(weights, np.array([[-0.1]], np.float32), mean, square, 1)
    slope = (0.9 * 0.1 * 0.5 - 0.1 * 0.1) / (1 - 0.9**2)
    size = np.sqrt((0.999 * 0.001 * 0.25 + 0.001 * 0.01) / (1 - 0.999**2))
    assert weights[0, 0] == pytest.approx(first * (1 - 1.5e-5) - 1.5e-3 * slope / size, rel=1e-6)


def test_slopes_of_a_layer_are_those_of_its_error():
    rng = np.random.default_rng(0)
    x, weights, wanted = rng.normal(size=(7, 3)), rng.normal(size=(4, 2)), rng.normal(size=(7, 2))

    def error(w):
        return ((heard_lips._layer(x, w) - wanted) ** 2).sum()

    found = heard_lips._slope(x, 2 * (heard_lips._layer(x, weights) - wanted))
    for place in np.ndindex(weights.shape):
        step = np.zeros_like(weights)
        step[place] = 1e-5
        assert found[place] == pytest.approx((error(weights + step) - error(weights - step)) / 2e-5, rel=1e-6)


def test_a_tenth_of_what_goes_in_is_dropped_and_made_up_for():
    kept = heard_lips._kept(np.random.default_rng(0), (400, 300))
    assert set(np.unique(kept)) == {0.0, np.float32(256 / 230)}
    assert (kept == 0).mean() == pytest.approx(0.1, abs=0.005) and kept.mean() == pytest.approx(1, abs=0.005)
