"""A voice learnt from a rough segmentation finds the true one in made-up features, and its search is the best path."""

from itertools import product

import numpy as np
import pytest

from dnnvss.speech.align_adapt import HOP, STATES, Voice, best_paths, chain, first_states, learn, segment
from dnnvss.speech.align_features import cepstra

PHONES = ("AA", "B", "IY", "S", "sil")
WIDTH = 39


def clip(rng, words, means):
    """Features of a sentence, and where its pieces truly are; each third of a phone has a mean of its own."""
    pieces, frames, t = [], [], 0
    for phone, word in [("sil", -1), *[(p, k) for k, w in enumerate(words) for p in w], ("sil", -1)]:
        length = int(rng.integers(12, 40))
        pieces.append((phone, word, t * HOP, (t + length) * HOP))
        third = np.arange(length) * STATES // length
        frames.append(means[PHONES.index(phone), third] + rng.normal(0, 1, (length, WIDTH)))
        t += length
    return np.concatenate(frames).astype(np.float32), pieces


def jittered(pieces, rng):
    edges = np.array([p[2] for p in pieces] + [pieces[-1][3]])
    edges[1:-1] += rng.uniform(-0.03, 0.03, len(edges) - 2)
    return [(p, w, a, b) for (p, w, _, _), a, b in zip(pieces, edges[:-1], edges[1:], strict=True)]


@pytest.fixture(scope="module")
def corpus():
    rng = np.random.default_rng(0)
    means = rng.normal(0, 1.2, (len(PHONES), STATES, WIDTH))
    sentences = [[tuple(rng.choice(PHONES[:4], rng.integers(1, 4))) for _ in range(4)] for _ in range(30)]
    sentences = [[tuple(map(str, w)) for w in s] for s in sentences]
    return [(s, *clip(rng, s, means)) for s in sentences], rng


def test_rounds_of_learning_bring_the_edges_to_the_truth(corpus):
    clips, rng = corpus
    features = [f for _, f, _ in clips]
    rough = [jittered(p, rng) for *_, p in clips]
    states = [first_states(p, len(f), PHONES) for p, f in zip(rough, features, strict=True)]
    for _ in range(3):
        voice = learn(features, states, PHONES, 1)
        found = segment(voice, features, [[[w] for w in s] for s, *_ in clips], [None] * len(clips))
        states = [s for _, s, _ in found]
    errors = [abs(a[2] - b[2]) for (pieces, _, _), (*_, true) in zip(found, clips, strict=True)
              for a, b in zip([p for p in pieces if p[0] != "sp"], true, strict=True)]
    before = [abs(a[2] - b[2]) for r, (*_, true) in zip(rough, clips, strict=True)
              for a, b in zip(r, true, strict=True)]
    assert np.mean(before) > 0.012
    assert np.mean(errors) < 0.002
    assert all((fit <= 1e-3).all() for *_, fit in found)


def tiny_voice():
    return Voice(("AA", "sil"), np.zeros((6, 1, WIDTH)), np.ones((6, 1, WIDTH)), np.zeros((6, 1)),
                 np.log(np.full(6, 0.7, np.float32)), np.log(np.full(6, 0.3, np.float32)), np.full(2, np.inf))


def test_the_path_is_the_best_of_all(corpus):
    rng = np.random.default_rng(1)
    voice, line = tiny_voice(), chain([("AA",), ("AA",)], ("AA", "sil"))
    count = 14
    seen = rng.normal(0, 3, (count, 6)).astype(np.float32)
    [(path, score)] = best_paths(voice, [seen], [line])
    last = len(line.states) - 1

    def value(way):
        total, before = seen[0, line.states[way[0]]], way[0]
        for t, place in enumerate(way[1:], start=1):
            if place == before:
                total += voice.stay[line.states[place]]
            elif place == before + 1 or line.jump[place] == before:
                total += voice.go[line.states[before]]
            else:
                return -np.inf
            total, before = total + seen[t, line.states[place]], place
        return total

    assert (path[0], path[-1]) == (0, last)
    assert value(path) == pytest.approx(score, rel=1e-5)
    ways = []
    for moves in product((0, 1), repeat=count - 1):  # all paths that jump over the pause
        way, place = [0], 0
        for move in moves:
            place = place + move if not (move and place == 5) else 9
            way.append(place)
        if way[-1] == last:
            ways.append(way)
    assert score >= max(value(way) for way in ways) - 1e-3


def test_clips_of_different_length_do_not_disturb_each_other(corpus):
    clips, _ = corpus
    features = [f for _, f, _ in clips[:5]]
    voice = learn(features, [first_states(p, len(f), PHONES) for _, f, p in clips[:5]], PHONES, 2)
    together = segment(voice, features, [[[w] for w in s] for s, *_ in clips[:5]], [None] * 5)
    for k in range(5):
        alone = segment(voice, features[k : k + 1], [[[w] for w in clips[k][0]]], [None])
        assert alone[0][0] == together[k][0]


def test_words_stay_inside_their_bounds(corpus):
    clips, _ = corpus
    sentence, features, pieces = clips[0]
    voice = learn([features], [first_states(pieces, len(features), PHONES)], PHONES, 1)
    third = len(features) * HOP / 4
    bounds = [(k * third, (k + 1) * third) for k in range(4)]
    [(found, _, _)] = segment(voice, [features], [[[w] for w in sentence]], [bounds], slack=0.02)
    for phone, word, start, end in found:
        if word >= 0:
            assert start >= bounds[word][0] - 0.02 - 2 * HOP, phone
            assert end <= bounds[word][1] + 0.02 + 2 * HOP, phone


def test_a_voice_survives_its_file(tmp_path, corpus):
    clips, _ = corpus
    voice = learn([f for _, f, _ in clips], [first_states(p, len(f), PHONES) for _, f, p in clips], PHONES)
    back = Voice.read(voice.write(tmp_path / "voice.npz"))
    assert back.phones == PHONES
    np.testing.assert_array_equal(back.emissions(clips[0][1]), voice.emissions(clips[0][1]))


def test_emissions_of_one_gaussian_are_its_log_density():
    frames = np.random.default_rng(0).normal(2.0, 3.0, (4000, WIDTH)).astype(np.float32)
    voice = learn([frames], [np.zeros(4000, int)], ("AA", "sil"), 1)
    density = -0.5 * (((frames - 2) / 3) ** 2 + np.log(2 * np.pi * 9)).sum(axis=1)
    assert np.abs(voice.emissions(frames)[:, 0] - density).mean() < 0.8


def test_cepstra_have_a_frame_every_five_milliseconds_and_no_mean():
    sound = np.random.default_rng(0).normal(0, 0.1, 16000).astype(np.float32)
    features = cepstra(sound)
    assert features.shape == (200, 39)
    assert np.abs(features.mean(axis=0)).max() < 1e-5
    click = np.zeros(16000, np.float32)
    click[8000] = 1.0
    level = cepstra(click)[:, 0]
    loud = np.flatnonzero(level > (level.max() + level.min()) / 2)
    assert loud.mean() == pytest.approx(99.5)  # 0.5 s is half way between the centres of frames 99 and 100
