"""flite: a small engine that speaks the phones that it is given, in its own time; found if it is installed."""

import re
import shutil
from functools import cache

from dnnvss.errors import DnnvssError
from dnnvss.speech.engines.base import Speech, fitted, read_wav, run, workshop
from dnnvss.speech.engines.festival import segments
from dnnvss.speech.engines.matching import matched
from dnnvss.text.sentence import Sentence
from dnnvss.timing import Alignment


class FliteEngine:
    """flite in a subprocess, with one of the voices that are built into it."""

    name = "flite"
    voices = ("slt", "rms", "awb", "kal16", "kal")
    imposes = False

    def __init__(self, voice: str = "slt") -> None:
        self.voice = voice

    def available(self) -> str | None:
        """None if flite is there with this voice, else what to install."""
        if (program := shutil.which("flite")) is None:
            return "the program flite is not installed. Install it, on Debian: apt install flite"
        if self.voice not in _built_in(program):
            return f"this flite has no voice {self.voice}. Install one that has, on Debian: apt install flite"
        return None

    def speak(self, sentence: Sentence, alignment: Alignment | None = None) -> Speech:
        """Return the sentence in flite's own time; given times are not used.

        Raises:
            DnnvssError: flite is missing or failed.
        """
        if reason := self.available():
            raise DnnvssError(reason)
        with workshop() as folder:
            wav = folder / "speech.wav"
            printed = run(["flite", "-voice", self.voice, "-psdur", "-p", _phones(sentence), "-o", str(wav)], self.name)
            samples, rate = read_wav(wav, self.name)
        ends = [(name, float(end)) for name, end in re.findall(r"(\S+):([\d.]+)", printed)]
        timed = matched(sentence, segments(ends, len(samples) / rate), self.name)
        return Speech(fitted(samples, rate, timed), rate, timed)


@cache
def _built_in(program: str) -> tuple[str, ...]:
    """Voices that a flite lists; none where it does not run."""
    try:
        listed = run([program, "-lv"], FliteEngine.name)
    except DnnvssError:
        return ()
    return tuple(listed.partition(":")[2].split())


def _phones(sentence: Sentence) -> str:
    """Return the sentence as flite's phones, stress on the vowels, with pauses at the breaks."""
    row = ["pau"]
    for word in sentence.words:
        row += ["ax" if p == "AH0" else p.lower() for p in word.phones]
        row += ["pau"] if word.break_after != "none" else []
    return " ".join(row if row[-1] == "pau" else [*row, "pau"])
