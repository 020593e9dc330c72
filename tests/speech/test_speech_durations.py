"""Durations learnt from a corpus, and the time lines made of them."""

from pathlib import Path

import numpy as np
import pytest

from dnnvss.corpus import Utterance
from dnnvss.errors import DnnvssError
from dnnvss.phones import SILENCES, VOWELS
from dnnvss.speech.duration_contexts import context_matrix, spoken_contexts
from dnnvss.speech.durations import DurationModel
from dnnvss.speech.durations_scores import score_durations
from dnnvss.speech.pauses import SHORTEST, usual_pauses
from dnnvss.speech.time_line import stretched
from dnnvss.text.sentence import parse
from dnnvss.timing import Alignment, Tier

SENTENCES = ("set blue at nine now", "lay white by two soon", "put nine at bees again", "seven men met Anna",
             "no money for bad news", "we met a bee by noon", "let blue news win", "Ben may not sell many beads")


def spoken(text: str, seed: int) -> Utterance:
    """An utterance in which a vowel lasts 120 ms, a consonant 60, the last syllable 1.5 times, plus noise of 5 %."""
    rng, sentence = np.random.default_rng(seed), parse(text)
    segments, words, time = [(0.0, 0.2, "sil")], [(0.0, 0.2, "")], 0.2
    for number, word in enumerate(sentence.words):
        start = time
        bare = [p.rstrip("012") for p in word.phones]
        last = max(i for i, p in enumerate(bare) if p in VOWELS)
        for i, phone in enumerate(bare):
            seconds = (0.12 if phone in VOWELS else 0.06) * np.exp(0.05 * rng.standard_normal())
            seconds *= 1.5 if number == len(sentence.words) - 1 and i >= last else 1.0
            segments.append((time, time + seconds, phone))
            time += seconds
        words.append((start, time, word.spoken))
        if word.break_after != "none" and number < len(sentence.words) - 1:
            segments.append((time, time + 0.25, "sp"))
            words.append((time, time + 0.25, ""))
            time += 0.25
    segments.append((time, time + 0.3, "sil"))
    words.append((time, time + 0.3, ""))
    return Utterance(f"u{seed}", text, Alignment([Tier("phones", segments), Tier("words", words)]))


@pytest.fixture(scope="module")
def corpus() -> list[Utterance]:
    return [spoken(SENTENCES[seed % len(SENTENCES)], seed) for seed in range(48)]


@pytest.fixture(scope="module")
def model(corpus: list[Utterance]) -> DurationModel:
    return DurationModel.fit(corpus)


def test_recovers_the_rule_behind_the_corpus(model: DurationModel) -> None:
    alignment = model.predict(parse("set nine beads at noon"))
    lengths = {(s.label, i): s.duration for i, s in enumerate(alignment["phones"])}
    inner = [d for (label, i), d in lengths.items() if label in VOWELS and i < 14]
    assert np.allclose(inner, 0.12, rtol=0.16)
    assert lengths["UW", 14] == pytest.approx(0.18, rel=0.15) and lengths["N", 15] == pytest.approx(0.09, rel=0.15)
    mean, deviation = model.log_durations(alignment, "set nine beads at noon")
    assert 0.03 < deviation.mean() < 0.09 and len(mean) == 15


def test_beats_both_null_models(corpus: list[Utterance], model: DurationModel) -> None:
    test = [spoken("seven bees may win now", 100), spoken("lay blue beads by nine men", 101)]
    phone, position, ours = score_durations(model, corpus, test)
    assert ours.rmse < position.rmse < phone.rmse and ours.correlation > position.correlation > phone.correlation
    assert ours.rmse < 12


def test_rate_and_total_are_met_and_elastic_phones_give_way(model: DurationModel) -> None:
    sentence = parse("set blue beads, at nine now")
    normal = model.predict(sentence)
    fast = model.predict(sentence, rate=2.0)
    assert fast.end - 0.5 == pytest.approx((normal.end - 0.5) / 2)
    exact = model.predict(sentence, total=4.0, lead_in=0.0, lead_out=0.4)
    assert exact.end == pytest.approx(4.0) and exact["phones"][0].label == "S"
    mean, deviation = model.log_durations(normal, sentence.text)
    spoken = np.array([s.duration for s in fast["phones"] if s.label not in ("sil", "sp")])
    shift = (np.log(spoken) - mean - deviation**2 / 2) / deviation
    assert shift.max() < 0 and np.ptp(shift) < 1e-6


def test_pauses_come_from_punctuation_corpus_and_text(model: DurationModel) -> None:
    alignment = model.predict(parse("no money, for bad [pause 700ms] news"))
    pauses = [(s.label, round(s.duration, 3)) for s in alignment["phones"] if s.label in ("sil", "sp")]
    assert pauses == [("sil", 0.2), ("sp", 0.18), ("sp", 0.7), ("sil", 0.3)]
    assert alignment["words"].labels == ("", "no", "money", "", "for", "bad", "", "news", "")
    paused = DurationModel.fit([spoken("no money, for, bad, news", seed) for seed in range(6)])
    assert paused.pauses.minor == ("sp", pytest.approx(0.25)) and paused.pauses.none is None
    slow = model.predict(parse("no [pause 700ms] news"), rate=0.5)
    assert [s.duration for s in slow["phones"] if s.label == "sp"] == [pytest.approx(0.7)]


def hurried(seed: int, pauses: bool) -> Utterance:
    """A sentence of two commas, with a pause at both or without any."""
    made = spoken("no money, for bad, bad news", seed)
    if pauses:
        return made
    at = {s.start: s.end for s in made.alignment["phones"] if s.label == "sp"}
    return Utterance(made.id, made.text, Alignment(Tier(tier.name, [
        (s.start, at.get(s.end, s.end), s.label) for s in tier if s.start not in at]) for tier in made.alignment.tiers))


@pytest.mark.parametrize(("paused", "without", "minor"), [
    (1, 1, ("sp", 0.18)),   # four commas tell nothing yet
    (1, 2, None), (0, 9, None), (2, 2, ("sp", 0.25)), (9, 0, ("sp", 0.25))])
def test_a_talker_who_seldom_pauses_at_commas_does_not_in_new_sentences(
        paused: int, without: int, minor: tuple[str, float] | None) -> None:
    found = usual_pauses([hurried(seed, seed < paused) for seed in range(paused + without)])
    assert found.minor == (minor and (minor[0], pytest.approx(minor[1]))) and found.none is None
    assert found.major == ("sp", pytest.approx(0.4))  # a sentence ends with one all the same


def test_pauses_are_found_where_text_and_tier_count_their_words_differently() -> None:
    def british(seed: int) -> Utterance:
        """*101* in the text, *one hundred and one* in the tiers, and a pause of 250 ms after the comma."""
        made = spoken("we met one hundred and one bees, at noon", seed)
        return Utterance(made.id, "we met 101 bees, at noon", made.alignment)

    found = usual_pauses([british(seed) for seed in range(6)])
    assert found.minor == ("sp", pytest.approx(0.25)) and found.none is None
    assert found.major == ("sp", pytest.approx(0.4))


def test_pauses_at_the_ends_of_a_text_are_added_to_the_silence(model: DurationModel) -> None:
    ends = [[round(a["phones"][i].duration, 3) for i in (0, -1)] for a in (
        model.predict(parse("[pause 2s] no news [pause 500ms]"), rate=2.0),
        model.predict(parse("[pause 2s] no news. [pause]"), total=4.0, lead_in=0.0))]
    assert ends == [[2.2, 0.8], [2.0, 0.3]]
    with pytest.raises(DnnvssError, match=r"2\.0 s are too short for 5 phones and 2\.50 s of silence"):
        model.predict(parse("[pause 2s] no news"), total=2.0)


def test_phones_that_the_corpus_lacks_fall_back_to_their_class(model: DurationModel) -> None:
    assert not {"CH", "OY"} & {name.split()[0] for name in model.columns}
    choice = {s.label: s.duration for s in model.predict(parse("choice news"))["phones"]}
    assert 0.04 < choice["CH"] < 0.13 and 0.08 < choice["OY"] < 0.18


def test_emphasis_lengthens(model: DurationModel) -> None:
    plain, strong = (model.predict(parse(text)) for text in ("set blue now", "set *blue* now"))
    assert strong.end > plain.end and strong["phones"][1].duration == pytest.approx(plain["phones"][1].duration)


def test_saved_model_predicts_the_same(model: DurationModel, tmp_path: Path) -> None:
    again = DurationModel.load(model.save(tmp_path / "durations.npz"))
    assert again.predict(parse("set blue now")).to_json() == model.predict(parse("set blue now")).to_json()
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(DnnvssError, match=r"other\.npz: lacks columns, weights"):
        DurationModel.load(tmp_path / "other.npz")


def test_contexts_do_not_depend_on_times(corpus: list[Utterance]) -> None:
    a, b = (spoken(SENTENCES[0], seed) for seed in (1, 2))
    assert spoken_contexts(a.alignment, a.text)[0] == spoken_contexts(b.alignment, b.text)[0]


def test_bad_requests_are_named(model: DurationModel, corpus: list[Utterance]) -> None:
    with pytest.raises(DnnvssError, match=r"0\.6 s are too short for 8 phones"):
        model.predict(parse("set blue now"), total=0.6)
    with pytest.raises(DnnvssError, match="speed of 9"):
        model.predict(parse("set blue now"), rate=9)
    with pytest.raises(DnnvssError, match="learnt from 1 utterance"):
        DurationModel.fit(corpus[:1])


def test_another_source_of_durations_is_followed_and_the_rate_still_counts(model: DurationModel) -> None:
    def even(alignment: Alignment, text: str) -> np.ndarray:
        assert text == "set blue now"
        return np.full(sum(s.label not in SILENCES for s in alignment["phones"]), 0.12)

    sentence = parse("set blue now")
    normal, fast = (model.predict(sentence, rate=r, lead_in=0, lead_out=0, expected=even) for r in (1.0, 2.0))
    lengths = [s.duration for s in normal["phones"] if s.label not in SILENCES]
    np.testing.assert_allclose(lengths, 0.12)
    np.testing.assert_allclose(fast.end, normal.end / 2)


def test_phones_that_were_never_heard_last_as_others_say(model: DurationModel) -> None:
    texts = [t for t in SENTENCES if "L" not in [p.rstrip("012") for w in parse(t).words for p in w.phones]]
    few = DurationModel.fit([spoken(text, 100 + k) for k, text in enumerate(texts)])
    both = few.borrowing(model)
    assert "L" in both.columns and "L" not in few.columns
    lacking = both.columns[len(few.columns) :]
    for text, changed in ((SENTENCES[0], True), (texts[0], False)):
        own = spoken(text, 7)
        contexts, _ = spoken_contexts(own.alignment, text)
        extra = [model.weights[model.columns.index(row[0])] if row[0] in lacking else 0.0 for row in contexts]
        assert any(extra) == changed
        logs = [m.log_durations(own.alignment, text)[0] for m in (few, both)]
        np.testing.assert_allclose(logs[1], logs[0] + extra, atol=1e-12)
    assert few.borrowing(few).columns == few.columns


def test_log_durations_are_the_product_of_contexts_and_weights(model: DurationModel, corpus: list[Utterance]) -> None:
    for utterance in corpus[:3]:
        rows, _ = spoken_contexts(utterance.alignment, utterance.text)
        places = np.array([[model.columns.index(name) for name in row] for row in rows])
        wanted = context_matrix(places, len(model.columns)) @ model.weights
        np.testing.assert_allclose(model.log_durations(utterance.alignment, utterance.text)[0], wanted, atol=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_a_length_is_met_as_bisection_meets_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mean, deviation, pauses = rng.normal(-2.5, 0.6, 30), rng.uniform(0.05, 0.6, 30), rng.uniform(0.02, 1, seed % 3)
    wanted = max((np.exp(mean).sum() + pauses.sum()) * np.exp(rng.uniform(-2, 2.9)), 2 * SHORTEST * 30)
    low, high = -40.0, 40.0
    for _ in range(100):
        r = (low + high) / 2
        own, longer = np.maximum(np.exp(mean + r * deviation), SHORTEST), pauses * np.exp(r * deviation.mean())
        low, high = (r, high) if own.sum() + longer.sum() < wanted else (low, r)
    seconds, silences = stretched(mean, deviation, pauses, wanted)
    np.testing.assert_allclose(seconds, own, rtol=1e-10)
    np.testing.assert_allclose(silences, longer, rtol=1e-10)
    assert seconds.sum() + silences.sum() == pytest.approx(wanted, abs=1e-12)
