"""Text as it is written to words as they are spoken: one scan from left to right, the first rule that fits wins."""

import re
import unicodedata
from dataclasses import replace
from functools import lru_cache

from dnnvss.errors import DnnvssError
from dnnvss.formats.unsaid import HEARD
from dnnvss.text import derive, numbers, quantities, wording
from dnnvss.text.dates import in_order
from dnnvss.text.lexicon import check_phones, name_of
from dnnvss.text.mangled import mended
from dnnvss.text.markup import PLAIN, Piece, pieces_of
from dnnvss.text.signs import plain_signs, visible
from dnnvss.text.tokens import Token, table, word_set
from dnnvss.text.variants import VARIANTS
from dnnvss.text.wording import Place

_SPACE = re.compile(r"(?:\s|\u200b)+")
_PHONES = re.compile(r"\{([^{}]*)\}")
_PAUSE = re.compile(r"\[pause(?:\s+(?P<n>\d+(?:\.\d+)?)\s*(?P<unit>ms|s))?\]"
                    r"|\[\[\s*slnc\s+(?P<ms>\d+)\s*\]\]", re.IGNORECASE)
"""A pause as it is written here, or as macOS has it."""
_EMPHASIS = re.compile(r"(?<![\w*])(\*{1,3})(?=[^\s*])([^*\n]*[^\s*])\1(?!\w)"
                       r"|(?<!\w)(_{1,2})(?=[^\s_])([^_\n]*[^\s_])\3(?!\w)")
_ELIDED = re.compile(r"['\u2019](?:\d\ds|em|til|cause|tis|twas|bout|round|n['\u2019]?)(?!\w)", re.IGNORECASE)
_QUANTITY = re.compile(r"['\u2019+\-\u2212\u2013(.$£¥\u20a0-\u20bf\u0e3f]*\d|[-\u2212\u2013]?[$£¥\u20a0-\u20bf\u0e3f]"
                       r"|[\^½⅓⅔¼¾⅛]|[A-Z]{1,2}\$\s?\d|Rs\.?\s?\d|[A-Za-z]{3,9}\.?\s(?:the\s)?\d|the\s\d",
                       re.IGNORECASE)
_NUMBERED = re.compile(r"[^\s(]$|[\d%]\s$")
"""What stands before a dash that is no sign of a negative number."""
_AHEAD = 1000  # letters after a piece that may tell how it is read
_BULLETS = "\u2022\u2023\u25aa\u25a0\u25cf\u25e6\u25cb\u25ba\u25b6\u25c6\u27a4\u2713\u2714"
_SHARP = re.compile(r"\b[A-G]$")
_MAJOR = re.compile(r"[.!?\u2026\u203d\u00a1\u00bf]+")
_MINOR = re.compile(rf"(?:(?!{quantities.BRACKETED})[,;:()\[\]\u2013\u2014\u2012\u2015\u00b7{_BULLETS}])+"
                    r"|-{2,}|-(?=\s|$)|(?<=\s)-|(?<!\S)\|+(?!\S)")
_EMOTICON = re.compile(r"(?<!\S)(?:[:;][-'^]?[DPpOo3SsXx|/\\*)(\]\[]+|\^_*\^|-_+-|[oO]_+[oO]|T_+T|>_+<)(?![\w/])")
"""A face of signs and letters that stands alone."""
_SILENT = re.compile(r"~{2,}|={3,}|(?<![^\n])>+(?=\s)|[\u2020\u2021\u266a-\u266c]"
                     r"|[\"'\u2018\u2019\u201a-\u201f\u00ab\u00bb\u2039\u203a`\u00b4/*_#-]")
"""Quotes, and what frames a text: strokes, lines, marks of a citation or a footnote, notes around what is sung."""
_DOT = re.compile(r"\.(?P<name>[a-z0-9]{1,5})(?!\w)|(?<!\S)\.(?=[a-z]{2}|[A-Z]{2})")
"""A dot within the name of a file or of a program (*notes.txt*, *.NET*)."""
_ENDINGS = word_set("exe doc docx zip bin log json html java jpeg gif ini dat iso tar")


def tokens(text: str, variant: str = "en_us", lenient: bool = False) -> list[Token]:
    """Return the pieces of a text with the words that are said for them, in order.

    A pause of so many seconds before the first word is a piece without words.

    Args:
        text: anything; line breaks count as spaces, an empty line ends a sentence.
        variant: ``en_us`` or ``en_gb``: order of dates, *and* in numbers.
        lenient: pass over what cannot be spoken instead of raising.

    Raises:
        DnnvssError: an unknown variant; a piece that cannot be spoken (a control character, another script, an emoji,
            braces without phones, a word longer than sixty letters), which the message names.
    """
    if variant not in VARIANTS:
        raise DnnvssError(f"unknown variant {variant!r}", remedy=f"Use one of: {', '.join(VARIANTS)}")
    found: list[Token] = []
    pieces = [piece if piece.reading.phones else replace(piece, text=plain_signs(piece.text))
              for piece in pieces_of(visible(mended(text)), lenient)]
    shouting = _shouting(" ".join(piece.text for piece in pieces))
    for piece in pieces:
        if not piece.text:
            _break(found, piece.brk, piece.pause)
        elif piece.reading == PLAIN:
            _scan(piece.text, variant == "en_gb", shouting, lenient, found)
        else:
            _read(piece, variant == "en_gb", shouting, lenient, found)
    return found


def _read(piece: Piece, british: bool, shouting: bool, lenient: bool, found: list[Token]) -> None:
    """Read a piece of text as the tags around it ask for."""
    how, inner = piece.reading, list[Token]()
    british = how.dates.startswith("dm") or (british and not how.dates.startswith("md"))
    if how.phones:
        phones = check_phones(how.phones, piece.text)
        inner = [Token(how.written, (name_of(phones),), phones=phones)]
    elif how.spelt:
        inner = [Token(sign, tuple(said)) for sign in piece.text if (said := _spelt(sign))]
    else:
        text = _RANK.sub(r"\1th", piece.text) if how.ordinal else piece.text
        text = _YEAR.sub(lambda m: f"{int(m[0]):,}", text) if how.counted else text
        text = in_order(text, how.dates or ("yyyymmdd" if how.dated and _EIGHT.fullmatch(text) else ""))
        _scan(text, british, shouting, lenient, inner)
    if inner and not inner[0].words:
        _break(found, "major", inner.pop(0).pause)
    if how.ordinal:
        inner = [_as_rank(token, british) for token in inner]
    found += [replace(token, emphasis=token.emphasis or how.emphasis, rate=how.rate, doubt=how.doubt or token.doubt,
                      written=how.written or token.written) for token in inner]


_YEAR = re.compile(r"(?<![\d.,])[1-9]\d{3,11}(?![\d,])")
"""A number without signs between its thousands."""
_EIGHT = re.compile(r"\s*(?:1[5-9]|20)\d{6}\s*")
"""A date of eight digits."""
_RANK = re.compile(r"\b(\d{1,12})\b(?!\s*th)")


def _as_rank(token: Token, british: bool) -> Token:
    """A number that is a rank, whatever its last digit."""
    number = re.fullmatch(r"(\d{1,12})th", token.written)
    return replace(token, words=tuple(numbers.ordinal(int(number[1]), british))) if number else token


def _spelt(sign: str) -> list[str]:
    """The name of a letter, a digit or another sign; nothing for what has none."""
    letter = derive.plain(sign)
    if letter.isalpha():
        return list(letter.upper())
    if sign.isascii() and sign.isdigit():
        return numbers.digits(sign)
    return table("symbols").get(sign, ("",))[0].split()


def _scan(text: str, british: bool, shouting: bool, lenient: bool, found: list[Token]) -> None:
    at = 0
    while at < len(text):
        end = _punctuation(text, at, lenient, found)
        if end is None:
            end = _spoken(text, at, british, shouting, lenient, found)
        if end is None:
            if not lenient and text[at] not in "-\u2010\u2011":  # a hyphen that joins nothing
                raise _unspeakable(text, at)
            word = wording.WORD.match(text, at)
            end = word.end() if word else at + 1
        at = end


def _shouting(text: str) -> bool:
    words = re.findall(r"[A-Za-z]{2,}", text)
    return len(words) > 1 and sum(w.isupper() for w in words) > 0.6 * len(words)


def _punctuation(text: str, at: int, lenient: bool, found: list[Token]) -> int | None:
    """Read a space, pause, tag or sign of punctuation at a position; return where it ends, None if none is there."""
    if match := _SPACE.match(text, at):
        if match[0].count("\n") > 1:
            _break(found, "major")
    elif match := _PHONES.match(text, at):
        try:
            phones = check_phones(match[1], match[0])
            found.append(Token(match[0], (name_of(phones),), phones=phones))
        except DnnvssError:
            if not lenient:
                raise
    elif match := _PAUSE.match(text, at):
        number, unit = match["n"] or match["ms"], match["unit"] or "ms"
        _break(found, "major", float(number) / (1000 if unit == "ms" else 1) if number else None)
    elif match := HEARD.match(text, at) or _EMOTICON.match(text, at):
        _break(found, "minor")
    elif _quiet_sign(text, at) and (match := _SILENT.match(text, at)):
        pass
    elif match := _dot(text, at):
        found.append(Token(".", ("dot",)))
    elif match := _MAJOR.match(text, at):
        if re.match(r"\.\d", text[at : at + 2]):
            return None  # .5 is a number
        _break(found, "major")
    elif match := _MINOR.match(text, at):
        if match[0] == "-" and re.match(r"-[\d.$£€]", text[at : at + 2]):
            return None  # a minus sign
        if match[0] == "\u2013" and text[at + 1 : at + 2].isdigit() and not _NUMBERED.search(text[max(at - 3, 0) : at]):
            return None  # a dash for one
        _break(found, "minor")
    return match.end() if match else None


def _quiet_sign(text: str, at: int) -> bool:
    """Return whether the sign at a position says nothing: quotes, and what joins two words or frames one."""
    sign, before, after = text[at], text[max(at - 1, 0) : at], text[at + 1 : at + 2]
    alone = not after.strip() or sign in (before, after)
    if sign in "/-_" and before.isalnum() and after.isalnum():
        return True  # and/or, snake_case
    if sign in "/-":
        return False
    if sign == "#":
        return not _SHARP.search(text[max(at - 3, 0) : at]) and (alone or after.isalpha())
    if sign == "*" and re.match(r"\d\s?\*\s?\d", text[max(at - 2, 0) : at + 3].strip()):
        return False  # a product
    if sign in "*_":
        return alone or (sign == "_" and not before.strip())
    return not (sign in "'\u2019" and after.isalnum() and not before.isalnum() and _elided(text, at))


def _dot(text: str, at: int) -> re.Match[str] | None:
    """The dot at a position, where it is read as one: none where it ends a sentence or stands in a number."""
    match = _DOT.match(text, at)
    if match is None or (name := match["name"]) is None:
        return match
    inner = text[at - 1 : at].isalnum() and not name.isdigit()
    return re.compile(r"\.").match(text, at) if inner and (name in _ENDINGS or not wording.is_word(name)) else None


def _elided(text: str, at: int) -> bool:
    """Return whether an apostrophe begins a word (*'em*, *'90s*) rather than a quotation."""
    return bool(_ELIDED.match(text, at))


def _break(found: list[Token], brk: str, pause: float | None = None) -> None:
    if found:
        found[-1] = found[-1].broken(brk, pause)
    elif pause is not None:
        found.append(Token("", (), brk, pause=pause))


@lru_cache(maxsize=1)
def _quantity_rules() -> list[quantities.Rule]:
    return quantities.rules()


def _spoken(text: str, at: int, british: bool, shouting: bool, lenient: bool, found: list[Token]) -> int | None:
    """Read what is said at a position; return where it ends, None if nothing can be said."""
    if match := _EMPHASIS.match(text, at):
        inner: list[Token] = []
        _scan(match[2] or match[4], british, shouting, lenient, inner)
        if found and inner and not inner[0].words:
            _break(found, "major", inner.pop(0).pause)
        found += [replace(token, emphasis=True) for token in inner]
        return match.end()
    if text[at].isdigit() and not text[at].isascii():
        return None if text[at] not in table("symbols") else _symbol(text, at, found)
    if (end := _by_number(text, at, british, found)) is not None:
        return end
    before = found[-1].written if found and found[-1].brk == "none" else ""
    joined = at > 0 and text[at - 1] in "/&"
    for pattern, rule in wording.RULES:
        if match := pattern.match(text, at):
            said = rule(match, Place(before, _after(match), british, shouting, joined))
            if said is not None:
                return _add(found, match, said)
    return _symbol(text, at, found)


def _after(match: re.Match[str]) -> str:
    """The text that follows a piece, as far as it matters."""
    return match.string[match.end() : match.end() + _AHEAD]


def _by_number(text: str, at: int, british: bool, found: list[Token]) -> int | None:
    if not _QUANTITY.match(text, at):
        return None
    for pattern, rule in _quantity_rules():
        if match := pattern.match(text, at):
            said = rule(match, british)
            if said is not None:
                return _add(found, match, said)
    return None


def _add(found: list[Token], match: re.Match[str], said: list[str] | list[Token]) -> int:
    if said and isinstance(said[0], Token):
        found += said  # type: ignore[arg-type]
    elif said:
        found.append(Token(match[0], tuple(said)))  # type: ignore[arg-type]
    end = match.end()
    if match[0].endswith(".") and said and isinstance(said[0], str) and wording.ends_sentence(_after(match)):
        _break(found, "major")  # the dot of "5 p.m." at the end of a sentence
    return end


def _symbol(text: str, at: int, found: list[Token]) -> int | None:
    sharp = text[at] == "#" and _SHARP.search(text[max(at - 3, 0) : at])
    product = text[at] == "*" and not _quiet_sign(text, at) and re.match(r"\s?\d", text[at + 1 : at + 3])
    divided = text[at] == "/" and re.match(r"\d\s/\s\d", text[max(at - 2, 0) : at + 3])
    entry = (("sharp",) if sharp else ("times",) if product else ("divided by",) if divided
             else table("symbols").get(text[at]))
    if entry is None:
        return None
    found.append(Token(text[at], tuple(entry[0].split())))
    return at + 1


def _unspeakable(text: str, at: int) -> DnnvssError:
    sign = text[at]
    piece = re.match(r"\S{1,40}", text[at:])
    name = unicodedata.name(sign, "a control character" if unicodedata.category(sign) == "Cc" else "unnamed")
    what = repr(piece[0] if piece and sign.isprintable() else sign)
    if sign == "{":
        return DnnvssError(f"cannot speak {what}: the brace is not closed", remedy="Write phones as {W AY1 N D}")
    if (word := wording.WORD.match(text, at)) and len(word[0]) > wording.LONGEST and sign.isascii():
        return DnnvssError(f"cannot speak {what}...: a word of more than {wording.LONGEST} letters",
                           remedy="Split it with spaces or hyphens")
    foreign = wording.foreign_letter(word[0]) if word else ""
    if foreign:
        sign, name = foreign, unicodedata.name(foreign, "unnamed")
    return DnnvssError(f"cannot speak {what} (U+{ord(sign):04X}, {name.lower()})",
                       remedy="Remove it or write it in English words")
