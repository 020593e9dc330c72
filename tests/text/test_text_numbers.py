"""Numbers in words."""

import pytest

from dnnvss.text import numbers


@pytest.mark.parametrize(("number", "american", "british"), [
    (0, "zero", "zero"), (13, "thirteen", "thirteen"), (40, "forty", "forty"), (99, "ninety nine", "ninety nine"),
    (105, "one hundred five", "one hundred and five"), (700, "seven hundred", "seven hundred"),
    (1005, "one thousand five", "one thousand and five"),
    (12_345, "twelve thousand three hundred forty five", "twelve thousand three hundred and forty five"),
    (1_000_000, "one million", "one million"), (2_000_001, "two million one", "two million and one"),
    (-7, "minus seven", "minus seven"),
])
def test_cardinals(number: int, american: str, british: str) -> None:
    assert " ".join(numbers.cardinal(number)) == american
    assert " ".join(numbers.cardinal(number, british=True)) == british


def test_cardinals_are_all_different_and_have_no_scale_left_out() -> None:
    said = {" ".join(numbers.cardinal(n)) for n in range(0, 20_000, 7)}
    assert len(said) == len(range(0, 20_000, 7))
    assert numbers.cardinal(10**21)[:3] == ["one", "zero", "zero"] and len(numbers.cardinal(10**21)) == 22


@pytest.mark.parametrize(("number", "words"), [
    (1, "first"), (2, "second"), (3, "third"), (8, "eighth"), (12, "twelfth"), (20, "twentieth"), (42, "forty second"),
    (100, "one hundredth"), (111, "one hundred eleventh"),
])
def test_ordinals(number: int, words: str) -> None:
    assert " ".join(numbers.ordinal(number)) == words


@pytest.mark.parametrize(("number", "words"), [
    (1066, "ten sixty six"), (1800, "eighteen hundred"), (1905, "nineteen oh five"), (1984, "nineteen eighty four"),
    (2000, "two thousand"), (2009, "two thousand nine"), (2010, "twenty ten"), (2024, "twenty twenty four"),
    (800, "eight hundred"),
])
def test_years(number: int, words: str) -> None:
    assert " ".join(numbers.year(number)) == words


@pytest.mark.parametrize(("sign", "amount", "scale", "words"), [
    ("$", "1", "", "one dollar"), ("$", "1.50", "", "one dollar and fifty cents"), ("$", "0.01", "", "one cent"),
    ("£", "3.20", "", "three pounds twenty"), ("€", "1,000", "", "one thousand euros"),
    ("$", "2.5", "million", "two point five million dollars"), ("¥", "500", "", "five hundred yen"),
    ("£", "0.99", "", "ninety nine pence"),
])
def test_money(sign: str, amount: str, scale: str, words: str) -> None:
    assert " ".join(numbers.money(sign, amount, scale)) == words


def test_decimals_fractions_decades_romans() -> None:
    assert numbers.number("-1,234.50")[-4:] == ["four", "point", "five", "zero"]
    assert numbers.number("007") == ["zero", "zero", "seven"]
    assert numbers.fraction(3, 4) == ["three", "quarters"] and numbers.fraction(1, 3) == ["one", "third"]
    assert numbers.decade(1990) == ["nineteen", "nineties"] and numbers.decade(1900) == ["nineteen", "hundreds"]
    assert [numbers.roman(r) for r in ("II", "IV", "IX", "XIV", "XXXIX")] == [2, 4, 9, 14, 39]
    assert not any(map(numbers.roman, ("IIII", "I", "MIX")))
