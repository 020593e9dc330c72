"""Text that went through a wrong decoding, or that a program escaped, is said as it was written."""

import pytest

from dnnvss.text.mangled import mended
from dnnvss.text.sentence import parse

WRITTEN = "it\u2019s a \u2018na\u00efve\u2019 caf\u00e9 \u2013 20\u00b0 \u2014 \u00a35\u2026 \u20ac3\u2122"


@pytest.mark.parametrize("wrong", ["cp1252", "latin-1"])
def test_utf8_that_was_read_as_another_encoding_is_mended(wrong: str) -> None:
    assert mended(WRITTEN.encode().decode(wrong)) == WRITTEN


@pytest.mark.parametrize("text", [WRITTEN, "\u201ccaf\u00e9\u201d\u2026", "\u201cKALL\u00c5\u201d is \u00c4pfel",
                                  "\u00e2me \u00e0 \u00c3o", r"C:\users\tom", "plain"])
def test_text_that_is_well_stays(text: str) -> None:
    assert mended(text) == text


def test_escapes_and_the_quote_without_a_sign_are_mended() -> None:
    assert mended(r"it\'s \"so\" don\u2019t") == "it's \"so\" don\u2019t"
    for quoted in ("\u00e2\u20ac\u0153so\u00e2\u20ac\x9d", "\u00e2\u20ac\u0153so\u00e2\u20ac"):
        assert mended(quoted) == "\u201cso\u201d"
    assert [w.spoken for w in parse("it\u00e2\u20ac\u2122s caf\u00c3\u00a9").words] == ["it's", "cafe"]


def test_ends_of_lines_that_were_escaped_are_ends_of_lines() -> None:
    assert mended(r"Hello.\nHow\tare you?\r\nI am") == "Hello.\nHow are you?\nI am"
    assert mended(r"\\server\new") == r"\\server\new"
