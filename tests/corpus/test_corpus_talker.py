"""The built-in talker's sentences, times, movement and gestures."""

import re
from itertools import pairwise

import numpy as np
import pytest

from dnnvss.corpus.talker import RATE, SHAPES, TARGETS, Articulators, Take, landmark_track, perform_take, script
from dnnvss.corpus.talker import unseen_splits as split_unseen
from dnnvss.corpus.talker.geometry import LANDMARK_GROUPS
from dnnvss.corpus.talker.grammar import RULES, compose, spoken_words
from dnnvss.corpus.talker.motion import Motion
from dnnvss.corpus.talker.targets import LIPS
from dnnvss.corpus.talker.vocabulary import spoken_forms, word_classes
from dnnvss.phones import PHONES, SILENCES, SPOKEN, strip_stress
from dnnvss.text.lexicon import pronunciations
from dnnvss.timing import FrameClock


@pytest.fixture(scope="module")
def takes() -> list[Take]:
    return [perform_take(name, text) for name, text in script(30).items()]


def words_of(text: str) -> list[str]:
    return [word for phrase in spoken_words(text) for word in phrase]


def phones_of(texts: list[str]) -> set[str]:
    return {strip_stress(phone) for text in texts for word in words_of(text) for phone in spoken_forms()[word]}


def inner_gap(rows: np.ndarray) -> np.ndarray:
    """Return the distance in pixels of the middle landmarks of the inner lips."""
    start, end = LANDMARK_GROUPS["lips_inner"]
    lips = landmark_track(rows)[:, start:end]
    return np.linalg.norm(lips[:, 4] - lips[:, 12], axis=1)


def test_sentences_are_many_different_and_cover_every_phone():
    texts = compose(160)
    assert len(set(texts)) == 160
    assert len({word for text in texts for word in words_of(text)}) > 330
    assert phones_of(texts[:6]) == set(SPOKEN)
    assert all(re.fullmatch(r"[A-Z][A-Za-z, ]+[.?]", text) for text in texts)
    assert compose(20, seed=1) == compose(20, seed=1) != compose(20, seed=2)


def test_every_slot_of_the_grammar_is_a_rule_or_a_class_of_words():
    slots = {slot for options in RULES.values() for option in options for slot in re.findall(r"\{(\w+)\}", option)}
    assert slots <= set(RULES) | set(word_classes())
    plain = {word for options in RULES.values() for option in options
             for word in re.findall(r"[a-z]+", re.sub(r"\{\w+\}", "", option))}  # fmt: skip
    assert plain <= set(spoken_forms())


def test_an_before_vowels():
    for text in compose(160):
        for article, noun in pairwise(words_of(text)):
            if article in ("a", "an"):
                vowel = strip_stress(spoken_forms()[noun][0])[0] in "AEIOU"
                assert (article == "an") == vowel, text


def test_pronunciations_are_the_lexicons():
    for word, form in spoken_forms().items():
        listed = [tuple(map(strip_stress, p)) for p in pronunciations(word, "en_us")]
        assert tuple(map(strip_stress, form)) in listed, word
        assert sum(phone.endswith("1") for phone in form) <= 1


def test_words_of_the_unseen_test_are_nowhere_else():
    texts = script(160)
    splits = split_unseen(texts)
    named = [name for ids in splits.values() for name in ids]
    assert sorted(named) == sorted(texts)
    said = {name: {word for i in ids for word in words_of(texts[i])} for name, ids in splits.items()}
    new = said["unseen_test"] - said["unseen_train"] - said["unseen_val"]
    assert len(new) >= 5
    assert all(new & set(words_of(texts[i])) for i in splits["unseen_test"])
    assert 12 <= len(splits["unseen_test"]) <= 20
    assert phones_of([texts[i] for i in splits["unseen_train"]]) == set(SPOKEN)


def test_tiers_are_whole_and_agree(takes: list[Take]):
    for take in takes:
        phones, words, gestures = (take.alignment[name] for name in ("phones", "words", "gestures"))
        assert phones.start == words.start == gestures.start == 0
        assert phones.end == pytest.approx(gestures.end) == pytest.approx(take.frames / RATE)
        assert [w.label for w in words if w.label] == words_of(take.text)
        assert set(words.edges) <= set(phones.edges)
        assert phones.labels[0] == phones.labels[-1] == "sil"
        assert set(phones.labels) <= set(PHONES)
        for word in words:
            inside = tuple(p.label for p in phones if word.start <= p.start < word.end)
            if word.label:
                assert inside == tuple(map(strip_stress, spoken_forms()[word.label]))
            else:
                assert inside in {("sil",), ("sp",)}


def test_lengths_are_those_of_speech(takes: list[Take]):
    spoken = [p.duration for t in takes for p in t.alignment["phones"] if p.label not in SILENCES]
    assert 0.07 < np.median(spoken) < 0.095
    assert min(spoken) >= 0.035
    assert 2.0 < np.mean([t.alignment.end for t in takes]) < 3.5


def test_a_take_follows_from_its_seed():
    one, two = perform_take("demo_003", "We found a boat."), perform_take("demo_003", "We found a boat.")
    assert one.alignment == two.alignment
    assert one.landmarks().tobytes() == two.landmarks().tobytes()
    other = perform_take("demo_004", "We found a boat.")
    assert other.alignment != one.alignment


def test_lips_meet_in_every_bilabial_and_tuck_in_every_f_and_v(takes: list[Take]):
    clock = FrameClock(RATE)
    for take in takes:
        for p in take.alignment["phones"]:
            rows = take.motion.at(np.linspace(p.start, p.end, 15))
            if p.label in ("P", "B", "M"):
                assert inner_gap(rows).min() < 1e-6
                frames = np.arange(max(clock.edge(p.start) - 1, 0), clock.edge(p.end) + 1)
                assert inner_gap(take.articulators[frames]).min() < 1.0  # pixels, at the frame of the closure
            if p.label in ("F", "V"):
                assert rows[:, LIPS.index("tuck")].max() > 0.5
                assert inner_gap(rows).min() < 8


def test_the_mouth_rests_in_silence(takes: list[Take]):
    for take in takes:
        assert inner_gap(take.articulators[:2]).max() < 1
        assert inner_gap(take.articulators[-2:]).max() < 1


def test_shapes_read_as_they_should():
    def at_target(phone: str) -> Articulators:
        return Articulators(*TARGETS[phone].lips, *TARGETS[phone].tongue)

    def extent(phone: str) -> np.ndarray:
        start, end = LANDMARK_GROUPS["lips_outer"]
        return np.ptp(landmark_track(np.array([at_target(phone)]))[0, start:end], axis=0)

    wide = {phone: extent(phone)[0] for phone in ("IY", "AA", "SH", "W")}
    assert sorted(wide, key=lambda phone: -wide[phone]) == ["IY", "AA", "SH", "W"]
    phones = ["AA", "EH", "IH", "UW", "W", "P"]
    gaps = dict(zip(phones, inner_gap(np.array([at_target(p) for p in phones])), strict=True))
    assert list(gaps) == sorted(gaps, key=lambda phone: -gaps[phone])
    assert gaps["AA"] > 20


def test_gestures_are_bounded_by_stillness(takes: list[Take]):
    """At every boundary the lips stand still but for tremor, and inside a movement speed has one peak."""
    for take in takes[:20]:
        calm = Motion(**{**vars(take.motion), "tremor": take.motion.tremor * 0})
        gestures = take.alignment["gestures"]
        for gesture in gestures:
            lips = calm.at(np.linspace(gesture.start, gesture.end, 41))[:, : len(LIPS)]
            speed = np.linalg.norm(np.diff(lips, axis=0), axis=1)
            if gesture.label == "rest":
                assert inner_gap(calm.at(np.linspace(gesture.start, gesture.end, 9))).max() < 1
            else:
                assert speed[[0, -1]].max() < 0.1 * speed.max()
                rising = np.diff(speed[speed > 0.05 * speed.max()]) > 0
                assert np.count_nonzero(rising[:-1] & ~rising[1:]) == 1


def test_gestures_lead_from_shape_to_shape(takes: list[Take]):
    for take in takes:
        labels = take.alignment["gestures"].labels
        assert labels[0] == labels[-1] == "rest"
        moves = [label.split(">") for label in labels if label != "rest"]
        assert {shape for move in moves for shape in move} <= set(SHAPES)
        assert all(a != b for a, b in moves)
        for one, two in pairwise(labels):
            if "rest" not in (one, two):
                assert one.split(">")[1] == two.split(">")[0]
    lengths = np.diff(np.concatenate([t.alignment["gestures"].edges for t in takes[:1]]))
    assert lengths.min() > 0.05


def test_speed_minima_of_the_landmarks_find_the_gestures(takes: list[Take]):
    """An independent cut, local minima of landmark speed at 100 a second, meets 9 of 10 boundaries within 2 frames."""
    start, end = LANDMARK_GROUPS["lips_outer"]
    met = found = true = 0
    for take in takes[:15]:
        times = np.arange(0, take.alignment.end, 0.01)
        rows = take.motion.at(times)
        rows[:, 8:] = 0  # the head held still
        speed = np.linalg.norm(np.diff(landmark_track(rows)[:, start:end], axis=0), axis=(1, 2)) * 100
        minima = times[1:-2][(speed[1:-1] <= speed[:-2]) & (speed[1:-1] < speed[2:])] + 0.005
        edges = take.alignment["gestures"].edges[1:-1]
        met += sum(np.abs(minima - edge).min() <= 2 / RATE for edge in edges)
        true += len(edges)
        found += len(minima)
    assert met / true > 0.95
    assert found < 1.5 * true
