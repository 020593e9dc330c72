"""Behind a silence no phone lasts longer than it does between others: silence that it swallowed is given back."""

import numpy as np
import pytest

from dnnvss.speech.align_adapt import HOP, STATES, Voice, segment
from dnnvss.speech.align_onset import CLOSED, FREE, given_back, limit_of, longest
from dnnvss.timing import Alignment, Tier

WIDTH = 39


def test_limits_come_from_phones_between_others():
    """P lasts 0.1 s between others and 0.4 s behind silence; what lies next to silence tells nothing."""
    clip = [("sil", 0.0, 0.1), ("P", 0.1, 0.5), ("L", 0.5, 0.6), ("P", 0.6, 0.7), ("L", 0.7, 0.9), ("sil", 0.9, 1.0)]
    assert longest([clip] * 10) == pytest.approx({"L": FREE * 0.1, "P": FREE * 0.1})
    assert longest([clip] * 9) == {}


def test_where_nothing_tells_only_stops_are_held():
    assert limit_of("P", {}) == CLOSED
    assert limit_of("L", {}) == np.inf
    assert limit_of("P", {"P": 0.11}) == 0.11


def test_silence_is_given_back_to_silence():
    phones = Tier("phones", [(0.0, 0.3, "sil"), (0.3, 0.7, "P"), (0.7, 0.8, "IY"), (0.8, 1.0, "sp"), (1.0, 1.1, "B"),
                             (1.1, 1.6, "IY"), (1.6, 2.0, "sil")])
    words = Tier("words", [(0.0, 0.3, ""), (0.3, 0.8, "pea"), (0.8, 1.0, ""), (1.0, 1.6, "bee"), (1.6, 2.0, "")])
    found = given_back(Alignment([phones, words]), {"P": 0.15})
    assert found["phones"].edges == pytest.approx([0.0, 0.55, 0.7, 0.8, 1.0, 1.1, 1.6, 2.0])
    assert found["words"].edges == pytest.approx([0.0, 0.55, 0.8, 1.0, 1.6, 2.0])
    assert given_back(found, {"P": 0.15}) is found


def test_a_voice_gives_back_what_sounds_like_the_phone():
    """A click 0.4 s before the word fits the phone better than silence: the limit decides, and then the sound."""
    means = np.zeros((2 * STATES, 1, WIDTH))
    means[:STATES] += 1.0  # the phone; silence is 0
    known = np.array([0.2, np.inf])

    def voice(limits):
        return Voice(("AA", "sil"), means, np.ones_like(means), np.full((2 * STATES, 1), -20.0),
                     np.log(np.full(2 * STATES, 0.7, np.float32)), np.log(np.full(2 * STATES, 0.3, np.float32)), limits)

    sound = np.random.default_rng(0).normal(0, 0.1, (200, WIDTH)).astype(np.float32)
    sound[100:130] += 1.0
    sound[20:98] += 0.6  # nearer to the phone than to silence
    words = [[[("AA",)]]]
    [(free, _, _)] = segment(voice(np.full(2, np.inf)), [sound], words, [None])
    [(held, _, fits)] = segment(voice(known), [sound], words, [None])
    assert free[1][2] == pytest.approx(20 * HOP)
    assert held[1][3] == pytest.approx(130 * HOP)
    assert held[1][2] == pytest.approx(100 * HOP)
    assert len(fits) == 200
