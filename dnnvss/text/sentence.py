"""Any English text to phones: :func:`parse` and the pronunciation report."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from dnnvss.errors import DnnvssError
from dnnvss.phones import VOWELS, strip_stress
from dnnvss.text import homographs, lexicon, network
from dnnvss.text.lexicon import Overrides
from dnnvss.text.normalise import tokens
from dnnvss.text.tokens import Token, word_set
from dnnvss.text.variants import british

Phones = tuple[str, ...]

_WEAK = word_set(
    "a an the of to and or but for at by in on from with as than that is are was were be been am i'm he "
    "she it we they you his her its my your our their him them us me do does can could will would shall "
    "should must have has had if so not"
)
_DIGITS = word_set("zero one two three four five six seven eight nine ten")


@dataclass(frozen=True)
class Word:
    """A spoken word.

    Args:
        written: the piece of the text that it stands for; one piece may be several words (``10:45``).
        spoken: the word in lower case; the name of a letter is the letter.
        phones: with stress digits on the vowels.
        source: where the pronunciation comes from: inline, override, letter, homograph (with its tag and rule),
            lexicon, en_gb table or rule, network.
        doubt: what is uncertain, empty if nothing.
        break_after: ``none``, ``minor`` (a phrase ends) or ``major`` (a sentence ends).
        emphasis: emphasised in the text.
        pause: seconds of a pause that the text asks for, None if it does not.
        rate: how fast the text asks for it, 1 as usual.
    """

    written: str
    spoken: str
    phones: Phones
    source: str
    doubt: str = ""
    break_after: str = "none"
    emphasis: bool = False
    pause: float | None = None
    rate: float = 1.0

    def choices(self, variant: str = "en_us") -> list[Phones]:
        """Return the pronunciations without stress that a recording may choose among, the word's own first.

        What the user or the context fixed stays fixed.
        """
        own = tuple(strip_stress(p) for p in self.phones)
        others = lexicon.pronunciations(self.spoken, variant) if self.source == "lexicon" else []
        return list(dict.fromkeys([own, *others]))


@dataclass(frozen=True)
class Sentence:
    """A text and its words, at least one.

    Args:
        text: as written.
        words: in order.
        pause_before: seconds of a pause that the text asks for before its first word, 0 if it does not.
    """

    text: str
    words: tuple[Word, ...]
    pause_before: float = 0.0

    @property
    def pause_after(self) -> float:
        """Seconds of a pause that the text asks for after its last word, 0 if it does not."""
        return self.words[-1].pause or 0.0

    @property
    def timed(self) -> bool:
        """Whether the text itself sets times: a pause between words, or words that are quicker or slower."""
        return any(word.pause is not None for word in self.words[:-1]) or any(word.rate != 1 for word in self.words)

    def report(self) -> list[dict[str, str]]:
        """Return the pronunciation report: for each word what was written, said, from where, and what is doubtful."""
        return [{"written": w.written, "spoken": w.spoken, "phones": " ".join(w.phones), "source": w.source,
                 "doubt": w.doubt} for w in self.words]

    @property
    def phones(self) -> Phones:
        """All phones in order, without stress digits."""
        return tuple(strip_stress(p) for w in self.words for p in w.phones)


def parse(text: str, variant: str = "en_us", overrides: Overrides | None = None) -> Sentence:
    """Return the words of a text with their pronunciations.

    Pronunciations come, in this order, from phones in the text (``{W AY1 N D}``), ``overrides``, names of letters, the
    table of homographs, the lexicon of the variant, words derived from it, the network.

    Args:
        text: any English text. ``[pause]`` or ``[pause 500ms]`` asks for a pause, ``*word*`` for emphasis.
        variant: ``"en_us"`` or ``"en_gb"``.
        overrides: word in lower case to phones, before everything but phones in the text.

    Raises:
        DnnvssError: there is no word to speak, a piece cannot be spoken, or the variant or an override is wrong; the
            message names the piece.
    """
    pieces = tokens(text, variant)
    pause_before = pieces.pop(0).pause if pieces and not pieces[0].words else None
    if not pieces:
        raise DnnvssError(f"there is no word to speak in {text[:40]!r}",
                          remedy="Write at least one English word or number")
    known = {word.lower(): phones for word, phones in (overrides or {}).items()}
    spoken = [word for token in pieces for word in token.words]
    chosen = _homographs(pieces, known, variant)
    words: list[Word] = []
    for token in pieces:
        for i, word in enumerate(token.words):
            at = len(words)
            following = spoken[at + 1] if at + 1 < len(spoken) else ""
            made = _word(token, word, variant, known, chosen.get(at))
            words.append(made if i == len(token.words) - 1 else replace(made, break_after="none", pause=None))
            words[-1] = _letter_a(words, following)
    return Sentence(text, _in_context(words), pause_before or 0.0)


@lru_cache(maxsize=4096)
def spoken_words(text: str, variant: str = "en_us") -> tuple[tuple[str, bool], ...]:
    """Return the words that are said for a text, each with whether a phrase ends after it; nothing raises.

    What cannot be spoken is passed over.
    """
    found: list[tuple[str, bool]] = []
    for token in tokens(text, variant, lenient=True):
        found += [(word.lower(), False) for word in token.words]
        if token.words and token.brk != "none":
            found[-1] = (found[-1][0], True)
    return tuple(found)


def _homographs(pieces: Sequence[Token], overrides: Mapping[str, object], variant: str
                ) -> dict[int, homographs.Reading]:
    """Return the choices for the words that are homographs, by the word's position."""
    sequence: list[str] = []
    places: list[int] = []
    for token in pieces:
        for word in token.words:
            places.append(len(sequence))
            sequence.append(word)
        sequence += [","] if token.brk == "minor" else ["."] if token.brk == "major" else []
    wanted = [n for n, at in enumerate(places) if homographs.rules_of(sequence[at]) and sequence[at] not in overrides]
    if not wanted:
        return {}
    tag = _tagged(sequence)
    found = {n: homographs.choose(sequence, places[n], tag, variant) for n in wanted}
    return {n: choice for n, choice in found.items() if choice is not None}


def _tagged(sequence: list[str]) -> list[str]:
    """Return the tags of a text, tagged sentence by sentence."""
    tag: list[str] = []
    start = 0
    for end, word in enumerate(sequence, 1):
        if word == "." or end == len(sequence):
            tag += homographs.tags(sequence[start:end])
            start = end
    return tag


def _word(token: Token, word: str, variant: str, overrides: Overrides, choice: homographs.Reading | None) -> Word:
    spoken = word.lower()

    def made(phones: Phones, source: str, doubt: str = "") -> Word:
        return Word(token.written, spoken, phones, source, doubt or token.doubt, token.brk, token.emphasis, token.pause,
                    token.rate)

    if token.phones is not None:
        return made(with_stress(spoken, token.phones), "inline")
    if spoken in overrides:
        return made(with_stress(spoken, lexicon.check_phones(overrides[spoken], spoken)), "override")
    if len(word) == 1 and word.isupper():
        return made(with_stress(spoken, lexicon.letter_name(spoken, variant)), "letter")
    if choice is not None:
        phones = _british(spoken, choice.phones) if variant == "en_gb" else choice.phones
        return made(phones, f"homograph ({choice.rule})", choice.doubt)
    entry = lexicon.entries(word, variant)[0]
    return made(with_stress(spoken, entry.phones), entry.source, entry.doubt)


def _british(word: str, phones: Phones) -> Phones:
    """Return phones with stress after the British rules for vowels and glides."""
    bare = tuple(strip_stress(p) for p in phones)
    changed = next((p for p, source in british(word, [bare], lexicon.looked_up) if source == "en_gb rule"), bare)
    digits = iter([p[-1] for p in phones if p[-1].isdigit()])
    return tuple(p + next(digits) if p in VOWELS else p for p in changed)


def with_stress(word: str, phones: Phones) -> Phones:
    """Return the phones of a word with stress digits; digits that are there are kept, weak words get 0.

    Args:
        word: in lower case.
        phones: with or without digits.
    """
    if any(p[-1].isdigit() for p in phones):
        return tuple(p if p not in VOWELS else p + "0" for p in phones)
    if word in _WEAK and sum(p in VOWELS for p in phones) == 1:
        return tuple(p + "0" if p in VOWELS else p for p in phones)
    return network.stress(word, phones)


def _letter_a(words: list[Word], following: str) -> Word:
    """Return the last word, with *a* turned into the letter's name where a bare digit follows (*at a nine now*)."""
    word = words[-1]
    prepositions = ("at", "by", "in", "with")
    if word.spoken == "a" and word.source == "lexicon" and following in _DIGITS and len(words) > 1 and (
            words[-2].spoken in prepositions):
        return replace(word, phones=("EY1",), source="letter", doubt="read as the letter: a digit follows")
    return word


def _in_context(words: list[Word]) -> tuple[Word, ...]:
    """Return the words with *the* as DH IY before a vowel."""
    out = list(words)
    for i, word in enumerate(words[:-1]):
        if word.spoken == "the" and word.source == "lexicon" and strip_stress(words[i + 1].phones[0]) in VOWELS and (
                word.break_after == "none"):
            out[i] = replace(word, phones=("DH", "IY0"))
    return tuple(out)
