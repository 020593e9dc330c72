"""Recordings of the fragments whose movement is played: heard where it is seen, at the times that both have."""

from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import CLOCK, TABLE

from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.media import SPEECH_RATE, Sound
from dnnvss.phones import phone_id
from dnnvss.runs.run import Run
from dnnvss.synthesis.plan import Plan
from dnnvss.synthesis.recorded import check_recordings, with_recordings
from dnnvss.synthesis.request import SpeakRequest
from dnnvss.systems import Example
from dnnvss.systems.fragments import Fragments, spoken_phones

FRAME = SPEECH_RATE // 100


@dataclass
class Shelf:
    """Recordings whose samples say which frame of which sentence they are of."""

    examples: list[Example]
    root: Path = Path("corpus")
    utterances: dict[str, SimpleNamespace] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.utterances = {e.id: SimpleNamespace(id=e.id, audio="a.wav") for e in self.examples}

    def sound(self, utterance: SimpleNamespace) -> Sound:
        k = [e.id for e in self.examples].index(utterance.id)
        frames = np.repeat(np.arange(len(self.examples[k].codes)), FRAME)
        return Sound((1000 * k + frames).astype(np.float32), SPEECH_RATE)


@pytest.fixture
def run(examples: dict[str, list[Example]], monkeypatch: pytest.MonkeyPatch) -> Run:
    model = Fragments(TABLE, CLOCK, Fragments.Settings(examples=3, stretch=True, own=False))
    model.fit(examples["train"], examples["val"], Path())
    monkeypatch.setattr(Corpus, "open", lambda folder: Shelf(examples["train"]))
    settings = SimpleNamespace(corpus_folder=Path("corpus"), model_name="fragments")
    return SimpleNamespace(model=model, settings=settings, task=SimpleNamespace(clock=CLOCK), folder=Path("run"))  # type: ignore[return-value]


def test_sound_and_movement_are_of_the_same_frames_of_the_same_recordings(
    run: Run, examples: dict[str, list[Example]]
) -> None:
    example = examples["test"][0]
    plan = with_recordings(run, Plan("word", example.alignment), example)
    assert plan.sound is not None and plan.engine == "corpus"
    frames = round(plan.alignment.end * 100)
    assert len(plan.sound.samples) == frames * FRAME
    assert plan.alignment["phones"].labels == example.alignment["phones"].labels
    assert [w.label for w in plan.alignment["words"]] == [w.label for w in example.alignment["words"]]
    recorded = run.model.corpus_.recorded  # type: ignore[attr-defined]
    edges = [round(100 * p.start) for p in plan.alignment["phones"]] + [frames]
    for fragment in plan.fragments:
        unit, place = fragment.unit, fragment.places[0]
        assert len(fragment.places) == 1
        owner = recorded.owner[place]
        for k in range(unit.first + 1, unit.last):  # inner phones: as they were recorded, frame by frame
            own = recorded.frames[place + k - unit.first]
            assert edges[k + 1] - edges[k] == own
            first = recorded.first[place + k - unit.first] - recorded.bounds[owner]
            middle = plan.sound.samples[edges[k] * FRAME : edges[k + 1] * FRAME : FRAME][2:-2]
            np.testing.assert_allclose(middle - 1000 * owner, first + np.arange(own)[2:-2], atol=1)


def test_the_movement_is_that_of_one_recording_and_is_not_stretched(
    run: Run, examples: dict[str, list[Example]]
) -> None:
    model, example = run.model, examples["test"][1]
    assert isinstance(model, Fragments)
    one = [f.best for f in model.fragments(example)]
    held = model.playing(one)
    again = held.fragments(examples["test"][0])
    assert [f.places for f in again] == [f.places for f in one] and all(len(f.places) == 1 for f in one)
    assert any(len(f.places) == 3 for f in model.fragments(example))
    np.testing.assert_array_equal(held.stretch_, 1)
    assert [f["from"] for f in held.report(example)["fragments"]] == [list(f.sentences) for f in one]


def test_long_silences_are_cut_to_what_is_wanted(run: Run, examples: dict[str, list[Example]]) -> None:
    example = examples["test"][0]
    plan = with_recordings(run, Plan("word", example.alignment), example)
    wanted = spoken_phones(example)[1]
    ends = [plan.alignment["phones"].labels[k] for k in (0, -1)]
    assert ends == ["sil", "sil"] and phone_id("sil") == spoken_phones(example)[0][0]
    lasting = [round(100 * (p.end - p.start)) for p in plan.alignment["phones"]]
    assert 1 <= lasting[0] <= wanted[0] and 1 <= lasting[-1] <= wanted[-1]


def test_what_recordings_cannot_say_is_told(
    run: Run, examples: dict[str, list[Example]], monkeypatch: pytest.MonkeyPatch
) -> None:
    example = examples["test"][0]
    silent = Shelf(examples["train"])
    for utterance in silent.utterances.values():
        utterance.audio = None
    monkeypatch.setattr(Corpus, "open", lambda folder: silent)
    with pytest.raises(DnnvssError, match=r"the fragment sil-.* is from a sentence that has no sound"):
        with_recordings(run, Plan("word", example.alignment), example)
    check_recordings(run, SpeakRequest("word", engine="corpus"))
    with pytest.raises(DnnvssError, match="in the time of its recordings"):
        check_recordings(run, SpeakRequest("word", engine="corpus", speed=2))
    other = SimpleNamespace(model=object(), folder=Path("r"), settings=SimpleNamespace(model_name="hsmm"))
    with pytest.raises(DnnvssError, match="the run's system is hsmm"):
        check_recordings(other, SpeakRequest("word", engine="corpus"))  # type: ignore[arg-type]
