# ruff: noqa: RUF001  (signs of the phonetic alphabet look like others)
"""Texts with tags and entities: what they ask for is done, or named."""

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.phones.alphabets import arpabet
from dnnvss.speech.time_line import rates
from dnnvss.text.sentence import parse, spoken_words


def spoken(text: str) -> str:
    return " ".join(word.spoken for word in parse(text).words)


@pytest.mark.parametrize("text, words", [
    ('The <sub alias="World Wide Web Consortium">W3C</sub> rules', "the world wide web consortium rules"),
    ("The <sub alias='a &amp; b'>x</sub>", "the a and b"),
    ('<say-as interpret-as="characters">SQL</say-as>', "s q l"),
    ("<say-as interpret-as='spell-out'>a1é</say-as> end", "a one e end"),
    ('<say-as interpret-as="telephone">555-12</say-as>', "five five five one two"),
    ('the <say-as interpret-as="ordinal">3</say-as> and <say-as interpret-as="ordinal">22</say-as>',
     "the third and twenty second"),
    ('<say-as interpret-as="cardinal">12</say-as>', "twelve"),
    ('<say-as interpret-as="date" format="dmy">3/4/2020</say-as>', "the third of april twenty twenty"),
    ('<say-as interpret-as="date" format="mdy">3/4/2020</say-as>', "march fourth twenty twenty"),
    ('<say-as interpret-as="date" format="ymd">2020/3/4</say-as>', "march fourth twenty twenty"),
    ('<say-as interpret-as="date" format="yyyymmdd">20200304</say-as>', "march fourth twenty twenty"),
    ('<say-as interpret-as="date" format="my">3/2020</say-as>', "march twenty twenty"),
    ('<say-as interpret-as="date" format="md">3.4</say-as>', "march fourth"),
    ('<say-as interpret-as="date" format="y">1999</say-as>', "nineteen ninety nine"),
    ('<say-as interpret-as="date" format="dmy">4 March 2020</say-as>', "the fourth of march twenty twenty"),
    ('<say-as interpret-as="cardinal">2024</say-as> 2024', "two thousand twenty four twenty twenty four"),
    ('<say-as interpret-as="date">????0922</say-as>', "september twenty second"),
    ('<say-as interpret-as="number" format="ordinal">12</say-as>', "twelfth"),
    ("on 2020/3/4", "on march fourth twenty twenty"),
    ("Tom &amp; Jerry said it&#39;s fun &#x2014; caf&eacute;", "tom and jerry said it's fun cafe"),
    ("5 &lt; 6 and AT&T; R&D", "five less than six and a t and t r and d"),
    ("<![CDATA[one]]> two <!-- three --> four", "one two four"),
    ("<?xml version='1.0'?><speak version=\"1.1\" xmlns='x'>Hi</speak>", "hi"),
    ("5 < 6 and a <b c", "five less than six and a less than b c"),
    ("<speak>Mid<b>dle</b> word</speak>", "middle word"),
])
def test_tags_and_entities_are_understood(text: str, words: str) -> None:
    assert spoken(text) == words
    assert [word for word, _ in spoken_words(text)] == [w.spoken for w in parse(text).words]


@pytest.mark.parametrize("tag, seconds", [
    ("<break time='2s'/>", 2), ('<break time="500ms"/>', 0.5), ("<break time = '1.5s' />", 1.5),
    ("<BREAK TIME='.25s'></BREAK>", 0.25), ('<break strength="x-strong"/>', 1), ("<break/>", None),
    ("<break strength='none'/>", None)])
def test_breaks_in_both_quotes_pause(tag: str, seconds: float | None) -> None:
    first = parse(f"<speak>Hello {tag} world</speak>").words[0]
    assert first.pause == seconds and (first.break_after == "none") == ("none" in tag)


def test_a_pause_of_macos_pauses() -> None:
    assert parse("one [[slnc 500]] two").words[0].pause == 0.5


def test_paragraphs_and_sentences_end() -> None:
    assert [w.break_after for w in parse("<p><s>One</s><s>two</s></p>three").words][:2] == ["major", "major"]


@pytest.mark.parametrize("alphabet, ph", [
    ("ipa", "təˈmeɪtoʊ"), ("x-sampa", "t@&quot;meItoU"), ("x-arpabet", "T AH0 M EY1 T OW0")])
def test_phonemes_of_three_alphabets(alphabet: str, ph: str) -> None:
    word = parse(f'<phoneme alphabet="{alphabet}" ph="{ph}">tomato</phoneme> soup').words[0]
    assert word.phones == ("T", "AH0", "M", "EY1", "T", "OW0") and word.written == "tomato"
    single = parse("<phoneme alphabet='ipa' ph='ˈtʃɜːtʃ'>church</phoneme>").words[0]
    assert single.phones == ("CH", "ER1", "CH")


def test_every_sign_of_the_table_is_a_phone() -> None:
    assert arpabet("ˈθɪŋk") == ("TH", "IH1", "NG", "K") and arpabet("juː") == ("Y", "UW")
    with pytest.raises(DnnvssError, match="is no sound of English"):
        arpabet("ɬ")
    with pytest.raises(DnnvssError, match="alphabet 'x-kirshenbaum'"):
        arpabet("a", "x-kirshenbaum")


@pytest.mark.parametrize("rate, factor", [
    ("slow", 0.75), ("150%", 1.5), ("+10%", 1.1), ("-20%", 0.8), ("0.5", 0.5), (".8", 0.8)])
def test_prosody_changes_the_rate_of_its_words(rate: str, factor: float) -> None:
    sentence = parse(f"now <prosody rate='{rate}'>and here</prosody> again")
    assert [w.rate for w in sentence.words] == pytest.approx([1, factor, factor, 1])
    assert len(rates(sentence)) == sum(len(w.phones) for w in sentence.words) and np.all(rates(sentence) > 0)


def test_a_date_of_eight_digits_is_one() -> None:
    assert spoken("<say-as interpret-as='date'>20200310</say-as>") == "march tenth twenty twenty"
    assert spoken("<say-as interpret-as='date'>12/3/2020</say-as>") == "december third twenty twenty"


def test_emphasis_nests_and_ends() -> None:
    words = parse("a <emphasis level='strong'>b <prosody rate='fast'>c</prosody></emphasis> d").words
    assert [(w.emphasis, w.rate) for w in words] == [(False, 1), (True, 1), (True, 1.25), (False, 1)]


@pytest.mark.parametrize("text, said", [
    ('<mstts:express-as style="cheerful">Great</mstts:express-as>', "<mstts:express-as>"),
    ("<audio src='a.mp3'/> hi", "<audio>"), ("<say-as interpret-as='expletive'>x</say-as>", "'expletive'"),
    ("<break time='soon'/> hi", "'soon'"), ("<break time=2s> hi", "<break time=2s>"),
    ("<pause 500> hi", "<pause 500>"),
    ("<sub alias='x'>y", "not closed"), ("&nosuch; hi", "&nosuch;"), ("< speak >hi</ speak >", "< speak >"),
    ("<a href=x>link</a>", "<a href=x>"), ("<v Bob>Hi there", "<v Bob>"), ("<00:00:01.000>hi", "<00:00:01.000>"),
    ("<prosody rate='warp'>x</prosody>", "'warp'"), ("<break strength='odd'/> x", "'odd'")])
def test_what_is_not_understood_is_named(text: str, said: str) -> None:
    with pytest.raises(DnnvssError, match=said):
        parse(text)
    assert isinstance(spoken_words(text), tuple)


def test_what_changes_nothing_is_told_of_its_words() -> None:
    assert "prosody pitch" in parse("<prosody pitch='high'>up</prosody>").words[0].doubt
    assert "role" in parse("<w role='amazon:VBD'>said</w> it").words[0].doubt
    assert "another voice" in parse("<voice name='x'>up</voice>").words[0].doubt


@pytest.mark.parametrize("text, words", [
    ("my id, your ID card", "my i d your i d card"),
    ("GPU vs CPU", "g p u vs c p u"), ("The GPU and the CPU", "the g p u and the c p u"),
    ("USB to HDMI", "u s b to h d m i"),
    ("AWS EC2", "a w s e c two"), ("the gpu, the hdmi, the nyc", "the g p u the h d m i the n y c"),
    ("MIT and UCLA", "mit and u c l a"), ("GPS VS GDP", "g p s vs g d p"), ("a CT of the ER", "a c t of the e r"),
    ("JOHN WENT HOME AND SAW NASA", "john went home and saw nasa"), ("GIVE IT TO US", "give it to us"),
    ("hmm shh tsk psst", "hmm shh tsk psst"), ("Nguyen and Mbeki", "nguyen and mbeki")])
def test_acronyms_are_spelt_and_words_are_not(text: str, words: str) -> None:
    found = spoken(text)
    assert found == words
