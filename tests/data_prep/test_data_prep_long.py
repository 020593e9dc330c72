"""A long recording with what is said in it becomes utterances; what does not belong is named with its time."""

import re
from pathlib import Path

import numpy as np
import pytest
from films import Said, lecture, subtitles

from data_prep import transcribing
from data_prep.folder import prepare_folder
from data_prep.long import cut_recordings
from data_prep.long_found import left_out, off_line
from data_prep.long_told import long_script
from data_prep.recipe import Source
from data_prep.script import Script
from data_prep.shelf import Shelf
from data_prep.stages import Workshop
from dnnvss.acoustics.transcriber import Transcript, plain
from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.formats import Cue, read_timed_text, write_srt
from dnnvss.media import write_video
from dnnvss.speech.passages import Passage
from dnnvss.speech.utterances import Timed


@pytest.fixture(scope="module")
def filmed(demo: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Said]]:
    """A lecture of five sentences, and when each is said."""
    folder = tmp_path_factory.mktemp("lecture")
    said = lecture(demo, folder, gap=0.6, count=5)
    return folder, said


@pytest.fixture(scope="module")
def prepared(filmed: tuple[Path, list[Said]]) -> Path:
    """The lecture with subtitles in disorder: 1.2 s late, one sentence missing, one that is not said."""
    raw, said = filmed
    cues = [(text, a + 1.2, b + 1.2) for text, a, b in said if text != said[2].text]
    cues.append(("Nobody ever said these seven words here.", cues[3][1] - 0.5, cues[3][1] - 0.2))
    (raw / "lecture.srt").write_text(subtitles(cues[::-1]))
    return prepare_folder(raw, raw.parent / f"{raw.name}-out", jobs=1, backend="threading")


def test_a_lecture_becomes_its_sentences(filmed: tuple[Path, list[Said]], prepared: Path) -> None:
    said = [s for k, s in enumerate(filmed[1]) if k != 2]
    corpus = Corpus.open(prepared)
    made = list(corpus.utterances.values())
    assert [u.text for u in made] == [s.text for s in said]
    for u, s in zip(made, said, strict=True):
        clock = u.id.removeprefix("lecture_")
        begins = int(clock[2:4]) * 60 + int(clock[4:6]) + int(clock[7:]) / 100
        assert begins == pytest.approx(s.start, abs=0.1)
        words = [w for w in u.alignment["words"] if w.label]
        assert words[-1].end - words[0].start == pytest.approx(s.end - s.start, abs=0.1)
        assert corpus.landmarks(u)[1].mean() > 0.9


def test_what_does_not_belong_is_named_with_its_time(filmed: tuple[Path, list[Said]], prepared: Path) -> None:
    report = (prepared / "report.md").read_text()
    assert "cut at pauses into 4 utterances" in report and "beside it lies lecture.srt" in report
    assert "3 cues stood before earlier ones and were put in order" in report
    assert re.search(r"its times are 1\.[23] s late and were put right", report)
    missing = filmed[1][2]
    at = next(line for line in report.splitlines() if "something sounds that the text does not have" in line)
    assert f"0:00:{missing.start:04.1f}"[:6] in at.split("|")[2]
    assert "nobody ever said these seven words here" in report


def test_nothing_is_done_twice_and_another_text_is_refused(filmed: tuple[Path, list[Said]], prepared: Path,
                                                           tmp_path: Path) -> None:
    clips = {p: p.stat().st_mtime_ns for p in (prepared / ".stages" / "clips").iterdir()}
    source = Source("lecture", video=filmed[0] / "lecture.mp4", script=filmed[0] / "lecture.srt", long="long")
    shop = Workshop(prepared, 1, "threading")
    cuts = cut_recordings([source], shop, "en_us", {})
    assert len(cuts.sources) == 4 and clips == {p: p.stat().st_mtime_ns for p in clips}
    other = tmp_path / "other.txt"
    other.write_text("Fourscore and seventy years ago our fathers brought forth a new nation here.\n" * 3)
    refused = cut_recordings([Source("lecture", video=source.video, script=other, long="long")], shop, "en_us", {})
    assert [s.id for s in refused.sources] == ["lecture"] and "is not what is said in it" in refused.sources[0].problem


@pytest.mark.parametrize(("names", "text", "seconds", "want"), [
    ({"a.txt"}, "one line", 90, None), ({"a.txt"}, "word " * 50, 3, None), ({"a.txt"}, "word " * 50, 90, "a.txt"),
    ({"a.srt"}, "", 3, "a.srt"), ({"a.txt", "a.vtt"}, "one line", 90, None),
    ({"a.txt", "a.vtt"}, "word " * 50, 90, "a.vtt"), ({"a.csv"}, "start,end,word\n0,1,hi\n", 3, "a.csv"),
    ({"a.tsv"}, "start\tend\ttext\n0\t900\thi\n", 3, "a.tsv"), ({"a.tsv"}, "id\tx\n1\t2\n", 3, None),
    ({"a.csv", "a.txt"}, "one line", 3, None), (set(), "", 90, None), ({"a.lab"}, "word " * 50, 90, "a.lab"),
    ({"a.TextGrid"}, "", 3, None)])
def test_a_recording_is_long_by_what_lies_beside_it_and_its_length(
        names: set[str], text: str, seconds: float, want: str | None, tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch) -> None:
    for name in {"a.mp4", *names}:
        (tmp_path / name).write_text(text)
    monkeypatch.setattr("data_prep.long_told.seconds_of", lambda path: seconds)
    found = long_script(Shelf(tmp_path), "a", tmp_path / "a.mp4")
    assert (found[0].name if found else None) == want


def test_a_script_knows_how_its_words_are_written() -> None:
    script = Script([Cue(1.0, 3.0, "It cost $5, really."), Cue(4.0, 4.2, "Poor"), Cue(4.2, 4.5, "No"),
                     Cue(4.5, 4.8, "left.")], "en_us")
    assert script.words == ["it", "cost", "five", "dollars", "really", "poor", "no", "left"]
    assert script.ends == [False, False, False, True, True, False, False, True]
    assert script.text(0, 5) == "It cost $5, really." and script.text(0, 4) == "It cost $5,"
    assert script.text(3, 8) == "dollars really Poor No left." and script.text(5, 8) == "Poor No left."
    assert script.given[1] == pytest.approx((1.4, 2.0))
    plain = Script([Cue(None, None, "One two. Three " + "four " * 60)], "en_us")
    assert plain.given == [None] * 63 and plain.ends[1] and not plain.ends[42] and plain.ends[-1]


def test_times_that_drift_are_told_and_words_off_the_line_left_out() -> None:
    given = [(10.0 * k, 2.0) for k in range(40)]
    words: list[Timed | None] = [Timed(1.01 * 10 * k - 2, 1.01 * 10 * k - 1.8, -10) for k in range(40)]
    words[7] = Timed(60.0, 60.2, -10)
    off, notes = off_line(words, given)
    assert off == [7] and any("drift by 1.0 %" in note for note in notes)
    assert off_line(words, [None] * 40) == ([], [])


def test_what_is_left_out_is_told_in_order() -> None:
    words: list[Timed | None] = [Timed(1, 1.5, -10), None, None, Timed(8, 8.5, -10)]
    spans = [(1.0, 1.5), (3.0, 5.0), (8.0, 8.5), (9.0, 9.2)]
    found = left_out("a.mp4", ["w", "x", "y", "z"], words, [Passage(1, 1.5, 0, 1), Passage(8, 8.5, 3, 4)], {}, spans)
    assert [(round(p.start, 1), round(p.end, 1)) for p in found] == [(1.5, 8.0), (3.0, 5.0)]
    assert "2 words are not said where they should be: 'x y'" in found[0].why
    failed = left_out("a.mp4", ["w", "x"], [None, None], [Passage(1, 2, 0, 2)], {0: "does not fit"}, [(1.0, 2.0)])
    assert [tuple(p) for p in failed] == [("a.mp4", 1, 2, "does not fit")]


def test_what_is_written_down_stays_for_its_reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    sound = np.zeros(64000, np.float32)
    sound[16000:24000], sound[40000:56000] = rng.uniform(-0.5, 0.5, 8000), rng.uniform(-0.5, 0.5, 16000)
    write_video(tmp_path / "a.mp4", [np.zeros((32, 32, 3), np.uint8)] * 100, 25, sound)
    monkeypatch.setattr(transcribing, "check_transcriber", lambda: None)
    monkeypatch.setattr(transcribing, "transcribe", lambda s: Transcript(f"{len(s) / 16000:.1f} seconds.", -0.1))
    shop = Workshop(tmp_path / "out", 1, "threading")
    path = transcribing.written_down({"a": tmp_path / "a.mp4"}, shop)["a"]
    assert isinstance(path, Path) and path.read_text() == "1.0 seconds. 1.5 seconds.\n"
    path.write_text("mended\n")
    assert transcribing.written_down({"a": tmp_path / "a.mp4"}, shop) == {"a": path}
    assert path.read_text() == "mended\n"
    path.unlink()
    monkeypatch.setattr(transcribing, "LONG", 3.0)
    transcribing.write_down("a", tmp_path / "out", tmp_path / "a.mp4")
    cues = read_timed_text(tmp_path / "out" / "transcripts" / "a.srt")
    assert [c.start for c in cues] == pytest.approx([0.75, 2.25], abs=0.05)


def test_tokens_are_bytes_and_subtitles_are_written_as_they_are_read(tmp_path: Path) -> None:
    assert plain(["<|0.00|>", "ĠIt", "'s", "Ġ", "caf", "Ã", "©", "."]) == "It's café."
    cues = (Cue(0.5, 61.25, "One."), Cue(3661.0, 3662.5, "Two, three."))
    assert read_timed_text(write_srt(tmp_path / "a.srt", cues)) == cues


def test_without_its_library_nothing_is_written_down(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def lacks() -> None:
        raise DnnvssError("transcribe=true needs Whisper tiny.en, and its weights are not installed")

    monkeypatch.setattr(transcribing, "check_transcriber", lacks)
    with pytest.raises(DnnvssError, match="needs Whisper"):
        transcribing.written_down({"a": tmp_path / "a.mp4"}, Workshop(tmp_path / "out", 1, "threading"))
