"""Text as written to words as spoken."""

import pytest

from dnnvss.errors import DnnvssError
from dnnvss.text.normalise import tokens


def said(text: str, variant: str = "en_us") -> str:
    """Words, ``,`` after a minor and ``.`` after a major break."""
    marks = {"none": "", "minor": ",", "major": "."}
    return " ".join(" ".join(t.words) + marks[t.brk] for t in tokens(text, variant))


@pytest.mark.parametrize(("text", "words"), [
    ("It's 10:45 a.m.", "it's ten forty five A M."),
    ("Meet at 7:00, 9:05pm or 8 am", "meet at seven o'clock, nine oh five P M or eight A M"),
    ("on March 3, 2021", "on march third twenty twenty one"),
    ("the 3rd of May", "the third of may"),
    ("12/25/2020 and 2021-03-05", "december twenty fifth twenty twenty and march fifth twenty twenty one"),
    ("$1,234.50 (about 12.5%)", "one thousand two hundred thirty four dollars and fifty cents, about twelve point five "
                                "percent,"),
    ("$3bn, 50p, $1.5 million", "three billion dollars, fifty pence, one point five million dollars"),
    ("Dr. Smith of St. John's on Main St. in Elm Dr.", "doctor smith of saint john's on main street in elm drive."),
    ("Mr. and Mrs. Jones vs. Acme Inc. The end", "mister and mrs jones versus acme incorporated. the end"),
    ("e.g. the U.S. Army, i.e. J. K. Rowling", "for example the U S army, that is J K rowling"),
    ("Henry VIII in World War II", "henry the eighth in world war two"),
    ("the 1990s and the '80s", "the nineteen nineties and the eighties"),
    ("10-15 people in 2019\u20132021", "ten to fifteen people in twenty nineteen to twenty twenty one"),
    ("1/2, 3/4, 2½, 24/7", "one half, three quarters, two and a half, twenty four seven"),
    ("60 km/h at -5 °C", "sixty kilometers per hour at minus five degrees celsius"),
    ("a 3D 4K MP3, B2B, F-16, covid-19", "a three D four K M P three, B two B, F sixteen, covid nineteen"),
    ("a 10-year-old from the mid-1990s", "a ten year old from the mid nineteen nineties"),
    ("NASA, the FBI, CDs, IT and US", "nasa, the fbi, C d's, I T and U S"),
    ("PLACE RED AT G NINE NOW", "place red at G nine now"),
    ("www.example.com/page-1", "W W W dot example dot com slash page dash one"),
    ("write to john.smith@mail.co.uk!", "write to john dot smith at mail dot co dot U K."),
    ("Call 555-123-4567", "call five five five, one two three, four five six seven"),
    ("vitamin A, A dog, point A to point B", "vitamin A, a dog, point A to point B"),
    ("co-op, well-known, X-ray, half-eaten", "co-op, well-known, x-ray, half eaten"),
    ("rock 'n' roll, 'em, 'quoted' and “quoted”", "rock and roll, 'em, quoted and quoted"),
    ("5 + 3 = 8 & more", "five plus three equals eight and more"),
    ("No. 5 and #5; no. Not that.", "number five and number five, no. not that."),
    ("I sat. The sun. Wed., Jan. 5", "i sat. the sun. wednesday, january fifth"),
    ("the year 1066, 90210, 007, 0.5", "the year ten sixty six, ninety thousand two hundred ten, zero zero seven, zero "
                                       "point five"),
    ("Wait... really?! Yes—no", "wait. really. yes, no"),
    ("naïve café ﬁne Zürich", "naive cafe fine zurich"),
    ("line one\nline two\n\nline three", "line one line two. line three"),
    ("<speak>Hi <b>there</b><break time=\"200ms\"/> you</speak>", "hi there. you"),
    ("E = mc², a Ph.D. at AT&T in C# or F# minor",
     "E equals mc squared, a P H D at A T and T in C sharp or F sharp minor"),
    ("hello--world, \"-x\" -- (-5) or -y", "hello, world, X, minus five, or, Y"),
    ("Call (555) 123-4567 (020) 7946 0958 (2020) 5",
     "call five five five, one two three, four five six seven zero two zero, seven nine four six, zero nine five "
     "eight, twenty twenty, five"),
    ("$5-$10, $5 - $10, $5\u2013$10 million, $1.50-$2, £5-6",
     "five to ten dollars, five to ten dollars, five to ten million dollars, "
     "one dollar and fifty cents to two dollars, five to six pounds"),
    ("5%-10%, 5kg-10kg, 100€-200€, 5%-$3, -$4",
     "five to ten percent, five to ten kilograms, one hundred to two hundred euros, "
     "five percent three dollars, minus four dollars"),
    ("You may 5 times. We march 10 miles, the 3 may go", "you may five times. we march ten miles, the three may go"),
    ("May 5, MARCH 6, march 7th, the 8th of may, 9 may 2020",
     "may fifth, march sixth, march seventh, the eighth of may, the ninth of may twenty twenty"),
    ("100€, 3 £, 1€, 1.50€, -5 million $, 5 $10 notes", "one hundred euros, three pounds, one euro, one euro and fifty "
     "cents, minus five million dollars, five ten dollars notes"),
    ("snake_case and/or camelCase", "snake case and or camel case"),
])
def test_words(text: str, words: str) -> None:
    assert said(text) == words


def test_british_reading() -> None:
    assert said("3 March 2021", "en_gb") == "the third of march twenty twenty one"
    assert said("3/4/2021: 105", "en_gb") == "the third of april twenty twenty one, one hundred and five"


def test_inline_phones_pauses_and_emphasis() -> None:
    wind, now, very = tokens("{W AY1 N D} [pause 300ms] now *very*")
    assert wind.phones == ("W", "AY1", "N", "D") and (wind.pause, wind.brk) == (0.3, "major")
    assert (now.emphasis, very.emphasis) == (False, True)


@pytest.mark.parametrize(("text", "named"), [
    ("Hello 😀 you", "U.1F600, grinning face"), ("say 日本語", "'日本語'"), ("Привет", "'Привет'"),
    ("bell \x07", r"U.0007, a control character"), ("{ return 0; }", "unknown phones RETURN 0;"),
    ("an open {W AY", "brace is not closed"), ("x" * 61, "more than 60 letters"), ("{}", "no phone"),
])
def test_what_cannot_be_spoken_is_named(text: str, named: str) -> None:
    with pytest.raises(DnnvssError, match=named):
        tokens(text)
    assert all(t.words for t in tokens(text, lenient=True))


def test_long_text_takes_linear_time() -> None:
    text = "In 1999 Dr. Smith paid $5 for 3 kg of apples, and they read it. " * 160
    assert len(text) > 10_000 and len(tokens(text)) == 160 * len(tokens(text[: len(text) // 160]))
