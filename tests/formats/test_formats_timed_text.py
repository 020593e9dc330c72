"""Subtitles and what recognisers write are read as their programs write them."""

import json
from pathlib import Path
from typing import Any

import pytest

from dnnvss.errors import DnnvssError
from dnnvss.formats import Cue, in_order, is_words_csv, read_timed_text
from dnnvss.formats.transcripts import check_transcript

SRT = """1
00:00:00,950 --> 00:00:02,120
Bin <i>blue</i> at F
two now.

2
00:01:03,900 --> 01:00:05,000 X1:40 X2:600
{\\an8}- ANN: It&#39;s me. [laughs]

3
00:01:09,000 --> 00:01:10,000
(door slams)
"""
VTT = """WEBVTT - some title
Kind: captions

NOTE
this is --> no cue

STYLE
::cue { color: red }

intro
00:01.000 --> 00:03.500 align:start
first<00:00:02.000><c> line</c>

00:03.500 --> 00:05.000
first line
second line

00:05.000 --> 00:06.000
\u266a la la \u266a
"""


def written(folder: Path, name: str, data: str | bytes) -> Path:
    path = folder / name
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def test_subrip_gives_what_is_spoken_and_its_times(tmp_path: Path) -> None:
    want = (Cue(0.95, 2.12, "Bin blue at F two now."), Cue(63.9, 3605.0, "It's me."))
    assert read_timed_text(written(tmp_path, "a.srt", SRT)) == want
    for name, data in (("mark.srt", SRT.encode("utf-8-sig")), ("wide.SRT", SRT.encode("utf-16")),
                       ("lines.srt", SRT.replace("\n", "\r\n")), ("dots.srt", SRT.replace(",", "."))):
        assert read_timed_text(written(tmp_path, name, data)) == want, name


def test_webvtt_has_notes_names_and_lines_that_roll_up(tmp_path: Path) -> None:
    assert read_timed_text(written(tmp_path, "a.vtt", VTT)) == (Cue(1, 3.5, "first line"), Cue(3.5, 5, "second line"))


def test_captions_of_youtube_have_times_within_their_lines(tmp_path: Path) -> None:
    text = ("WEBVTT\nKind: captions\n\n00:00:00.000 --> 00:00:02.000 align:start position:0%\n \n"
            "so<00:00:00.500><c> hello</c><00:00:01.000><c> there</c>\n\n"
            "00:00:02.000 --> 00:00:02.010 align:start position:0%\nso hello there\n \n\n"
            "00:00:02.010 --> 00:00:04.000 align:start position:0%\nso hello there\n"
            "how<00:00:02.500><c> are</c><00:00:03.000><c> you</c>\n\n"
            "00:00:04.000 --> 00:00:04.010 align:start position:0%\nhow are you\n \n")
    assert read_timed_text(written(tmp_path, "a.vtt", text)) == (
        Cue(0.0, 2.0, "so hello there"), Cue(2.01, 4.0, "how are you"))
    signs = "1\n00:00:01,000 --> 00:00:02,000\na < b and c > <i>d</i>\n\n2\n00:00:03,000 --> 00:00:04,000\n# la la #\n"
    assert read_timed_text(written(tmp_path, "a.srt", signs)) == (Cue(1.0, 2.0, "a < b and c > d"),)


def test_cues_come_in_order_and_overlaps_are_told() -> None:
    first, second, third = Cue(0, 2, "a"), Cue(1, 3, "b"), Cue(5, 6, "c")
    assert in_order([third, first, second]) == (
        (first, second, third),
        ("1 cues stood before earlier ones and were put in order", "1 cues begin before the one before them ends"))
    assert in_order([Cue(None, None, "a"), first]) == ((Cue(None, None, "a"), first), ())


@pytest.mark.parametrize("times, start, end", [
    ("00:00:01,000 --> 00:00:02,500", 1.0, 2.5), ("0:00:01 --> 0:00:02", 1.0, 2.0), ("00:01.5 --> 00:02.5", 1.5, 2.5),
    ("00:00:01:12 --> 00:00:02:23", 1.5, 2 + 23 / 24), ("00:00:01:12 --> 00:00:02:24", 1.48, 2.96),
    ("00: 00: 01, 000 --> 00: 00: 02, 500", 1.0, 2.5), ("00:00:01,000-->00:00:02,500", 1.0, 2.5),
    ("00:00:01,000 ==> 00:00:02,500", 1.0, 2.5), ("00:00:01.000000 \u2013> 00:00:02.500000", 1.0, 2.5),
    ("00:00:01,000 \u2192 00:00:02,500", 1.0, 2.5)])
def test_times_of_all_editors_are_read(tmp_path: Path, times: str, start: float, end: float) -> None:
    want = (Cue(start, end, "A -> B: 42"), Cue(3723.25, 3724.5, "7"))
    later = "01:02:03,250 --> 01:02:04,500"
    for name, text in (("a.srt", f"1\n{times}\nA -> B:\n42\n\n2\n{later}\n7\n"),
                       ("spaced.srt", f"1\n\n{times}\n\nA -> B:\n\n42\n\n2\n\n{later}\n\n7\n\n\n"),
                       ("tight.srt", f"{times}\nA -> B:\n42\n2\n{later}\n7")):
        found = read_timed_text(written(tmp_path, name, text))
        assert [c.text for c in found] == [c.text for c in want], name
        assert [t for c in found for t in (c.start, c.end)] == pytest.approx([start, end, 3723.25, 3724.5])


@pytest.mark.parametrize("text", [
    "0:00\nHello there,\nyou.\n1:02:03\nBye.\n", "[00:00] Hello there, you.\n[1:02:03.0] Bye.\n",
    "(0:00) Hello there,\nyou.\n\n(1:02:03) Bye.\n", "0:00 Hello there, you.\n1:02:03 - Bye.\n",
    "[00:00.000 --> 01:02:03.000]  Hello there, you.\n[01:02:03.000 --> 01:02:08.000]  Bye.\n",
    "0:00 - 1:02:03 Hello there, you.\n1:02:03 \u2013 1:02:08 Bye.\n",
    "Speaker 1  0:00\nHello there,\nyou.\n\nAnn Lee  1:02:03\nBye.\n",
    "Speaker 1 (0:00):\nHello there, you.\nAnn Lee (1:02:03):\nBye.\n"])
def test_transcripts_with_times_in_their_lines_are_cues(tmp_path: Path, text: str) -> None:
    assert read_timed_text(written(tmp_path, "a.txt", text)) == (
        Cue(0.0, 3723.0, "Hello there, you."), Cue(3723.0, 3728.0, "Bye."))
    with pytest.raises(DnnvssError, match=r"holds (times|subtitles), and no"):
        check_transcript(tmp_path / "a.txt")


@pytest.mark.parametrize("text", ["At 10:30 we left.\n", "10:30 is late.\n", "9:00 to five\nis 8:00 no more\nor less\n",
                                  "[laughs] I see {it}\n", "1 2 3 test\n"])
def test_a_text_that_tells_the_time_is_a_text(tmp_path: Path, text: str) -> None:
    assert check_transcript(written(tmp_path, "a.txt", text)) == text


@pytest.mark.parametrize("text, said", [
    (SRT, "Rename it a.srt"), (VTT, "is WebVTT"), ('{"text": "hi"}', "is JSON"), ("{\\rtf1 hi}", "is RTF"),
    ("<!DOCTYPE html><p>hi", "is HTML"), ("start,end,word\n0,1,hi\n", "holds times"),
    ('{"text": "hi"}\n{"text": "you"}\n', "is JSON"), ("<tt xmlns='x'><body>hi", "is XML"),
    ('File type = "ooTextFile"\nObject class = "TextGrid"\n', "Rename it a.TextGrid"), ("#!MLF!#\nhi\n.\n", "a.mlf"),
    ("[Script Info]\nTitle: x\nDialogue: 0,0:00:00.45,0:00:01.73,Default,,0,0,0,,hi", "is SubStation Alpha"),
    ("0:00:00.457,0:00:01.739\nhi there\n", "is captions of YouTube"), ("*CHI:\thi there .\n", "is CHAT"),
    ("words\t\t00:00:00.457\t00:00:01.739\t00:00:01.282\thi there\n", "table of times"),
    ("a 1 0.45 0.1 hi\na 1 0.55 0.1 you\n", "table of times"), ("a 1 spk 0.45 1.7 <o,f0> hi you\n", "table of times"),
    ("Speaker 1  0:00\nhi there\n", "holds times"), ("0:00\nhi there\n", "holds times"),
    ("00:00:01:12 hi there\n", "holds times"),
    ("PK\x03\x04", "control character"), ("0.1 0.2 hi\n0.2 0.3 you\n", "holds times")])
def test_files_that_only_bear_the_name_of_a_text_are_named(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(DnnvssError, match=said):
        check_transcript(written(tmp_path, "a.txt", text))


@pytest.mark.parametrize("text", [SRT, "{\\rtf1 hi}", "*CHI:\thi there .\n"])
def test_a_long_text_is_not_something_else_either(tmp_path: Path, text: str) -> None:
    with pytest.raises(DnnvssError, match="no plain text"):
        read_timed_text(written(tmp_path, "a.txt", text))


@pytest.mark.parametrize("line, said", [
    ("-00:00:01,000 --> 00:00:02,500", "begins before the recording"), ("00:00:01,000 -> 2.5", "holds no two times"),
    ("00:00:01,000 00:00:02,500", "holds no two times"), ("1:2:3:4:5 --> 6", "holds no two times")])
def test_times_that_cannot_be_read_are_named_and_not_said(tmp_path: Path, line: str, said: str) -> None:
    with pytest.raises(DnnvssError, match=f"line 6: .*{said}"):
        read_timed_text(written(tmp_path, "a.srt", f"1\n00:00:01,0 --> 00:00:02,5\nHi.\n\n2\n{line}\nHo.\n"))


@pytest.mark.parametrize(("text", "said"), [
    ("1\n00:00:01,000 -> x\n", "stands where times should be"),
    ("00:00:01,000 --> later\nhello\n", r"line 1: .* holds no two"),
    ("1\n00:00:05,000 --> 00:00:01,000\nhello\n", "ends at 1.000 s, before"), ("hello\n", "line 1: 'hello' stands"),
    ("", "holds no cue with text"), ("1\n00:00:01,000 --> 00:00:02,000\n[music]\n", "holds no cue with text")])
def test_damaged_subtitles_are_refused_by_their_line(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(DnnvssError, match=said) as found:
        read_timed_text(path := written(tmp_path, "a.srt", text))
    assert found.value.file == path


WORD = {"start": 0.5, "end": 0.9}
RECOGNISED: dict[str, Any] = {
    "whisper": {"text": "Hi. You.", "segments": [{"start": 0.5, "end": 0.9, "text": " Hi.", "words": [
        {"word": " Hi.", **WORD, "probability": 0.9}]}, {"start": 1, "end": 1.5, "text": " You."}]},
    "whisperx": {"segments": [{"start": 0.5, "end": 0.9, "text": "Hi.", "words": [{"word": "Hi."}]},
                              {"start": 1, "end": 1.5, "text": "You."}], "word_segments": []},
    "whisper.cpp": {"transcription": [{"offsets": {"from": 500, "to": 900}, "text": " Hi."},
                                      {"offsets": {"from": 1000, "to": 1500}, "text": " You."}]},
    "vosk": [{"result": [{"conf": 1.0, **WORD, "word": "Hi."}], "text": "Hi."}, {"text": ""},
             {"result": [{"start": 1, "end": 1.5, "word": "You."}]}],
    "deepgram": {"results": {"channels": [{"alternatives": [{"transcript": "", "words": [
        {"word": "hi", **WORD, "punctuated_word": "Hi."}, {"word": "You.", "start": 1, "end": 1.5}]}]}]}},
    "aws": {"results": {"items": [
        {"start_time": "0.5", "end_time": "0.9", "type": "pronunciation", "alternatives": [{"content": "Hi"}]},
        {"type": "punctuation", "alternatives": [{"content": "."}]},
        {"start_time": "1", "end_time": "1.5", "type": "pronunciation", "alternatives": [{"content": "You."}]}]}},
    "google": {"results": [{"alternatives": [{"words": [{"startTime": "0.500s", "endTime": "0.9s", "word": "Hi."}]}]},
                           {"alternatives": [{"words": [{"startTime": "1s", "endTime": "1.5s", "word": "You."}]}]}]},
    "assemblyai": {"words": [{"text": "Hi.", "start": 500, "end": 900}, {"text": "You.", "start": 1000, "end": 1500}]},
    "google by seconds": {"results": [{"alternatives": [{"words": [
        {"start_time": {"nanos": 500000000}, "end_time": {"nanos": 900000000}, "word": "Hi."},
        {"start_time": {"seconds": "1"}, "end_time": {"seconds": "1", "nanos": 500000000}, "word": "You."}]}]}]},
    "hugging face": {"text": "", "chunks": [{"timestamp": [0.5, 0.9], "text": " Hi."},
                                            {"timestamp": [1.0, 1.5], "text": " You."}]},
    "watson": {"results": [{"alternatives": [{"timestamps": [["Hi.", 0.5, 0.9], ["You.", 1.0, 1.5]]}]}]},
    "azure": {"recognizedPhrases": [{"nBest": [{"words": [
        {"word": "Hi.", "offset": "PT0.5S", "offsetInTicks": 5000000, "durationInTicks": 4000000},
        {"word": "You.", "offset": "PT1S", "offsetInTicks": 10000000, "durationInTicks": 5000000}]}]}]},
    "azure, detailed": [{"Offset": 5000000, "Duration": 4000000, "NBest": [{"Display": "Hi."}]},
                        {"NBest": [{"Words": [{"Word": "You.", "Offset": 10000000, "Duration": 5000000}]}]}],
    "azure, fast": {"durationMilliseconds": 2000, "combinedPhrases": [{"text": "Hi. You."}], "phrases": [
        {"offsetMilliseconds": 500, "durationMilliseconds": 400, "text": "Hi.", "words": [
            {"text": "Hi.", "offsetMilliseconds": 500, "durationMilliseconds": 400}]},
        {"offsetMilliseconds": 1000, "durationMilliseconds": 500, "text": "You."}]},
    "rev": {"monologues": [{"elements": [
        {"type": "text", "value": "Hi", "ts": 0.5, "end_ts": 0.9}, {"type": "punct", "value": "."},
        {"type": "text", "value": "You.", "ts": 1.0, "end_ts": 1.5}]}]},
    "speechmatics": {"results": [
        {"type": "word", "start_time": 0.5, "end_time": 0.9, "alternatives": [{"content": "Hi"}]},
        {"type": "punctuation", "start_time": 0.9, "end_time": 0.9, "alternatives": [{"content": "."}]},
        {"type": "word", "start_time": 1.0, "end_time": 1.5, "alternatives": [{"content": "You."}]}]},
    "youtube": {"events": [{"tStartMs": 0, "dDurationMs": 5000, "id": 1},
                           {"tStartMs": 500, "dDurationMs": 400, "segs": [{"utf8": "Hi."}]},
                           {"tStartMs": 1000, "dDurationMs": 500, "segs": [{"utf8": "You."}]}]},
    "aeneas": {"fragments": [{"begin": "0.500", "end": "0.900", "lines": ["Hi."]},
                             {"begin": "1.000", "end": "1.500", "lines": ["You."]}]},
    "montreal": {"start": 0, "end": 2, "tiers": {"words": {"type": "interval", "entries": [
        [0.5, 0.9, "Hi."], [1.0, 1.5, "You."]]}, "phones": {"type": "interval", "entries": [[0.5, 0.9, "HH"]]}}},
    "google, who speaks": {"response": {"results": [
        {"alternatives": [{"words": [{"startTime": "0.5s", "endTime": "0.9s", "word": "Hi."}]}]},
        {"alternatives": [{"words": [{"startTime": "1s", "endTime": "1.5s", "word": "You."}]}]},
        {"alternatives": [{"words": [
            {"startTime": "0.5s", "endTime": "0.9s", "word": "Hi.", "speakerTag": 1},
            {"startTime": "1s", "endTime": "1.5s", "word": "You.", "speakerTag": 2}]}]}]}},
    "google, a batch": {"results": {"gs://a/b.wav": {"transcript": {"results": [{"alternatives": [{"words": [
        {"startOffset": "0.500s", "endOffset": "0.900s", "word": "Hi."},
        {"startOffset": "1s", "endOffset": "1.500s", "word": "You."}]}]}]}}}},
    "nemo": {"text": "Hi. You.", "timestamp": {
        "char": [{"char": ["H"], "start": 0.5, "end": 0.6}],
        "word": [{"word": "Hi.", "start_offset": 6, "end_offset": 11, **WORD},
                 {"word": "You.", "start_offset": 12, "end_offset": 19, "start": 1.0, "end": 1.5}],
        "segment": [{"segment": "Hi. You.", "start": 0.5, "end": 1.5}]}},
    "gladia": {"metadata": {}, "result": {"transcription": {"full_transcript": "Hi. You.", "utterances": [
        {"text": "Hi. You.", "start": 0.5, "end": 1.5, "channel": 0, "words": [
            {"word": "Hi.", **WORD}, {"word": " You.", "start": 1.0, "end": 1.5}]}]}}},
    "gladia, first": {"prediction": [
        {"time_begin": 0.5, "time_end": 0.9, "transcription": "Hi."},
        {"time_begin": 1, "time_end": 1.5, "transcription": "You."}]},
    "deepgram, utterances": {"results": {"utterances": [
        {"start": 0.5, "end": 1.5, "transcript": "Hi. You.", "words": [
            {"word": "hi", "punctuated_word": "Hi.", **WORD},
            {"word": "you", "punctuated_word": "You.", "start": 1.0, "end": 1.5}]}]}},
    "assembly, utterances": {"utterances": [
        {"start": 500, "end": 900, "text": "Hi.", "speaker": "A"},
        {"start": 1000, "end": 1500, "text": "You.", "speaker": "B"}]},
    "whisperx, words": {"word_segments": [{"word": "Hi.", **WORD}, {"word": "You.", "start": 1.0, "end": 1.5}]},
    "soniox": {"text": "Hi. You.", "tokens": [
        {"text": "H", "start_ms": 500, "end_ms": 700}, {"text": "i.", "start_ms": 700, "end_ms": 900},
        {"text": " Du.", "translation_status": "translation"}, {"text": " You", "start_ms": 1000, "end_ms": 1400},
        {"text": ".", "start_ms": 1400, "end_ms": 1500}, {"text": "<end>", "start_ms": 1500, "end_ms": 1500}]},
    "sonix": {"transcript": [{"text": "Hi. You.", "start_time": 0.5, "end_time": 1.5, "words": [
        {"text": "Hi.", "start_time": 0.5, "end_time": 0.9}, {"text": "You.", "start_time": 1.0, "end_time": 1.5}]}]},
    "parakeet": {"text": "Hi. You.", "sentences": [
        {"text": "Hi.", **WORD, "tokens": [{"text": " H", "start": 0.5, "end": 0.7, "duration": 0.2},
                                           {"text": "i.", "start": 0.7, "end": 0.9, "duration": 0.2}]},
        {"text": "You.", "start": 1.0, "end": 1.5}]},
    "clock": [{"text": "Hi.", "timestamps": {"from": "00:00:00,500", "to": "00:00:00,900"}},
              {"text": "You.", "timestamps": {"from": "00:00:01,000", "to": "00:00:01,500"}}],
    "plain": [{"text": "Hi.", **WORD}, {"text": "You.", "start": 1, "end": 1.5}],
}


@pytest.mark.parametrize("shape", RECOGNISED)
def test_what_recognisers_write_is_read(tmp_path: Path, shape: str) -> None:
    path = written(tmp_path, "a.json", json.dumps(RECOGNISED[shape]))
    assert read_timed_text(path) == (Cue(0.5, 0.9, "Hi."), Cue(1.0, 1.5, "You."))


def test_words_without_times_are_said_with_those_beside_them(tmp_path: Path) -> None:
    """Gentle gives none to what it did not find, WhisperX none to numbers."""
    lost = [{"word": "so", "case": "not-found-in-audio"}, {"word": "hi", "case": "success", **WORD},
            {"word": "42", "case": "not-found-in-audio"}, {"word": "you", "case": "success", "start": 1, "end": 1.5}]
    for value in ({"words": lost}, {"word_segments": lost}):
        assert read_timed_text(written(tmp_path, "a.json", json.dumps(value))) == (
            Cue(0.5, 1.0, "so hi 42"), Cue(1.0, 1.5, "you"))
    frames = {"timestamp": {"word": [{"word": "hi", "start_offset": 6, "end_offset": 11}]}}
    with pytest.raises(DnnvssError, match="no words with times"):
        read_timed_text(written(tmp_path, "a.json", json.dumps(frames)))


def test_values_on_lines_are_a_list_and_milliseconds_are_refused(tmp_path: Path) -> None:
    rows = [json.dumps({"word": word, "start": a, "end": b}) for word, a, b in (("Hi.", .5, .9), ("You.", 1, 1.5))]
    assert read_timed_text(written(tmp_path, "a.json", "\n".join(rows) + "\n")) == (
        Cue(0.5, 0.9, "Hi."), Cue(1.0, 1.5, "You."))
    late = [{"text": "hi", "start": 1000 * k, "end": 1000 * k + 400} for k in range(4)]
    for name, text in (("a.json", json.dumps(late)), ("a.csv", "start,end,word\n" + "\n".join(
            f"{row['start']},{row['end']},hi" for row in late))):
        with pytest.raises(DnnvssError, match="about 1,000 times"):
            read_timed_text(written(tmp_path, name, text))


def test_whispers_table_is_in_milliseconds(tmp_path: Path) -> None:
    """A quotation mark in it is a part of the text; a sentence without a length is one too."""
    path = tmp_path / "a.tsv"
    path.write_text('start\tend\ttext\n0\t1200\t"Hello," she said.\n1200\t1200\tYes.\n1500\t2500\t[Music]\n')
    assert read_timed_text(path) == (Cue(0, 1.2, '"Hello," she said.'), Cue(1.2, 1.2, "Yes."))
    path.write_text("start\tend\ttext\n0.5\t1200\thello\n")
    with pytest.raises(DnnvssError, match=r"line 2: .* is not START END TEXT"):
        read_timed_text(path)
    path.write_text("start\tend\ttext\n0\t1.2\thello\n1.5\t2.0\tyou\n")
    assert read_timed_text(path) == (Cue(0, 1.2, "hello"), Cue(1.5, 2.0, "you"))
    path.write_text("start\tend\ttext\n1500\t1200\thello\n")
    with pytest.raises(DnnvssError, match=r"said from 1500 to 1200, .*times in milliseconds"):
        read_timed_text(path)
    with pytest.raises(DnnvssError, match=r"b\.tsv: no such file"):
        read_timed_text(tmp_path / "b.tsv")
    path.write_text("start\tend\tword\n0.5\t0.9\thello\n0.9\t1.2\tyou\n")
    assert [cue.start for cue in read_timed_text(path)] == [0.5, 0.9]


@pytest.mark.parametrize("value", [{}, [], {"segments": []}, 3, [{"start": "soon", "end": 1, "text": "a"}],
                                   [{"start": 2, "end": 1, "text": "a"}], {"landmarks": [[1, 2]]},
                                   {"shots": [{"start": 0, "end": 2, "label": "close-up"}]},
                                   {"results": [{"start_time": 1, "end_time": 2, "alternatives": [{"content": "a"}]},
                                                {"type": "punctuation", "alternatives": [{"content": [1]}]}]}])
def test_other_json_is_refused(tmp_path: Path, value: Any) -> None:
    with pytest.raises(DnnvssError, match=r"no words with times|are no times"):
        read_timed_text(written(tmp_path, "a.json", json.dumps(value)))


def test_tables_and_grids_of_words_are_text_with_times(tmp_path: Path) -> None:
    table = written(tmp_path, "a.csv", "start;end;word\n0,5;0,9;hi\n1;1,5;you\n")
    assert is_words_csv(table) and read_timed_text(table) == (Cue(0.5, 0.9, "hi"), Cue(1, 1.5, "you"))
    assert not is_words_csv(written(tmp_path, "b.csv", "frame, timestamp, x_0\n1, 0.0, 3\n"))
    assert read_timed_text(written(tmp_path, "a.txt", "One line.\n\n And  another.\n")) == (
        Cue(None, None, "One line."), Cue(None, None, "And another."))


def test_cues_that_hold_a_name_alone_say_nothing(tmp_path: Path) -> None:
    lines = ("Ann Lee:", "Ann Lee: Hello there.", "Bob Day:")
    path = written(tmp_path, "a.vtt", "WEBVTT\n\n" + "".join(
        f"00:00:0{k}.000 --> 00:00:0{k + 1}.000\n{line}\n\n" for k, line in enumerate(lines)))
    assert read_timed_text(path) == (Cue(1.0, 2.0, "Hello there."),)
