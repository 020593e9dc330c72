"""The talker's own voice decides where the aligner for everybody refuses, and refuses what was not said itself."""

import numpy as np
import pytest

from data_prep.adapt import hear, heard_at_last, own_voice
from data_prep.align import heard, sharp
from dnnvss.errors import DnnvssError
from dnnvss.media.reading import write_wav
from dnnvss.phones import SILENCE, VOWELS
from dnnvss.speech.align import UnfitError
from dnnvss.speech.align_features import cepstra
from dnnvss.speech.formant import synthesise
from dnnvss.text.lexicon import pronunciations
from dnnvss.timing import Alignment, Tier

RATE = 16000
TEXTS = ("we saw the old boat move away", "the old boat was never seen again", "move the boat away now",
         "we never saw an old man move", "an old man was seen in the boat", "now we saw the man again")
SAID = "the old man saw the boat again"


def ways(text):
    return [(word, pronunciations(word)) for word in text.split()]


def spoken(text, seed):
    """Sound, and the alignment that it was made from: phones of somewhat irregular length."""
    rng, rows, t = np.random.default_rng(seed), [(0.0, 0.2, "sil")], 0.2
    for _, (first, *_) in ways(text):
        for phone in first:
            rows.append((t, t := t + (0.13 if phone in VOWELS else 0.09) * rng.uniform(0.8, 1.2), phone))
    truth = Alignment([Tier("phones", [*rows, (t, t + 0.2, "sil")])])
    return synthesise(truth, RATE).astype(np.float32), truth


@pytest.fixture(scope="module")
def voice():
    pairs = [spoken(text, k) for k, text in enumerate(TEXTS)]
    phones = (*sorted({p for text in TEXTS for _, all_ways in ways(text) for way in all_ways for p in way}), SILENCE)
    return own_voice(phones, [cepstra(s) for s, _ in pairs], [a for _, a in pairs],
                     [{"words": ways(text), "bounds": []} for text in TEXTS])


def test_what_was_said_is_trusted_and_lies_near_the_truth(voice):
    sound, truth = spoken(SAID, 9)
    found = hear(voice, sound, ways(SAID))
    assert found.trusted
    edges = found.tiers(SAID.split(), len(sound) / RATE)["phones"].edges
    assert np.abs(edges - truth["phones"].edges).mean() < 0.015


@pytest.mark.parametrize("text", [TEXTS[0], "the old man saw", "the old man the boat again", "never again"])
def test_other_words_and_words_left_out_are_not(voice, text):
    assert not hear(voice, spoken(SAID, 9)[0], ways(text)).trusted


def test_half_of_the_sound_noise_and_silence_are_not(voice):
    sound, _ = spoken(SAID, 9)
    noise = np.random.default_rng(0).normal(0, np.sqrt((sound**2).mean()), len(sound))
    for spoilt in (sound[: len(sound) // 2], sound + noise, 0 * sound):
        assert not hear(voice, spoilt.astype(np.float32), ways(SAID)).trusted


def test_a_refused_utterance_gets_a_second_chance(voice, tmp_path, monkeypatch):
    sound, _ = spoken(SAID, 9)
    task = {"audio": write_wav(tmp_path / "a.wav", sound, RATE), "words": ways(SAID), "bounds": [],
            "frames": round(len(sound) / RATE * 25), "rate": "25"}

    def refuse(*_, **__):
        raise UnfitError("the text does not fit the sound", remedy="Give the words")

    monkeypatch.setattr("data_prep.align.align", refuse)
    first = heard("u", tmp_path, slack=0.25, **task)
    assert first == {"dropped": "utterance u: the text does not fit the sound. Give the words.",
                     "unfit": "the text does not fit the sound"}
    voice.write(tmp_path / "voice.npz")
    result = heard_at_last("u", tmp_path, first["unfit"], "voice.npz", **task)
    assert result["attempt"] == "the talker's own voice" and len(result["fit"]) == 7
    with pytest.raises(DnnvssError, match="does not fit the sound; by the talker's own voice neither"):
        heard_at_last("u", tmp_path, first["unfit"], "voice.npz", **task | {"words": ways(TEXTS[1])})
    with pytest.raises(DnnvssError, match="its word 'joy' has phones of its own"):
        heard_at_last("u", tmp_path, first["unfit"], "voice.npz", **task | {"words": ways("the old joy")})


def test_edges_of_a_small_corpus_are_sharpened(tmp_path):
    sound, truth = spoken(SAID, 9)
    path = write_wav(tmp_path / "a.wav", sound, RATE)
    first = heard("u", tmp_path, path, ways(SAID), [], 0.25, round(len(sound) / RATE * 100), "100")
    moved = sharp("u", tmp_path, path, first, [], {})
    assert {k: v for k, v in moved.items() if k != "alignment"} == {k: v for k, v in first.items() if k != "alignment"}

    def apart(result):
        edges = Alignment.from_json(result["alignment"])["phones"].edges
        return np.abs(edges[1:-1] - truth["phones"].edges[1:-1]).mean()

    assert apart(moved) < apart(first)
