"""What is said when a text and a recording of it are given."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.synthesis.plan import Plan, given, heard, spoken
from dnnvss.synthesis.request import Recording, SpeakRequest
from dnnvss.text.sentence import parse
from dnnvss.timing import Alignment, Tier


def test_words_that_drown_in_noise_are_refused_and_a_voice_alone_is_named() -> None:
    noise = np.random.default_rng(0).normal(0, 0.1, 32000).astype(np.float32)
    run: Any = SimpleNamespace(voice=SimpleNamespace(variant="en_us"))
    with pytest.raises(DnnvssError, match=r"noise.*less noise, or leave the text out: a run whose labels read"):
        heard(run, parse("hello there"), Recording(noise, 16000))


def test_times_of_a_recording_are_laid_over_all_of_it() -> None:
    """Phones from 0.5 s on of a recording of 2 s: frame 0 of the face is the start of the sound, not of the phones."""
    times = Alignment([Tier("phones", [(0.5, 0.7, "B"), (0.7, 1.0, "IY")]), Tier("words", [(0.5, 1.0, "be")])])
    sound = Recording(np.zeros(32000), 16000, file=Path("be.wav"))
    run: Any = None  # which words alone are looked up by
    plan = given(run, SpeakRequest(text="be", recording=sound, alignment=times), times)
    assert [(s.start, s.end, s.label) for s in plan.alignment["phones"]] == [
        (0.0, 0.5, "sil"), (0.5, 0.7, "B"), (0.7, 1.0, "IY"), (1.0, 2.0, "sil")]
    assert (plan.alignment["words"].start, plan.alignment["words"].end) == (0.0, 2.0)
    late = Alignment(tier.moved(1.5) for tier in times.tiers)
    with pytest.raises(DnnvssError, match=r"be\.wav: .*has speech from 2\.000 to 2\.500 s, but the recording runs"):
        given(run, SpeakRequest(text="be", recording=sound, alignment=late), late)


@pytest.mark.parametrize(("text", "imposing"), [
    ("hello, you", False), ("[pause 1s] hello you", False), ("hello <break time='800ms'/> you", True),
    ("<prosody rate='50%'>hello</prosody> you", True)])
def test_pauses_and_rates_of_a_text_are_spoken(text: str, imposing: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """An engine that speaks in its own time leaves them out, so that another one or another voice is asked."""
    asked: list[Any] = []

    def find(*how: Any) -> Any:
        asked.append(how)
        raise DnnvssError("enough")

    monkeypatch.setattr("dnnvss.speech.engines.find_engine", find)
    sentence, plan = parse(text), Plan(text, Alignment([Tier("phones", [(0, 1, "sil")])]))
    with pytest.raises(DnnvssError, match="enough"):
        spoken(plan, SpeakRequest(text=text, engine="auto"), lambda: sentence)
    assert asked == [("auto", imposing, None)]
