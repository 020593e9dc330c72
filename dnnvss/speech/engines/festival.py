"""Festival: the HTS voice in its own time, the diphone voice in ours; found if they are installed."""

import re
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.phones import SILENCE, SILENCES, VOWELS
from dnnvss.speech.engines.base import Speech, fitted, read_wav, run, workshop
from dnnvss.speech.engines.matching import matched
from dnnvss.speech.formant import pitch
from dnnvss.text.sentence import Sentence, Word
from dnnvss.text.syllables import syllable_starts
from dnnvss.timing import Alignment, Segment

HTS, DIPHONES = "cmu_us_slt_arctic_hts", "kal_diphone"
_VOICES = {HTS: "festvox-us-slt-hts", DIPHONES: "festvox-kallpc16k"}
"""Voices, the best first, and the packages that hold them."""
_PAUSE = "pau"
_SPECIAL = {"ax": "AH", "axr": "ER", "dx": "T", "el": "L", "em": "M", "en": "N", "nx": "N", "ix": "IH", "h#": SILENCE,
            _PAUSE: SILENCE, "brth": SILENCE, "ssil": SILENCE, "hv": "HH"}
_PRINT = ("(mapcar (lambda (s) (format t \"SEG %s %f\\n\" (item.name s) (item.feat s 'end)))"
          " (utt.relation.items utt 'Segment))")
_PHRASES = ("(Param.set 'Phrase_Method 'cart_tree)", "(set! phrase_cart_tree simple_phrase_cart_tree)")
"""A pause at each break of the text: the voice's own model leaves many out."""
_BREAKS = {"none": "", "minor": ",", "major": ":"}
"""Signs that make them. A full stop before a word in lower case is taken for an abbreviation's and makes none."""
_ROOTS = ("/usr/share/festival/voices", "/usr/lib/festival/voices", "/usr/local/share/festival/voices",
          "/opt/homebrew/share/festival/voices")
_PACKAGE = "Install it, on Debian: apt install festival "


def ours(phone: str) -> str:
    """Return our label for a phone of Festival's or flite's American set; silences become ``sil``."""
    return _SPECIAL.get(phone, phone.upper())


def theirs(phone: str) -> str:
    """Return their phone for one of ours, stress digit or not: an unstressed AH is a schwa."""
    if phone in SILENCES:
        return _PAUSE
    return "ax" if phone == "AH0" else phone.rstrip("012").lower()


class FestivalEngine:
    """Festival in a subprocess: ``cmu_us_slt_arctic_hts`` speaks in its own time, ``kal_diphone`` in any.

    Its lexicon is told our pronunciations, stress included.
    """

    name = "festival"
    voices = tuple(_VOICES)

    def __init__(self, voice: str = HTS) -> None:
        self.voice = voice

    @property
    def imposes(self) -> bool:
        """Whether the voice is the one of diphones, which have whatever length is wanted."""
        return self.voice == DIPHONES

    def available(self) -> str | None:
        """None if Festival and the voice are there, else what to install."""
        if shutil.which("festival") is None:
            return f"the program festival is not installed. {_PACKAGE}{_VOICES[self.voice]}"
        if not has_voice(self.voice):
            return f"Festival's voice {self.voice} is not installed. {_PACKAGE}{_VOICES[self.voice]}"
        return None

    def speak(self, sentence: Sentence, alignment: Alignment | None = None) -> Speech:
        """The sentence in Festival's time, or in the given one where the voice can impose it.

        Raises:
            DnnvssError: the voice is missing, or Festival failed.
        """
        if reason := self.available():
            raise DnnvssError(reason)
        alignment = alignment if self.imposes else None
        with workshop() as folder:
            wav, script = folder / "speech.wav", folder / "speak.scm"
            body = _text_script(sentence) if alignment is None else _segment_script(alignment)
            script.write_text("\n".join([f"(voice_{self.voice})", *_PHRASES, *body, "(utt.synth utt)",
                                         f'(utt.save.wave utt "{wav}" \'riff)', _PRINT]), encoding="utf-8")
            printed = run(["festival", "-b", str(script)], self.name)
            samples, rate = read_wav(wav, self.name)
        if alignment is not None:
            return Speech(fitted(samples, rate, alignment), rate, alignment)
        ends = [(name, float(end)) for name, end in re.findall(r"^SEG (\S+) (\S+)$", printed, re.MULTILINE)]
        timed = matched(sentence, segments(ends, len(samples) / rate), self.name)
        return Speech(fitted(samples, rate, timed), rate, timed)


def segments(ends: Sequence[tuple[str, float]], length: float) -> list[Segment]:
    """Return an engine's phones in our labels from their end times in seconds; the last one ends with the sound."""
    rows: list[Segment] = []
    for name, end in [*ends, (_PAUSE, length)]:
        start = rows[-1].end if rows else 0.0
        if end > start + 1e-6:
            rows.append(Segment(start, end, ours(name)))
    return rows


def has_voice(name: str) -> bool:
    """Return whether Festival has a voice of that name."""
    roots = [Path(root) for root in _ROOTS]
    program = shutil.which("festival")
    if program:
        roots.append(Path(program).resolve().parent.parent / "lib" / "voices")
    return any(next(root.glob(f"*/{name}"), None) is not None for root in roots if root.is_dir())


def _text_script(sentence: Sentence) -> list[str]:
    """Return commands that put our pronunciations into the lexicon and make the utterance."""
    names: dict[tuple[str, tuple[str, ...]], str] = {}
    used: dict[str, tuple[str, ...]] = {}
    text = []
    for word in sentence.words:
        key = (word.spoken, word.phones)
        if key not in names:
            plain = re.sub("[^a-z]", "", word.spoken)
            taken = plain != word.spoken or len(plain) < 2 or plain in used
            names[key] = f"q{_letters(len(names))}{plain}" if taken else plain  # a word of its own for each sound
            used[names[key]] = word.phones
        text.append(names[key] + _BREAKS[word.break_after])
    entries = [f"(lex.add.entry '(\"{name}\" nil ({_syllables(Word('', '', phones, ''))})))"
               for name, phones in used.items()]
    return [*entries, f'(set! utt (Utterance Text "{" ".join(text)}"))']


def _letters(number: int) -> str:
    """Return a number as letters, so that no part of a made-up word is read as a number."""
    return "".join("bcdfghklmn"[int(c)] for c in str(number))


def _syllables(word: Word) -> str:
    """Return phones as Festival's lexicon writes them: syllables with their stress."""
    starts = syllable_starts(word.phones)
    cut = [word.phones[a:b] for a, b in zip(starts, [*starts[1:], None], strict=True)]
    return " ".join(f"(({' '.join(map(theirs, part))}) {int(any(p[-1] == '1' for p in part))})" for part in cut)


def _segment_script(alignment: Alignment) -> list[str]:
    """Return a command that makes an utterance of segments with their durations, and pitch in their middles."""
    tier = alignment["phones"]
    middles = np.array([(s.start + s.end) / 2 for s in tier])
    hertz = pitch(alignment, middles, 105.0)
    rows = []
    for segment, at in zip(tier, hertz, strict=True):
        target = f" ({segment.duration / 2:.4f} {at:.1f})" if segment.label in (*VOWELS, *SILENCES) else ""
        rows.append(f"({theirs(segment.label)} {segment.duration:.4f}{target})")
    return [f"(set! utt (Utterance Segments ({' '.join(rows)})))"]
