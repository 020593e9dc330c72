"""flite: a small engine that speaks the phones that it is given, in its own time; found if it is installed."""

import re
import shutil

from dnnvss.errors import DnnvssError
from dnnvss.speech.engines.base import Speech, fitted, read_wav, run, workshop
from dnnvss.speech.engines.festival import segments
from dnnvss.speech.engines.matching import matched
from dnnvss.text.sentence import Sentence
from dnnvss.timing import Alignment


class FliteEngine:
    """flite in a subprocess, voice ``slt``."""

    name = "flite"
    imposes = False

    def available(self) -> str | None:
        """Return None if flite is there, else what to install."""
        if shutil.which("flite") is None:
            return "the program flite is not installed. Install it, on Debian: apt install flite"
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
            printed = run(["flite", "-voice", "slt", "-psdur", "-p", _phones(sentence), "-o", str(wav)], self.name)
            samples, rate = read_wav(wav, self.name)
        ends = [(name, float(end)) for name, end in re.findall(r"(\S+):([\d.]+)", printed)]
        timed = matched(sentence, segments(ends, len(samples) / rate), self.name)
        return Speech(fitted(samples, rate, timed), rate, timed)


def _phones(sentence: Sentence) -> str:
    """Return the sentence as flite's phones, stress on the vowels, with pauses at the breaks."""
    row = ["pau"]
    for word in sentence.words:
        row += ["ax" if p == "AH0" else p.lower() for p in word.phones]
        row += ["pau"] if word.break_after != "none" else []
    return " ".join(row if row[-1] == "pau" else [*row, "pau"])
