"""Texts that nobody meant to be spoken: they are spoken sensibly, or refused with the piece named."""

import pytest

from dnnvss.errors import DnnvssError
from dnnvss.text.sentence import parse


def spoken(text: str) -> list[str]:
    return [w.spoken for w in parse(text).words]


def test_ten_thousand_characters() -> None:
    text = "The wind is strong, so wind the clock at 10:45. " * 209
    assert len(text) > 10_000
    words = parse(text).words
    assert len(words) == 209 * 12
    assert [w.phones for w in words[:12]] == [w.phones for w in words[-12:]]
    assert sum(w.break_after == "major" for w in words) == 209


@pytest.mark.parametrize(("text", "piece"), [
    ("good \N{GRINNING FACE} morning", "U+1F600, grinning face"),
    ("say \u041f\u0440\u0438\u0432\u0435\u0442 now", "U+041F, cyrillic capital letter pe"),
    ("say \u4f60\u597d now", "U+4F60"),
    ("say \u0645\u0631\u062d\u0628\u0627", "U+0645, arabic letter meem"),
    ("ring \x07 bell", "U+0007, a control character"),
    ("nul \x00 here", "U+0000, a control character"),
    ("a {W AY1 N", "brace is not closed"),
    ("{QQ}", "unknown phones QQ"),
    ("a" * 61, "more than 60 letters"),
])
def test_what_cannot_be_spoken_is_named(text: str, piece: str) -> None:
    with pytest.raises(DnnvssError) as caught:
        parse(text)
    assert piece in str(caught.value) and caught.value.remedy


@pytest.mark.parametrize(("text", "words"), [
    ('<speak>Hello <break time="500ms"/> <emphasis>you</emphasis></speak>', "hello you"),
    ("\n\n\nHello.\n\n\nYou.\n\n", "hello you"),
    ("for (i = 0; i < 3; i++)", "for i equals zero i less than three i plus plus"),
    ("snake_case and CamelCase", "snake case and camel case"),
    ("\u201cHello,\u201d he said\u2026", "hello he said"),
    ("caf\u00e9 na\u00efve", "cafe naive"),
    ("zero\u200bwidth\ufeff", "zero width"),
    ("a soft\u00adened \u2066word\u2069", "a softened word"),
])
def test_what_can_be_spoken_is(text: str, words: str) -> None:
    assert " ".join(spoken(text)) == words


def test_pause_of_ssml_is_kept() -> None:
    assert parse('Hello <break time="500ms"/> you').words[0].pause == 0.5
