"""The aligner finds known phone times in synthetic speech, and refuses text that was not said."""

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.phones import VOWELS
from dnnvss.speech.align import align, spoken_part
from dnnvss.speech.align_tiers import tiers
from dnnvss.speech.align_words import words_over
from dnnvss.speech.formant import synthesise
from dnnvss.text.lexicon import pronunciations
from dnnvss.timing import Alignment, Tier

RATE = 16000
TEXT = "we saw the old boat move away"


def ways(text):
    return [(word, pronunciations(word)) for word in text.split()]


def plan(text, lead=0.3, consonant=0.09, vowel=0.13):
    """The alignment of a text whose phones all have the same length by kind."""
    phones, words, t = [(0.0, lead, "sil")], [(0.0, lead, "")], lead
    for word, (first, *_) in ways(text):
        start = t
        for phone in first:
            phones.append((t, t := t + (vowel if phone in VOWELS else consonant), phone))
        words.append((start, t, word))
    return Alignment([Tier("phones", [*phones, (t, t + lead, "sil")]), Tier("words", [*words, (t, t + lead, "")])])


@pytest.fixture(scope="module")
def truth():
    return plan(TEXT)


@pytest.fixture(scope="module")
def speech(truth):
    return synthesise(truth, RATE).astype(np.float32)


def test_phone_starts_lie_near_the_truth(speech, truth):
    found = align(speech, ways(TEXT))
    assert found.alignment["phones"].labels == truth["phones"].labels
    assert found.alignment["words"].labels == truth["words"].labels
    assert found.alignment.start == 0
    assert found.alignment.end == pytest.approx(len(speech) / RATE)
    error = np.abs(found.alignment["phones"].edges - truth["phones"].edges)[1:-1]
    assert error.mean() < 0.02
    assert len(found.scores) == 7
    assert min(found.scores) > -30
    assert found.attempt == "spoken part"


def test_the_answer_does_not_depend_on_what_was_aligned_before(speech):
    first = align(speech, ways(TEXT))
    other = plan("seven green apples fell", lead=0.1)
    loud = synthesise(other, RATE) + np.random.default_rng(0).normal(0, 0.01, round(other.end * RATE))
    align(loud.astype(np.float32), ways("seven green apples fell"))
    with pytest.raises(DnnvssError):
        align(speech, ways("seven green apples fell"))
    assert align(speech, ways(TEXT)) == first


def test_the_sound_chooses_among_pronunciations(speech):
    words = ways(TEXT)
    words[4] = ("boat", [("K", "AE", "T", "S"), ("B", "OW", "T"), ("M", "IY")])
    labels = align(speech, words).alignment["phones"].labels
    assert ("B", "OW", "T") in [labels[k : k + 3] for k in range(len(labels))]


def test_given_word_times_lead_to_the_words_in_a_longer_recording(speech, truth):
    rng = np.random.default_rng(0)
    before = rng.normal(0, 1e-3, RATE).astype(np.float32)
    bounds = [(s.start + 1, s.end + 1) for s in truth["words"] if s.label]
    found = align(np.concatenate([before, speech]), ways(TEXT), bounds)
    error = found.alignment["phones"].edges[1:-1] - 1 - truth["phones"].edges[1:-1]
    assert np.abs(error).mean() < 0.02


@pytest.mark.parametrize(("text", "said"), [
    ("seven green apples", "fit the sound|not found"),
    ("the market opens very early on sunday", "fit the sound|not found"),
    (TEXT + " and then they all went home again", "fit the sound|not found"),
    ("we saw the", "leaves out|fit the sound|not found"),
])
def test_text_that_was_not_said_is_refused(speech, text, said):
    with pytest.raises(DnnvssError, match=said) as caught:
        align(speech, ways(text))
    assert caught.value.remedy


def test_noise_as_strong_as_the_speech_is_refused(speech):
    noise = np.random.default_rng(0).normal(0, np.sqrt((speech**2).mean()), len(speech))
    with pytest.raises(DnnvssError, match="the sound is noise, or speech that drowns in it"):
        align(speech + noise.astype(np.float32), ways(TEXT))


def test_what_is_lower_than_a_voice_is_no_noise(speech):
    """A drifting offset, rumble and the hum of mains, each louder than the voice, leave the words where they are."""
    time = np.arange(len(speech)) / RATE
    loud = 2 * np.abs(speech).std()
    starts = align(speech, ways(TEXT)).alignment["words"].edges
    for low in (4 * loud * (time / time[-1] - 0.5), loud * np.sin(2 * np.pi * 12 * time),
                loud * np.sin(2 * np.pi * 50 * time)):
        found = align(speech + low.astype(np.float32), ways(TEXT)).alignment["words"].edges
        assert np.abs(found - starts).max() < 0.05
    with pytest.raises(DnnvssError, match="the sound is noise"):
        align((loud * np.sin(2 * np.pi * 12 * time)).astype(np.float32), ways(TEXT))


@pytest.mark.parametrize(("sound", "said"), [
    (np.zeros(0, np.float32), "the sound lasts 0.00 s"),
    (np.zeros(3 * RATE, np.float32), "the sound is silence"),
    (np.full(3 * RATE, np.nan, np.float32), "the sound is silence"),
    (np.ones(RATE // 10, np.float32), "7 words need 0.54 s"),
])
def test_sound_without_speech_is_refused(sound, said):
    with pytest.raises(DnnvssError, match=said):
        align(sound, ways(TEXT))


def test_half_of_the_recording_is_refused(speech):
    with pytest.raises(DnnvssError, match=r"fit the sound|not found"):
        align(speech[: len(speech) // 2], ways(TEXT))


def test_no_words_are_refused(speech):
    with pytest.raises(DnnvssError, match="no word to align"):
        align(speech, [])


def test_spoken_part_of_a_tone_in_silence():
    sound = np.random.default_rng(0).normal(0, 1e-4, 2 * RATE).astype(np.float32)
    sound[RATE // 2 : RATE] += 0.3 * np.sin(np.arange(RATE // 2) * 0.3)
    assert spoken_part(sound) == pytest.approx((0.5, 1.0), abs=0.011)


def test_clicks_beside_speech_are_no_part_of_what_lasts() -> None:
    sound = np.random.default_rng(0).normal(0, 1e-3, 32_000).astype(np.float32)
    sound[8_000:16_000] += 0.3 * np.sin(np.arange(8_000) * 0.3, dtype=np.float32)
    sound[1_600:1_700] = sound[30_000:30_400] = 0.5
    assert spoken_part(sound) == pytest.approx((0.1, 1.9), abs=0.02)
    assert spoken_part(sound, lasting=5) == pytest.approx((0.5, 1.0), abs=0.02)
    assert spoken_part(sound[:160], lasting=5) == (0.0, 0.01)
    loud = np.ones(800, np.float32) * np.array([1, -1] * 400, np.float32)
    assert spoken_part(np.concatenate([loud, sound[17_000:29_000]]), lasting=5) == pytest.approx((0, 0.05), abs=0.02)


def test_short_gaps_are_shared_closures_go_to_the_stop_and_pauses_stay():
    pieces = [("AA", 0, 0.2, 0.3), ("M", 1, 0.34, 0.5), ("T", 2, 0.58, 0.7), ("N", 3, 0.8, 0.9)]
    found = tiers(pieces, ["a", "b", "c", "d"], 1.2)
    assert found["phones"].labels == ("sil", "AA", "M", "T", "sp", "N", "sil")
    assert found["phones"].edges == pytest.approx([0, 0.2, 0.32, 0.5, 0.7, 0.8, 0.9, 1.2])
    assert found["words"].labels == ("", "a", "b", "c", "", "d", "")


def test_speech_that_fills_the_recording_has_no_silence_at_its_ends():
    found = tiers([("AA", 0, 0.001, 0.3), ("T", 0, 0.3, 0.7)], ["at"], 0.7)
    assert found["phones"].labels == ("AA", "T")
    assert found["phones"].edges.tolist() == [0, 0.3, 0.7]


def test_words_are_found_over_phones_that_differ_a_little():
    phones = Tier("phones", [(0, 1, "sil"), (1, 2, "DH"), (2, 3, "IY"), (3, 4, "sp"), (4, 5, "K"), (5, 6, "AA"),
                             (6, 7, "sp"), (7, 8, "T"), (8, 9, "S"), (9, 10, "sil")])
    words = words_over(phones, [("the", [("DH", "AH")]), ("cats", [("K", "AE", "T", "S")])])
    assert [(s.start, s.end, s.label) for s in words] == [(0, 1, ""), (1, 3, "the"), (3, 4, ""), (4, 9, "cats"),
                                                          (9, 10, "")]
    with pytest.raises(DnnvssError, match="are not those of 'moon river'"):
        words_over(phones, [("moon", [("M", "UW", "N")]), ("river", [("R", "IH", "V", "ER")])])
    with pytest.raises(DnnvssError, match="no phone is left for the word 'a'"):
        words_over(phones, [("the", [("DH", "IY")]), ("cats", [("K", "AA", "T", "S")]), ("a", [("AH",)])])


@pytest.mark.parametrize("bounds", [(50.0, 51.0), (-9.0, -8.0), (2.0, 0.1)])
def test_given_times_that_are_not_of_this_sound_do_no_harm(speech, bounds):
    found = align(speech, ways(TEXT), [bounds] * len(TEXT.split()))
    assert found.alignment["words"].labels == align(speech, ways(TEXT)).alignment["words"].labels


@pytest.mark.parametrize("pronunciation", [[], [()]])
def test_a_word_without_phones_is_refused(speech, pronunciation):
    with pytest.raises(DnnvssError, match="the word 'hush' has no phones"):
        align(speech, [*ways(TEXT), ("hush", pronunciation)])
