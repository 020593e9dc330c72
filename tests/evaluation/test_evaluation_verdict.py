"""What was heard, what to record next, and the five lines of the verdict."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dnnvss.evaluation.cells import number_of
from dnnvss.evaluation.report import evaluate
from dnnvss.evaluation.verdict import Verdict, verdict
from dnnvss.phones import SILENCES, SPOKEN
from dnnvss.runs.voice import Voice
from dnnvss.systems import Example
from dnnvss.text.coverage import EXAMPLES, Coverage, next_prompts, prompt_pairs, prompts
from dnnvss.text.sentence import parse
from dnnvss.timing import Alignment, Tier


def heard(*texts: str) -> Coverage:
    phones = [parse(text).phones for text in texts]
    triphones = {f"{a}-{b}+{c}" for own in phones
                 for a, b, c in zip(("sil", *own[:-1]), own, (*own[1:], "sil"), strict=True)}
    return Coverage.of(Counter(p for own in phones for p in own), triphones)


@pytest.mark.parametrize("variant", ["en_us", "en_gb"])
def test_the_sentences_hold_every_sound(variant: str) -> None:
    said = {p for pairs in prompt_pairs(variant).values() for pair in pairs for p in pair}
    assert said >= set(SPOKEN) and set(EXAMPLES) == set(SPOKEN)
    assert len(set(prompts())) == len(prompts()) >= 60


def test_coverage_counts_pairs_as_often_as_they_come() -> None:
    nothing = Coverage.of(Counter(), ())
    assert nothing.share("en_us") == 0 and nothing.missing == SPOKEN
    everything = heard(*prompts())
    assert everything.share("en_us") == pytest.approx(1) and not everything.missing
    one = heard(prompts()[0])
    wanted = Counter(pair for pairs in prompt_pairs("en_us").values() for pair in pairs.elements())
    expected = sum(n for pair, n in wanted.items() if pair in prompt_pairs("en_us")[prompts()[0]]) / wanted.total()
    assert one.share("en_us") == pytest.approx(expected)


def test_what_adds_most_is_recorded_next() -> None:
    assert next_prompts(heard(*prompts()), "en_us") == []
    lacking = [text for text in prompts() if "OY" not in parse(text).phones]
    assert "OY" in parse(next_prompts(heard(*lacking), "en_us", 1)[0]).phones
    first = next_prompts(Coverage.of(Counter(), ()), "en_us", 5)
    assert len(set(first)) == 5
    gained = [heard(*first[:k]).share("en_us") for k in range(1, 6)]
    assert gained == sorted(gained) and gained[0] > 0.05


def judged(examples: dict[str, list[Example]], error: float, count: int,
           borrowed: tuple[str, ...] = (), listens: bool = False) -> tuple[str, ...]:
    return judged_whole(examples, error, count, borrowed, listens).lines


def judged_whole(examples: dict[str, list[Example]], error: float, count: int,
                 borrowed: tuple[str, ...] = (), listens: bool = False) -> Verdict:
    rng, used = np.random.default_rng(0), examples["train"][:count]
    truth = {e.id: e.measured[0][:, 0].astype(float) for e in used}
    systems = {"model": {i: x + error * rng.normal(size=x.shape) for i, x in truth.items()},
               "phone mean": {i: x + 1.5 * rng.normal(size=x.shape) for i, x in truth.items()},
               "training mean": {i: np.zeros_like(x) for i, x in truth.items()}}
    voice = Voice(("AA",), ("sil",), "en_us", "25", "", frozenset({"sil-AA+sil"}), borrowed)
    sources = ("grid",) if borrowed else ()
    return verdict(evaluate(systems, truth), "kernel", examples["train"], voice, sources, listens=listens)


def test_the_verdict_says_what_the_table_says(examples: dict[str, list[Example]], tmp_path: Path) -> None:
    lines = judged(examples, 0.1, 8)
    assert len(lines) == 5 and lines[0].startswith("Trained on 8 sentences with ")
    assert "of the 39 sounds of English" in lines[1] and "never heard" in lines[1]
    assert "not chance" in lines[2] and "kernel correlates with the talker by 0.9" in lines[2]
    assert lines[3].count("“") == 3 and "closely" in lines[4]
    assert "may be chance" in judged(examples, 1.5, 8)[2]
    assert "gain over the means is -" in (loss := judged(examples, 9.0, 8)[2]) and "is not chance" in loss
    assert "worse than the mean of each phone" in judged(examples, 9.0, 8)[4]  # more speech would not mend it
    assert "worse" not in judged(examples, 9.0, 4)[4]  # too few to say
    few = judged(examples, 0.1, 4)[2]
    assert "4 are too few" in few and "(" not in few


@pytest.mark.parametrize("count", [8, 4])
def test_a_system_that_listens_is_not_ranked_with_the_mean_of_phones_that_are_told(
        examples: dict[str, list[Example]], count: int) -> None:
    lines = judged(examples, 9.0, count, listens=True)
    assert "which is told the phones and their times" in lines[2] and "gain" not in lines[2]
    assert "worse" not in lines[4] and "learning_rate" not in lines[4]


def test_of_speech_that_nobody_wrote_down_no_sounds_are_counted(
        examples: dict[str, list[Example]], tmp_path: Path) -> None:
    untold = {"train": [replace(e, alignment=_spoken_as_one(e.alignment)) for e in examples["train"]]}
    page, own = tmp_path / "untold.html", judged_whole(untold, 9.0, 8, listens=True)
    assert len(own.lines) == 4 and own.prompts == () and "not written down" in own.lines[1]
    assert "English" not in own.text and "Record" not in own.text and "phone" not in own.text
    assert "mean of speech, which is told when somebody speaks where this one listens" in own.lines[2]
    assert "each sound" not in own.write(page, "untold").read_text()
    assert "each sound" in judged_whole(examples, 9.0, 8, listens=True).write(page, "told").read_text()


def _spoken_as_one(alignment: Alignment) -> Alignment:
    return Alignment([Tier("phones", [(s.start, s.end, s.label if s.label in SILENCES else "AH")
                                      for s in alignment["phones"]])])


def test_the_verdict_says_what_others_lent(examples: dict[str, list[Example]]) -> None:
    lines = judged(examples, 0.1, 8, SPOKEN)
    assert lines[0].endswith("of speech, and on what runs of grid had learnt.")
    assert "which are borrowed from other talkers" in lines[1] and "stands in" not in lines[1]
    some = judged(examples, 0.1, 8, ("OY",))[1]
    assert "some of which are borrowed from other talkers; for the rest the likest sound stands in" in some


def test_one_sentence_is_told_as_one(examples: dict[str, list[Example]]) -> None:
    lines = judged(examples, 0.3, 1)
    assert lines[2].startswith("On 1 sentence that") and "1 is too few to say" in lines[2]
    assert (number_of(1, "sentence"), number_of(0, "sentence")) == ("1 sentence", "0 sentences")
