"""The built-in formant voice as an engine: always there, and it speaks any durations exactly."""

from dnnvss.errors import DnnvssError
from dnnvss.speech.engines.base import Speech
from dnnvss.speech.formant import synthesise
from dnnvss.text.sentence import Sentence
from dnnvss.timing import Alignment


class FormantEngine:
    """Our own voice (:mod:`dnnvss.speech.formant`); it has no durations of its own."""

    name = "formant"
    voices = ("formant",)
    imposes = True

    def __init__(self, voice: str = "formant", rate: int = 16000, seed: int = 0, f0: float = 110.0) -> None:
        self.voice, self.rate, self.seed, self.f0 = voice, rate, seed, f0

    def available(self) -> str | None:
        """Return None: it needs nothing that is not installed."""
        return None

    def speak(self, sentence: Sentence, alignment: Alignment | None = None) -> Speech:
        """Return the sentence at exactly the times of the alignment.

        Raises:
            DnnvssError: no alignment is given.
        """
        if alignment is None:
            raise DnnvssError("the formant voice needs durations",
                              remedy="Predict them with a DurationModel, or give an alignment")
        return Speech(synthesise(alignment, self.rate, self.seed, self.f0), self.rate, alignment)
