"""Engines: matching of their phones to ours, scripts, and speech where they are installed."""

import sys

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.phones import PHONES, SILENCES
from dnnvss.speech.engines import ENGINES, Engine, Speech, base, find_engine, flite, with_silences
from dnnvss.speech.engines.espeak import EspeakEngine, heard_as, mnemonics, with_closures
from dnnvss.speech.engines.festival import DIPHONES, HTS, FestivalEngine, ours, theirs
from dnnvss.speech.engines.matching import matched
from dnnvss.text.sentence import parse
from dnnvss.timing import Alignment, Segment, Tier


def heard(row: str, step: float = 0.1) -> list[Segment]:
    return [Segment(i * step, (i + 1) * step, label) for i, label in enumerate(row.split())]


def even(text: str) -> Alignment:
    """Every phone of a sentence 0.1 s, 0.2 s of silence around."""
    sentence, phones, words, time = parse(text), [(0.0, 0.2, "sil")], [(0.0, 0.2, "")], 0.2
    for word in sentence.words:
        start = time
        for phone in word.phones:
            phones.append((time, time + 0.1, phone.rstrip("012")))
            time += 0.1
        words.append((start, time, word.spoken))
    return Alignment([Tier("phones", [*phones, (time, time + 0.2, "sil")]),
                      Tier("words", [*words, (time, time + 0.2, "")])])


def installed(name: str, voice: str | None = None) -> Engine:
    engine: Engine = ENGINES[name](voice) if voice else ENGINES[name]()
    if reason := engine.available():
        pytest.skip(reason)
    return engine


# ---- matching --------------------------------------------------------------------------------------------------------


def test_equal_phones_keep_their_times() -> None:
    alignment = matched(parse("see me"), heard("sil S IY M IY sil"), "x")
    assert alignment["phones"].labels == ("sil", "S", "IY", "M", "IY", "sil")
    assert np.allclose(alignment["phones"].edges, np.arange(7) / 10)
    assert [(round(w.start, 3), round(w.end, 3), w.label) for w in alignment["words"]] == [
        (0.0, 0.1, ""), (0.1, 0.3, "see"), (0.3, 0.5, "me"), (0.5, 0.6, "")]


def test_merged_phone_shares_extra_phone_joins_and_pause_stands_alone() -> None:
    alignment = matched(parse("little, men"), heard("L IH T L sil M EH N N"), "x")  # L IH T AH L M EH N
    assert alignment["phones"].labels == ("L", "IH", "T", "AH", "L", "sp", "M", "EH", "N")
    seconds = np.diff(alignment["phones"].edges)
    assert np.allclose(seconds, [0.1, 0.1, 0.05, 0.05, 0.1, 0.1, 0.1, 0.1, 0.2])
    assert alignment["words"].labels == ("little", "", "men")


def test_another_vowel_is_still_ours() -> None:
    assert matched(parse("bath"), heard("B AA TH"), "x")["phones"].labels == ("B", "AE", "TH")


def test_a_leading_phone_left_out_shares_the_first() -> None:
    alignment = matched(parse("hello"), heard("EH L OW"), "x")
    assert alignment["phones"].labels == ("HH", "AH", "L", "OW")
    assert alignment["phones"][0].duration == pytest.approx(0.05)


@pytest.mark.parametrize("row", ["sil", "S IY S IY S IY S IY S IY", "T"])
def test_other_words_are_refused(row: str) -> None:
    with pytest.raises(DnnvssError, match="engine x said"):
        matched(parse("blue moon lagoon"), heard(row), "x")


# ---- phone sets ------------------------------------------------------------------------------------------------------


def test_phone_sets_go_there_and_back() -> None:
    for phone in PHONES:
        assert ours(theirs(phone)) == ("sil" if phone in SILENCES else phone)
    assert theirs("AH0") == "ax" and ours("axr") == "ER"
    assert heard_as("'i:") == "IY" and heard_as("_:") == "sil" and heard_as("@L") == "L" and heard_as("tS") == "CH"


def test_mnemonics_carry_stress_and_breaks() -> None:
    assert mnemonics(parse("Hello, you.")) == "[[h|@'l|oU]], [[j|u:]]."


# ---- choice ----------------------------------------------------------------------------------------------------------


def test_auto_takes_the_first_that_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    present = [name for name in ENGINES if ENGINES[name]().available() is None]
    assert find_engine().name == present[0] and present[-1] == "formant"
    monkeypatch.setattr("shutil.which", lambda _: None)
    monkeypatch.setattr("dnnvss.speech.engines.espeak.find_spec", lambda _: None)
    assert find_engine("auto").name == "formant"
    packages = {"festival": "festvox-us-slt-hts", "flite": "apt install flite", "espeak": "espeakng-loader"}
    for name, package in packages.items():
        with pytest.raises(DnnvssError, match=package):
            find_engine(name)
        with pytest.raises(DnnvssError, match=package):
            ENGINES[name]().speak(parse("hello"))
    with pytest.raises(DnnvssError, match="auto festival flite espeak formant"):
        find_engine("siri")


@pytest.mark.parametrize("voices, own_time, given_time", [
    ((HTS, DIPHONES), HTS, DIPHONES), ((HTS,), HTS, "formant"), ((DIPHONES,), DIPHONES, DIPHONES),
    ((), "formant", "formant")])
def test_auto_takes_festival_only_where_the_voice_is_there_that_is_needed(
    voices: tuple[str, ...], own_time: str, given_time: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    festival_alone(voices, monkeypatch)
    assert find_engine("auto").voice == own_time
    assert find_engine("auto", imposing=True).voice == given_time
    assert find_engine("auto", imposing=True).imposes


@pytest.mark.parametrize("voices, imposing, package", [
    ((), False, "festvox-us-slt-hts"), ((), True, "festvox-kallpc16k"), ((HTS,), True, "festvox-kallpc16k")])
def test_festival_without_its_voice_names_the_package(
    voices: tuple[str, ...], imposing: bool, package: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    festival_alone(voices, monkeypatch)
    with pytest.raises(DnnvssError, match=f"is not installed.*{package}"):
        find_engine("festival", imposing)


def test_a_voice_is_chosen_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    festival_alone((HTS, DIPHONES), monkeypatch)
    engine = find_engine("auto", voice=DIPHONES)
    assert (engine.name, engine.voice, engine.imposes) == ("festival", DIPHONES, True)
    with pytest.raises(DnnvssError, match=r"no voice 'anna'.*cmu_us_slt_arctic_hts, kal_diphone"):
        find_engine("festival", voice="anna")
    with pytest.raises(DnnvssError, match="own time only with the voice cmu_us_slt"):
        find_engine("festival", imposing=True, voice=HTS)
    with pytest.raises(DnnvssError, match=r"no voice 'anna'.*slt.*formant"):
        find_engine("auto", voice="anna")


def test_flite_without_a_voice_is_passed_over(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flite, "_built_in", lambda program: ("kal",))
    monkeypatch.setattr("shutil.which", lambda program: "/bin/flite" if program == "flite" else None)
    monkeypatch.setattr("dnnvss.speech.engines.espeak.find_spec", lambda _: None)
    assert find_engine("auto").voice == "kal"
    assert find_engine("auto", imposing=True).name == "formant"
    with pytest.raises(DnnvssError, match="this flite has no voice slt"):
        find_engine("flite", voice="slt")


def festival_alone(voices: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    """Let Festival be installed with these voices, and no other engine."""
    monkeypatch.setattr("shutil.which", lambda program: "/bin/festival" if program == "festival" else None)
    monkeypatch.setattr("dnnvss.speech.engines.festival.has_voice", voices.__contains__)
    monkeypatch.setattr("dnnvss.speech.engines.espeak.find_spec", lambda _: None)


def test_festival_speaks_given_times_with_one_voice_only() -> None:
    engine = installed("festival", HTS)
    assert isinstance(engine, FestivalEngine) and not engine.imposes
    alignment = even("hello")
    assert engine.speak(parse("hello"), alignment).alignment is not alignment


def test_all_engines_share_the_interface() -> None:
    assert all(isinstance(kind(), Engine) for kind in ENGINES.values())


def test_programs_that_fail_or_hang_are_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(DnnvssError, match="status 3: oh"):
        base.run(["sh", "-c", "echo oh >&2; exit 3"], "x")
    with pytest.raises(DnnvssError, match="did not run"):
        base.run(["/nonexistent/program"], "x")
    monkeypatch.setattr(base, "TIMEOUT", 0.1)
    with pytest.raises(DnnvssError, match="timed out"):
        base.run(["sleep", "5"], "x")


# ---- speech ----------------------------------------------------------------------------------------------------------

TEXT = "Don't record the record, we're at Q nine."


def assert_speech(speech: Speech, text: str) -> None:
    tiers = speech.alignment
    assert [p for p in tiers["phones"].labels if p not in SILENCES] == list(parse(text).phones)
    assert [w for w in tiers["words"].labels if w] == [w.spoken for w in parse(text).words]
    assert abs(len(speech.samples) / speech.rate - tiers.end) < 1 / speech.rate + 1e-6
    assert speech.samples.dtype == np.float32 and 0.02 < np.abs(speech.samples).max() <= 1
    levels = {label: [] for label in ("vowel", "sil")}
    for s in tiers["phones"]:
        part = speech.samples[round(s.start * speech.rate) : round(s.end * speech.rate)]
        kind = "sil" if s.label == "sil" else "vowel" if s.label in ("AY", "OW", "EH") else None
        if kind and len(part):
            levels[kind].append(float(np.sqrt((part**2).mean())))
    assert min(levels["vowel"]) > 4 * max(levels["sil"], default=0.0)


@pytest.mark.parametrize("name", ["festival", "flite", "espeak"])
def test_engine_speaks_in_its_own_time(name: str) -> None:
    speech = installed(name).speak(parse(TEXT))
    assert_speech(speech, TEXT)
    durations = [s.duration for s in speech.alignment["phones"] if s.label not in SILENCES]
    assert 0.04 < np.mean(durations) < 0.2


def test_festival_pauses_at_each_break_of_the_text() -> None:
    words = installed("festival", HTS).speak(parse("I came. I saw, no, I won.")).alignment["words"].labels
    assert " ".join(w or "|" for w in words) == "| i came | i saw | no | i won |"


@pytest.mark.parametrize("name, voice", [("festival", DIPHONES), ("formant", None)])
def test_engine_speaks_in_ours(name: str, voice: str | None) -> None:
    engine, alignment = installed(name, voice), even(TEXT)
    speech = engine.speak(parse(TEXT), alignment)
    assert speech.alignment is alignment
    assert_speech(speech, TEXT)


@pytest.mark.parametrize(("lead_in", "lead_out"), [(0.3, 0.1), (0.1, 0.4), (0.0, 0.0)])
def test_silences_before_and_after_are_as_asked(lead_in: float, lead_out: float) -> None:
    phones = Tier("phones", [(0, 0.2, "sil"), (0.2, 0.3, "HH"), (0.3, 0.5, "AY"), (0.5, 0.7, "sil")])
    words = Tier("words", [(0, 0.2, ""), (0.2, 0.5, "hi"), (0.5, 0.7, "")])
    sound = np.zeros(700, np.float32)
    sound[200:500] = np.arange(1, 301)
    got = with_silences(Speech(sound, 1000, Alignment([phones, words])), lead_in, lead_out)
    first = round(1000 * lead_in)
    assert len(got.samples) == first + 300 + round(1000 * lead_out)
    assert got.samples[first : first + 300].tolist() == list(range(1, 301)) and got.samples[:first].sum() == 0
    spoken = [s for s in got.alignment["phones"] if s.label != "sil"]
    assert [(round(s.start - lead_in, 6), round(s.end - lead_in, 6)) for s in spoken] == [(0.0, 0.1), (0.1, 0.3)]
    assert got.alignment["words"].labels == (("",) if lead_in else ()) + ("hi",) + (("",) if lead_out else ())
    assert got.alignment.end == pytest.approx(lead_in + 0.3 + lead_out)


def test_espeak_stops_begin_at_their_closure_and_not_after_a_pause() -> None:
    sound = np.full(600, 0.1, np.float32)
    sound[150:200] = sound[350:400] = sound[550:600] = 0.001
    rows = with_closures([*heard("AA T sil K"), Segment(0.4, 0.6, "S")], sound, 1000)
    assert rows == [Segment(0, 0.1, "AA"), Segment(0.1, 0.2, "T"), Segment(0.2, 0.30000000000000004, "sil"),
                    Segment(0.30000000000000004, 0.4, "K"), Segment(0.4, 0.6, "S")]
    rows = with_closures([Segment(0, 0.2, "AA"), Segment(0.2, 0.4, "T"), Segment(0.4, 0.6, "S")], sound, 1000)
    assert rows == [Segment(0, 0.15, "AA"), Segment(0.15, 0.4, "T"), Segment(0.4, 0.6, "S")]


def test_espeak_is_never_loaded_here() -> None:
    engine = EspeakEngine()
    if engine.available() is None:
        first, second = (engine.speak(parse("hello")).samples for _ in range(2))
        assert np.array_equal(first, second)
    assert "espeakng_loader" not in sys.modules


def test_formant_without_times_is_an_error() -> None:
    with pytest.raises(DnnvssError, match="needs durations"):
        find_engine("formant").speak(parse("hello"))
