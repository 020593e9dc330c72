"""Transcripts and captions hold what nobody says: names of who speaks, laughter, marks of corpora."""

import json
from pathlib import Path

import pytest

from dnnvss.formats import read_timed_text
from dnnvss.formats.transcripts import read_transcript
from dnnvss.formats.unsaid import spoken_lines

CAPTION = "00:00:{0:02d}.000 --> 00:00:{1:02d}.000\n{2}\n\n"


def captions(*texts: str) -> str:
    return "WEBVTT\n\n" + "".join(CAPTION.format(k, k + 1, text) for k, text in enumerate(texts))


@pytest.mark.parametrize(("text", "name", "said"), [
    ("demo_001 Hello there", "demo_001", "Hello there"), ("demo_001.wav|Hello there", "demo_001", "Hello there"),
    ('( demo_001 "Hello there." )', "demo_001", "Hello there."), ("hello there (demo_001)", "demo_001", "hello there"),
    ("2024 was a year", "2024", "2024 was a year"), ("hello there", "hello", "hello there"),
    ("0 46797 She had your dark suit", "sa1", "She had your dark suit"), ("0 10 is a score", "sa1", "0 10 is a score"),
    ("Text:  WHEN YOU COOK\nConf:  5\n\nWORD START END ASDSCORE\nWHEN 0.23 0.34 5.6\n", "00001", "WHEN YOU COOK"),
    ("12. The birch canoe slid", "a", "The birch canoe slid"), ("1) One.\n2) Two.", "a", "One. Two."),
    ("1. One.\nTwo.", "a", "1. One. Two."), ("3.5 is more", "a", "3.5 is more"),
    ("10:30 Is late", "a", "10:30 Is late"),
    ("Text: is the word", "a", "Text: is the word"),
    ("Speaker 1: hello\nthere", "a", "hello there"), ("SPEAKER_00: hello", "a", "hello"), ("ANN: hello", "a", "hello"),
    ("Ann: hello\nBob: there", "a", "hello there"), ("Remember: never do that", "a", "Remember: never do that"),
    (">> Hello. >> Hi.", "a", "Hello. Hi."), ("[laughs] I see (laughs)", "a", "I see"), ("(he left)\nYes", "a", "Yes"),
    ("<|en|><|0.00|> Hi there<|1.74|>", "a", "Hi there"),
    ("%HESITATION yes", "a", "uh yes"), ("we met (in Paris)", "a", "we met (in Paris)"),
])
def test_of_a_transcript_only_what_is_said_is_its_text(text: str, name: str, said: str) -> None:
    assert " ".join(spoken_lines(text, name)) == said


def test_what_was_left_out_is_told(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("Speaker 1: hello\n[music] you\n")
    assert read_transcript(path, "a") == ("hello you", "Speaker 1: [music]")
    path.write_text("Hello,\nyou\n")
    assert read_transcript(path, "a") == ("Hello, you", "")


def test_captions_that_name_who_speaks(tmp_path: Path) -> None:
    """Zoom writes names as they are, Teams in tags; people write them in brackets, and >> for another's turn."""
    path = tmp_path / "a.vtt"
    for texts in (("Ann Lee: Hello", "Ann Lee: there", "you"), ("Hello", "[Ann]: there", "(Ann) you"),
                  ("<v Lee, Ann>Hello</v>", "there", ">> you"), ("*sighs* Hello", "Speaker 1: there", "- you")):
        path.write_text(captions(*texts))
        assert [cue.text for cue in read_timed_text(path)] == ["Hello", "there", "you"], texts
    path.write_text(captions("Note: he said", "that >> I did", "no more"))
    assert [cue.text for cue in read_timed_text(path)] == ["Note: he said", "that I did", "no more"]


def test_transcripts_with_times_name_who_speaks(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("[00:00:00] Ann: Hello\n\n[00:00:05] Bob: there\n\nTranscribed by https://otter.ai\n")
    assert [(cue.start, cue.text) for cue in read_timed_text(path)] == [(0.0, "Hello"), (5.0, "there")]


@pytest.mark.parametrize("value", [
    [{"text": "Hello", "start": 0.5, "duration": 0.5}, {"text": "[Music]", "start": 1.0, "duration": 3.0}],
    {"segments": [{"start": 0.5, "duration": 0.5, "words": [{"text": "Hello", "start": 0.5, "duration": 0.5}]}]},
    {"text": "Hello", "words": [{"text": "Hello", "start": 0.5, "end": 1.0, "type": "word"},
                                {"text": "(laughs)", "start": 1.5, "end": 1.9, "type": "audio_event"}]},
])
def test_json_with_durations_and_sounds(tmp_path: Path, value: object) -> None:
    """Of YouTube's captions as programs fetch them, of Premiere, and of ElevenLabs."""
    path = tmp_path / "a.json"
    path.write_text(json.dumps(value))
    assert [(cue.start, cue.end, cue.text) for cue in read_timed_text(path)] == [(0.5, 1.0, "Hello")]


def test_of_the_columns_of_ljspeech_the_spoken_one_is_said() -> None:
    line = "LJ001-0001|It cost 5 dollars.|It cost five dollars."
    assert spoken_lines(line, "LJ001-0001") == ["It cost five dollars."]
    assert spoken_lines("LJ001-0001|It cost 5 dollars.", "LJ001-0001") == ["It cost 5 dollars."]
