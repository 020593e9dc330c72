"""Any text to phones, with the source of each pronunciation."""

import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dnnvss.errors import DnnvssError
from dnnvss.phones import SPOKEN, VOWELS, strip_stress
from dnnvss.text.sentence import Sentence, parse, spoken_words
from dnnvss.text.tree import linguistic_tree
from dnnvss.timing import Alignment, Tier


def phones_of(text: str, word: str, variant: str = "en_us") -> list[str]:
    return [" ".join(w.phones) for w in parse(text, variant).words if w.spoken == word]


@pytest.mark.parametrize(("text", "word", "phones"), [
    ("I read the book yesterday.", "read", ["R EH1 D"]),
    ("I will read it. Have you read it?", "read", ["R IY1 D", "R EH1 D"]),
    ("The wind is strong, so wind the clock.", "wind", ["W IH1 N D", "W AY1 N D"]),
    ("They present the present.", "present", ["P R IY0 Z EH1 N T", "P R EH1 Z AH0 N T"]),
    ("He refused to collect the refuse.", "refuse", ["R EH1 F Y UW2 S"]),
    ("Lead pipes are heavy, but she will lead us.", "lead", ["L EH1 D", "L IY1 D"]),
    ("I live near a live band.", "live", ["L IH1 V", "L AY1 V"]),
    ("Please close the door and stay close to me.", "close", ["K L OW1 Z", "K L OW1 S"]),
    ("He wound the bandage around the wound.", "wound", ["W AW1 N D", "W UW1 N D"]),
    ("A tear fell; do not tear it.", "tear", ["T IH1 R", "T EH1 R"]),
    ("Close the door. It closed at closing time.", "close", ["K L OW1 Z"]),
    ("The door closed. It is closed.", "closed", ["K L OW1 Z D", "K L OW1 Z D"]),
    ("a wounding remark", "wounding", ["W UW1 N D IH0 NG"]),
    ("Live music tonight. We live here.", "live", ["L AY1 V", "L IH1 V"]),
    ("the invitees", "invitees", ["IH1 N V AY0 T IY0 Z"]),
    ("He does it, and the does run.", "does", ["D AH1 Z", "D OW1 Z"]),
    ("The bass player caught a bass in the lake.", "bass", ["B EY1 S", "B AE1 S"]),
    ("He used to use it.", "used", ["Y UW1 S T"]),
    ("He lives nine lives.", "lives", ["L IH1 V Z", "L AY1 V Z"]),
    ("The objects objected.", "objected", ["AH0 B JH EH1 K T IH0 D"]),
    ("place red at a nine now", "a", ["EY1"]),
    ("a dog at a nine o'clock meeting of an owl", "an", ["AE0 N"]),
    ("the apple of the tree", "the", ["DH IY0", "DH AH0"]),
    ("Please elaborate. The elaborate plan.", "elaborate",
     ["IH0 L AE1 B ER0 EY2 T", "IH0 L AE1 B R AH0 T"]),
    ("She understood photography.", "photography", ["F AH0 T AA1 G R AH0 F IY0"]),
])
def test_words_in_context(text: str, word: str, phones: list[str]) -> None:
    assert phones_of(text, word) == phones


def test_british_words_in_context() -> None:
    text = "The progress contrasted with the produce of my new address."
    assert phones_of(text, "progress", "en_gb") == ["P R OW1 G R EH2 S"]
    assert phones_of(text, "contrasted", "en_gb") == ["K AH0 N T R AA1 S T IH0 D"]
    assert phones_of(text, "new", "en_gb") == ["N Y UW1"]


def test_report_names_sources_and_doubts() -> None:
    report = parse("Wind blorptastic bass {W AY1 N D} B!", overrides={"Wind": "W AY1 N D"}).report()
    assert [row["source"].split()[0] for row in report] == ["override", "network", "homograph", "inline", "letter"]
    assert "not in the lexicon" in report[1]["doubt"] and "commonest" in report[2]["doubt"]
    assert report[0] == {"written": "Wind", "spoken": "wind", "phones": "W AY1 N D", "source": "override", "doubt": ""}


@pytest.mark.parametrize(("text", "before", "inside", "after"), [
    ("[pause 2s] hello you [pause 300ms]", 2.0, None, 0.3),
    ("*[pause 2s] hello* <break time=\"1s\"/> you", 2.0, 1.0, 0.0),
    ("hello *[pause 2s] you* [pause]", 0.0, 2.0, 0.0)])
def test_pauses_before_between_and_after_words(text: str, before: float, inside: float | None, after: float) -> None:
    sentence = parse(text)
    assert [w.spoken for w in sentence.words] == ["hello", "you"] == [w for w, _ in spoken_words(text)]
    assert (sentence.pause_before, sentence.words[0].pause, sentence.pause_after) == (before, inside, after)


@pytest.mark.parametrize(("text", "timed"), [
    ("[pause 2s] hello, you. now [pause 1s]", False), ("hello <break strength='strong'/> you", False),
    ("hello [pause 300ms] you", True), ("hello <break time='1s'/> you", True),
    ("hello <prosody rate='50%'>you</prosody>", True)])
def test_pauses_between_words_and_rates_are_times_that_a_text_sets(text: str, timed: bool) -> None:
    assert parse(text).timed == timed


def test_breaks_and_words_agree_with_the_light_pass() -> None:
    sentence = parse("At 10:45, Dr. Who left. Really?")
    assert [(w.spoken, w.break_after) for w in sentence.words] == [
        ("at", "none"), ("ten", "none"), ("forty", "none"), ("five", "minor"), ("doctor", "none"), ("who", "none"),
        ("left", "major"), ("really", "major")]
    assert [w for w, _ in spoken_words(sentence.text)] == [w.spoken for w in sentence.words]


@pytest.mark.parametrize("text", ["", "   ", "—", "...", "\n\n", "<speak></speak>", "!?", "()", "[pause 2s]"])
def test_nothing_to_speak_is_an_error(text: str) -> None:
    with pytest.raises(DnnvssError, match="no word to speak"):
        parse(text)


@pytest.mark.parametrize("text", ["§§", "@", "100%", "x", "$", "b.", "'s", "zzz", "'", "-"])
def test_little_texts_are_spoken_or_refused(text: str) -> None:
    try:
        assert_sound(parse(text))
    except DnnvssError as error:
        assert "no word" in str(error)


def assert_sound(sentence: Sentence) -> None:
    """Every word has phones of the 39, vowels carry stress, and a tree over the phones covers them all."""
    segments, words = [], []
    for word in sentence.words:
        start = len(segments)
        assert word.phones and word.spoken
        for phone in word.phones:
            assert strip_stress(phone) in SPOKEN
            assert (phone[-1] in "012") == (strip_stress(phone) in VOWELS)
            segments.append((len(segments) / 10, (len(segments) + 1) / 10, strip_stress(phone)))
        words.append((start / 10, len(segments) / 10, word.spoken))
    tree = linguistic_tree(Alignment([Tier("phones", segments), Tier("words", words)]), sentence.text)
    assert (tree.words, tree.phones) == (len(words), len(segments))
    assert min(tree.word.min(), tree.syllable.min(), tree.phrase.min(), tree.phone_in_syllable.min()) == 0
    assert 1 <= tree.phrases <= tree.words <= tree.syllables <= tree.phones


written = st.one_of(
    st.text(max_size=40),
    st.text(st.sampled_from("abcdeghilnorstuyABIVX0123456789.,:;!?-'\u2019$£%&/()@#{}[]*_ \n\té½°"), max_size=40),
    st.lists(st.sampled_from(["Dr.", "10:45", "$3.50", "the", "read", "U.S.", "it's", "well-known", "1999", "St.",
                              "3rd", "{W AY1}", "B2B", "a.m.", "[pause]", "*so*", "XIV", "q@x.com", "May 5", "1/0",
                              "...", "\u2014", "2-3kg"]),
             max_size=8).map(" ".join),
)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(written)
def test_any_text_is_spoken_or_refused(text: str) -> None:
    try:
        sentence = parse(text)
    except DnnvssError:
        return
    assert_sound(sentence)


def test_import_is_light_and_offline() -> None:
    code = ("import sys, socket\n"
            "def refuse(*a, **k): raise OSError('network')\n"
            "socket.socket.connect = refuse\n"
            "import dnnvss.text.sentence as s\n"
            "print(sorted({'nltk', 'HanTa', 'torch', 'g2p_en', 'pocketsphinx', 'inflect'} & set(sys.modules)))\n"
            "print(s.parse('Read zorbulate.').words[1].source)\n"
            "print(sorted({'nltk', 'torch', 'g2p_en', 'pocketsphinx'} & set(sys.modules)))\n")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[:3] == ["[]", "network", "[]"]
