"""The risks of each frame, worked by hand on a sentence of four phones."""

import numpy as np

from dnnvss.phones.contexts import spoken_triphones, triphones
from dnnvss.style.keys import Key
from dnnvss.style.within import Reach
from dnnvss.synthesis.risks import Span, find_risks, key_risks, sound_risks, summary, unfamiliar, word_risks
from dnnvss.timing import Alignment, FrameClock, Tier

SAID = Alignment([
    Tier("phones", [(0, 0.1, "sil"), (0.1, 0.2, "AE"), (0.2, 0.25, "ZH"), (0.25, 0.3, "sp"), (0.3, 0.4, "N"),
                    (0.4, 0.5, "OW"), (0.5, 0.6, "sil")]),
    Tier("words", [(0, 0.1, ""), (0.1, 0.25, "azh"), (0.25, 0.3, ""), (0.3, 0.5, "no"), (0.5, 0.6, "")]),
])
CLOCK = FrameClock(100)
STANDS_IN = {"kind": "unseen phone", "phone": "ZH", "stands_in": "SH"}
REPORT = [{"spoken": "azh", "source": "network", "phones": "AE1 ZH"},
          {"spoken": "no", "source": "lexicon", "phones": "N OW1"}]


def unseen(triphone: str) -> dict[str, str]:
    return {"kind": "unseen triphone", "triphone": triphone}


def test_triphones_take_every_pause_and_the_ends_for_silence() -> None:
    assert triphones(SAID["phones"]) == ["sil-sil+AE", "sil-AE+ZH", "AE-ZH+sil", "ZH-sil+N", "sil-N+OW", "N-OW+sil",
                                         "OW-sil+sil"]
    assert spoken_triphones([SAID, SAID]) == ["AE-ZH+sil", "N-OW+sil", "sil-AE+ZH", "sil-N+OW"]


def test_what_the_talker_said_carries_no_risk() -> None:
    assert find_risks(SAID, CLOCK, {}, spoken_triphones([SAID])) == []
    assert summary([], 60) == "none of the 60 frames carries a risk"


def test_unseen_phone_and_triphones_with_the_stand_in() -> None:
    spans = find_risks(SAID, CLOCK, {"ZH": "SH"}, ["sil-AE+SH", "sil-N+OW"])
    assert spans == [Span(20, 24, 0.2, 0.25, (STANDS_IN, unseen("AE-SH+sil"))),
                     Span(40, 49, 0.4, 0.5, (unseen("N-OW+sil"),))]
    assert summary(spans, 60) == ("15 of 60 frames carry a risk (unseen phone 5, unseen triphone 15); "
                                  "the report names them")


def test_risks_of_words_span_their_phones_and_not_the_pauses() -> None:
    words = word_risks(REPORT, [-12.0, -40.04])
    guessed = {"kind": "unknown word", "word": "azh", "phones": "AE1 ZH"}
    weak = {"kind": "weak alignment", "word": "no", "score": -40.0}
    assert words == [[guessed], [weak]]
    spans = find_risks(SAID, CLOCK, {}, spoken_triphones([SAID]), words)
    assert [s.to_json() for s in spans] == [
        {"first": 10, "last": 24, "start": 0.1, "end": 0.25, "risks": [guessed]},
        {"first": 30, "last": 49, "start": 0.3, "end": 0.5, "risks": [weak]}]


def test_without_scores_no_alignment_is_weak_and_a_phone_without_frames_makes_no_span() -> None:
    assert word_risks(REPORT) == [[{"kind": "unknown word", "word": "azh", "phones": "AE1 ZH"}], []]
    coarse = find_risks(SAID, FrameClock(5), {}, [t for t in spoken_triphones([SAID]) if t != "AE-ZH+sil"])
    assert coarse == []


def test_sounds_beyond_what_is_usual_make_spans() -> None:
    spans = sound_risks(np.array([0.5, 1.2, 3.456, 0.9, 0.9, 1.1]), CLOCK)
    assert spans == [Span(1, 2, 0.01, 0.03, ({"kind": "unheard sound", "distance": 3.46},)),
                     Span(5, 5, 0.05, 0.06, ({"kind": "unheard sound", "distance": 1.1},))]
    assert sound_risks(np.zeros(3), CLOCK) == []
    phones, later = find_risks(SAID, CLOCK, {}, []), sound_risks(np.repeat([0.0, 2.0], [12, 3]), CLOCK)
    assert summary(phones, 60).startswith("35 of 60")
    assert summary([*phones, *later], 60).startswith("35 of 60")  # frames that carry two risks count once


def test_where_most_triphones_are_unseen_only_phones_without_a_neighbour_are_marked() -> None:
    labels = ["sil", "N", "OW", "T", "AE", "N", "D", "OW", "M", "sil"]
    edges = np.arange(len(labels) + 1) / 10
    words = [(0, 0.1, ""), (0.1, 0.9, "word"), (0.9, 1.0, "")]
    said = Alignment([Tier("phones", zip(edges[:-1], edges[1:], labels, strict=True)), Tier("words", words)])
    known = ["sil-N+OW", "AE-N+D", "OW-T+sil", "L-AE+N"]  # the last two phones have none of these pairs
    assert unfamiliar(said, {}, known) == 0.75
    spans = find_risks(said, CLOCK, {}, known)
    marked = [(s.first, r["kind"], r["triphone"]) for s in spans for r in s.risks]
    assert marked == [(70, "unseen neighbours", "D-OW+M"), (80, "unseen neighbours", "OW-M+sil")]
    assert unfamiliar(said, {}, spoken_triphones([said])) is None and find_risks(said, CLOCK, {},
                                                                                 spoken_triphones([said])) == []
    assert unfamiliar(SAID, {}, []) is None  # four phones


def test_a_key_that_moves_with_its_phone_is_told_where_it_is_held() -> None:
    """Written at .9 s of slow speech, in the middle of OW, which lasts from .4 to .5 s now."""
    key = Key(0.9, "aam01", 3.0, 3.0, phone="OW", index=5, position=0.5)
    reach = Reach(np.zeros(1), np.ones(1), {}, {})
    (told,) = key_risks([key], reach, ("aam01",), SAID["phones"])
    assert told[0] == 0.45 and key_risks([key], reach, ("aam01",))[0][0] == 0.9
    (span,) = find_risks(SAID, CLOCK, {}, spoken_triphones([SAID]), keys=[told])
    assert (span.start, span.end) == (0.4, 0.5) and span.risks[0]["kind"] == "key beyond the talker"
