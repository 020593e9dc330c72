"""What is said, when, and the sound of it: from phone times, a voice, or text alone."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dnnvss.corpus import Utterance
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.formats import spanning
from dnnvss.media import SPEECH_RATE
from dnnvss.phones import SILENCES
from dnnvss.runs.run import Run
from dnnvss.speech.activity import TIER as SPEECH_TIER
from dnnvss.speech.activity import voice_activity
from dnnvss.synthesis.request import Recording, SpeakRequest
from dnnvss.timing import Alignment, Tier
from dnnvss.visemes import TIER

if TYPE_CHECKING:
    from dnnvss.speech.durations import Expected
    from dnnvss.systems.fragments import Fragment
    from dnnvss.text.sentence import Sentence

RECORDED = "the given recording"


@dataclass(frozen=True)
class Plan:
    """What is said, when, and the sound of it.

    Args:
        text: the words.
        alignment: tiers ``phones`` and ``words``, from 0; ``visemes`` where they are known. Of a voice alone, the tier
            ``speech``: where somebody speaks.
        sound: None where nothing is to be heard.
        engine: whose voice it is; None where nothing is to be heard.
        pronunciation: a row for each word, where the words were looked up for their times.
        scores: how sure the aligner is of each word, where it was asked.
        fragments: whose recordings are heard, where the sound is the corpus's own.
    """

    text: str
    alignment: Alignment
    sound: Recording | None = None
    engine: str | None = None
    pronunciation: tuple[Mapping[str, str], ...] = ()
    scores: tuple[float, ...] = ()
    fragments: "tuple[Fragment, ...]" = ()

    @property
    def phones(self) -> Tier | None:
        """The phones, None where only a voice is known."""
        return next((tier for tier in self.alignment.tiers if tier.name == "phones"), None)

    @property
    def tier(self) -> Tier:
        """What tells speech from silence: the phones where they are known."""
        return self.phones or self.alignment[SPEECH_TIER]


def make_plan(run: Run, request: SpeakRequest) -> Plan:
    """What a request wants said.

    Raises:
        DnnvssError: nothing is given that could be said, or it cannot be used.
    """
    plan = _planned(run, request)
    if plan.alignment.end > LONGEST:
        raise DnnvssError(f"would last {plan.alignment.end / 3600:,.1f} hours",
                          remedy=f"Speak it in parts of at most {LONGEST / 3600:g} hours")
    return plan


LONGEST = 6 * 3600.0
"""Seconds of speech beyond which a time is a mistake, and memory would not hold the frames."""


def _planned(run: Run, request: SpeakRequest) -> Plan:
    """What is said, by what is given of it."""
    if request.alignment is not None:
        plan = given(run, request, request.alignment)
        return plan if request.recording else spoken(plan, request, lambda: parsed(run, request, plan.text))
    if request.wordless and request.recording:
        return overheard(run, request.recording)
    if not request.text.strip():
        raise DnnvssError("nothing to say: text is empty", remedy='Give text="...", wav=FILE or alignment=FILE')
    sentence = parsed(run, request, request.text)
    if request.recording:
        return heard(run, sentence, request.recording)
    return spoken(timed(run, request, sentence), request, lambda: sentence)


def parsed(run: Run, request: SpeakRequest, text: str) -> "Sentence":
    """The words of a text, as the talker of the run and the user pronounce them."""
    from dnnvss.text.sentence import parse

    return parse(text, variant=run.voice.variant, overrides=request.overrides)


def given(run: Run, request: SpeakRequest, alignment: Alignment) -> Plan:
    """The phone times that are given, with words, over all of their recording; without one, their start becomes 0.

    Raises:
        DnnvssError: they are of another sentence, or run past the recording.
    """
    check_alignment(alignment, request.text)
    if request.recording is not None:
        sound = request.recording
        try:
            alignment = spanning(alignment, len(sound.samples) / sound.rate)
        except DnnvssError as error:
            raise DnnvssError(error.problem, file=sound.file, remedy=error.remedy) from error
    if "words" not in alignment:
        from dnnvss.speech.align_words import words_over

        words = [(w.spoken, w.choices(run.voice.variant)) for w in parsed(run, request, request.text).words]
        alignment = alignment.with_tier(words_over(alignment["phones"], words))
    text = request.text or " ".join(w for w in alignment["words"].labels if w)
    if request.recording is None:
        return Plan(text, from_start(alignment))
    return Plan(text, alignment, request.recording, RECORDED)


def from_start(alignment: Alignment) -> Alignment:
    """The alignment moved so that it begins at 0, where the first frame of a face is; itself if it does."""
    if alignment.start == 0:
        return alignment
    return Alignment(tier.moved(-alignment.start) for tier in alignment.tiers)


def check_alignment(alignment: Alignment, text: str, file: Path | None = None) -> Alignment:
    """Refuse an alignment without phones, or without words where no text tells them; itself if it is well.

    Args:
        alignment: what was read.
        text: the words, where they are given.
        file: that it was read from, for the message.
    """
    names = [tier.name for tier in alignment.tiers]
    if "phones" not in names:
        raise DnnvssError(f"has no tier 'phones' (it has {', '.join(names)})", file=file,
                          remedy='Give phone times; or a recording: wav=FILE text="..."')
    if "words" not in names and not text:
        raise DnnvssError("has phones and no tier 'words'", file=file, remedy='Add text="..."')
    if "words" in names and text:
        _check_words(alignment, text, file)
    return alignment


def _check_words(alignment: Alignment, text: str, file: Path | None) -> None:
    """Refuse an alignment that says another sentence than the text."""
    from dnnvss.text.agreement import OTHER, agreement

    labels = alignment["words"].labels
    if agreement(text, labels).share < OTHER:
        raise DnnvssError(f"its words are {' '.join(filter(None, labels))[:80]!r}, and the text is {text[:80]!r}",
                          file=file, remedy="Give the text that belongs to the alignment, or leave text= out")


def heard(run: Run, sentence: "Sentence", recording: Recording) -> Plan:
    """The times of a sentence in a recording of it.

    Raises:
        DnnvssError: the recording does not hold the sentence, or cannot be listened to.
    """
    from dnnvss.speech.align import LASTING, align

    if recording.heard.rate != SPEECH_RATE:
        raise DnnvssError(f"the aligner listens at {SPEECH_RATE} samples a second, not {recording.rate}",
                          remedy="Give the sound at that rate as Recording.speech")
    words = [(w.spoken, w.choices(run.voice.variant)) for w in sentence.words]
    try:
        found = align(recording.heard.samples, words, lasting=LASTING)
    except DnnvssError as error:
        if isinstance(error, ShortageError) or error.file is not None:
            raise
        other = "leave the text out: a run whose labels read the sound alone follows the voice"
        remedy = f"{error.remedy.rstrip('.')}, or {other}" if error.remedy else other.capitalize()
        raise DnnvssError(error.problem, file=recording.file, remedy=remedy) from error
    return Plan(sentence.text, found.alignment, recording, RECORDED, tuple(sentence.report()), tuple(found.scores))


def overheard(run: Run, recording: Recording) -> Plan:
    """A voice whose words nobody knows.

    Raises:
        DnnvssError: the run needs more than a voice, or the recording holds no sound.
    """
    if missing := run.needs - {"sound"}:
        known = " and ".join(sorted(missing - {"words"} or missing))
        raise DnnvssError(f"{run.task.table.title} of the run needs {known}, which a voice alone does not tell",
                          file=run.folder, remedy='Add text="..." or alignment=FILE, or take a run whose labels read '
                          "the sound alone: dnnvss train labels=mel")
    if not run.needs:
        raise DnnvssError("the run does not listen, and there is no text", file=run.folder,
                          remedy='Give text="...", or take a run of labels=mel')
    if not len(recording.heard.samples):
        raise DnnvssError("the recording holds no sound", file=recording.file, remedy="Give another wav=FILE")
    return Plan("", Alignment([voice_activity(recording.heard)]), recording, RECORDED)


def timed(run: Run, request: SpeakRequest, sentence: "Sentence") -> Plan:
    """A sentence at the times that the talker, or the run's own system, would take."""
    expected = model_durations(run) if request.durations == "model" else None
    alignment = run.durations.predict(sentence, rate=request.speed, total=request.total, lead_in=request.lead_in,
                                      lead_out=request.lead_out, expected=expected)
    return Plan(sentence.text, alignment, pronunciation=tuple(sentence.report()))


def model_durations(run: Run) -> "Expected":
    """What tells how long phones last by the run's own model, whatever the times of an alignment are.

    Raises:
        DnnvssError: when asked, if the model has learnt no durations.
    """
    def seconds(alignment: Alignment, text: str) -> np.ndarray:
        frames = run.model.phone_durations(run.example(Utterance("synthesis", text, alignment)))
        if frames is None:
            raise DnnvssError(f"{run.settings.model_name} has learnt no durations", file=run.folder,
                              remedy="Use durations=corpus, or a run of model=hsmm")
        said = [label not in SILENCES for label in alignment["phones"].labels]
        return frames[said] / float(run.task.clock.rate)

    return seconds


def spoken(plan: Plan, request: SpeakRequest, sentence: Callable[[], "Sentence"]) -> Plan:
    """The plan with the sound of an engine, in its own time where it has one; itself where none is asked for.

    Args:
        plan: what is said, and when.
        request: names the engine.
        sentence: gives the words, which only an engine needs.
    """
    if request.engine == "none" or request.by_recordings:
        return plan
    from dnnvss.speech.engines import find_engine, with_silences

    words = sentence()
    engine = find_engine(request.engine, request.timed or words.timed, request.engine_voice)
    speech = engine.speak(words, plan.alignment)
    if not engine.imposes:
        speech = with_silences(speech, request.lead_in + words.pause_before, request.lead_out + words.pause_after)
    alignment = speech.alignment.with_tier(plan.alignment[TIER]) if TIER in plan.alignment else speech.alignment
    return replace(plan, alignment=alignment, sound=Recording(speech.samples, speech.rate), engine=engine.name)
