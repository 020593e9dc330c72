"""Blinks: what counts as one, how long it lasts, and how often they come."""

import numpy as np
import pytest

from dnnvss.life import CONTEXTS, Blink, BlinkRates, blink_threshold, find_blinks, shut_share, speech_contexts
from dnnvss.timing import Alignment, FrameClock, Tier

RATE = 25.0


def test_a_blink_lasts_from_half_way_down_to_half_way_up() -> None:
    opening = np.array([1, 1, 0.6, 0.2, 0.2, 0.6, 1, 1])
    found = find_blinks(opening, 0.5, RATE)
    assert [(b.first, b.last) for b in found] == [(3, 4)] and found[0].seconds == pytest.approx(2.5 / 25)


def test_eyes_shut_at_an_end_of_a_clip_or_for_long_do_not_blink() -> None:
    shut = np.zeros(5)
    assert find_blinks(np.concatenate([shut, np.ones(9)]), 0.5, RATE) == []
    assert find_blinks(np.concatenate([np.ones(9), shut]), 0.5, RATE) == []
    assert find_blinks(np.concatenate([np.ones(2), np.zeros(30), np.ones(2)]), 0.5, RATE) == []


def test_the_threshold_is_half_way_to_shut_and_none_where_eyes_never_shut() -> None:
    opening = np.concatenate([np.ones(190), np.full(10, 0.2)])
    assert blink_threshold(opening) == pytest.approx(0.6)
    assert blink_threshold(np.linspace(0.8, 1.1, 200)) is None
    assert blink_threshold(np.full(3, np.nan)) is None


def test_lids_count_as_shut_well_before_they_are() -> None:
    assert shut_share(np.array([1.1, 0.96, 0.88, 0.8, 0.1]), 0.6) == pytest.approx([0, 0, 0.5, 1, 1])
    assert (shut_share(np.array([0.1]), None) == 0).all()


def _told(context: np.ndarray, rates: BlinkRates, seed: int) -> tuple[np.ndarray, list[Blink]]:
    drawn = rates.draw(context, RATE, np.random.default_rng(seed))
    return context, [Blink(int(frame), int(frame), 0.04) for frame in drawn]


def test_rates_are_found_again_in_what_they_draw() -> None:
    context = np.repeat(np.arange(len(CONTEXTS)), 50)
    true = BlinkRates(np.array([0.3, 0.6, 1.0, 1.2, 2.0]), np.ones(4))
    found = BlinkRates.fit([_told(context, true, seed) for seed in range(150)], RATE)
    drawn, told = (np.mean([len(rates.draw(context, RATE, np.random.default_rng(first + s))) for s in range(150)])
                   for rates, first in ((found, 9000), (true, 5000)))
    assert drawn == pytest.approx(told, rel=0.1)
    assert found.context * np.average(found.since) == pytest.approx(true.context, rel=0.2)


def test_no_share_of_the_rate_gives_no_blink() -> None:
    rates = BlinkRates(np.full(len(CONTEXTS), 5.0), np.ones(4))
    assert len(rates.draw(np.zeros(500, int), RATE, np.random.default_rng(1), 0.0)) == 0


def test_no_blink_begins_while_the_lids_of_the_last_move() -> None:
    rates = BlinkRates(np.full(len(CONTEXTS), 50.0), np.ones(4))
    drawn = rates.draw(np.zeros(500, int), RATE, np.random.default_rng(1))
    assert np.diff(drawn).min() == 5


def test_contexts_follow_silence_stress_and_the_end_of_the_phrase() -> None:
    phones = Tier("phones", [(0, 0.4, "sil"), (0.4, 0.8, "B"), (0.8, 1.2, "IH"), (1.2, 1.6, "N"), (1.6, 2.4, "sil")])
    words = Tier("words", [(0, 0.4, ""), (0.4, 1.6, "bin"), (1.6, 2.4, "")])
    found = speech_contexts(Alignment([phones, words]), "bin", FrameClock(10), 24)
    names = [CONTEXTS[code] for code in found]
    assert names == [*["silence"] * 4, *["stressed"] * 9, *["phrase end"] * 3, *["after a phrase"] * 3,
                     *["silence"] * 5]


def test_a_voice_alone_is_speech_throughout() -> None:
    words = Alignment([Tier("words", [(0, 1, "")])])
    assert {CONTEXTS[code] for code in speech_contexts(words, "", FrameClock(25), 25)} == {"unstressed"}
