"""A first look at recordings: a page that opens alone, and what it says of them."""

import re
import shutil
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from films import talker_folder

from data_prep import look, sample
from data_prep.folder import prepare_folder
from data_prep.headers import cut, header, spread
from data_prep.look import first_look
from data_prep.look_pictures import _strokes
from data_prep.looked import said
from data_prep.recipe import Recipe, Source
from dnnvss.commands.prepare import main
from dnnvss.commands.usage import UsageError
from dnnvss.corpus import CorpusInfo
from dnnvss.media import read_audio, read_video, video_info, write_video
from dnnvss.text.coverage import Coverage, prompt_triphones, unsaid


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Five recordings of the built-in talker, one of them without words."""
    raw = talker_folder(tmp_path_factory.mktemp("look"), 5, 80)
    for suffix in (".txt", ".TextGrid"):
        (raw / f"demo_001{suffix}").unlink()
    return raw


def test_a_page_tells_what_is_there_and_nothing_else_is_written(recordings: Path, tmp_path: Path,
                                                                capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    before = sorted(p.name for p in recordings.iterdir())
    status = main(["corpus=folder", f"corpus.raw={recordings}", "corpus.name=me", f"corpus.out={out}", "look=true",
                   "jobs=1"])
    assert status == 0 and f": {out / 'look.html'}" in capsys.readouterr().out
    assert sorted(p.name for p in recordings.iterdir()) == before and [p.name for p in out.iterdir()] == ["look.html"]
    text = (out / "look.html").read_text()
    assert not re.search(r'(src|href)="(?!data:)', text)  # it needs no other file
    assert "4 of 5" in text and "demo_001" in text.split("What will be dropped")[1]
    assert text.count("data:image/jpeg;base64,") >= 12 and re.search(r"80 x 80, \d+ pictures a second, h264", text)
    for name in ("demo_000", "demo_002"):
        words = Path(recordings / f"{name}.txt").read_text().lower()
        assert re.sub(r"[^a-z']+.*", "", words) in text.lower()


def test_what_cannot_be_prepared_still_has_a_page(recordings: Path, tmp_path: Path,
                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    raw = Path(shutil.copytree(recordings, tmp_path / "raw"))
    for path in raw.glob("*.npz"):
        path.unlink()
    named = tmp_path / "none.task"
    page = prepare_folder(raw, tmp_path / "out", landmarker=str(named), then=first_look).read_text()
    assert "none.task: no such file" in page and "Pictures below are without points" in page
    for path in (*raw.glob("*.txt"), *raw.glob("*.TextGrid")):
        path.unlink()
    page = prepare_folder(raw, tmp_path / "out", landmarker=str(named), then=first_look).read_text()
    assert "0 of 5" in page and "The sample" not in page


def test_words_that_are_yet_to_be_written_down_are_no_reason_to_drop(recordings: Path, tmp_path: Path) -> None:
    raw = Path(shutil.copytree(recordings, tmp_path / "raw"))
    for path in (*raw.glob("*.txt"), *raw.glob("*.TextGrid")):
        path.unlink()
    page = prepare_folder(raw, tmp_path / "out", transcribe=True, then=first_look).read_text()
    assert "5 of 5" in page and "its words are not known yet" in page and "(dropped)" not in page
    assert "No text is known yet" in page and "<b>0 s</b><span>of speech" not in page


def test_of_several_videos_of_a_name_one_is_taken_and_told(recordings: Path, tmp_path: Path) -> None:
    raw = Path(shutil.copytree(recordings, tmp_path / "raw"))
    shutil.copy(raw / "demo_000.mp4", raw / "demo_000.MOV")
    page = prepare_folder(raw, tmp_path / "out", then=first_look).read_text()
    assert "there is also demo_000.mov: demo_000.mp4 is taken" in page


def test_of_a_long_recording_a_part_is_looked_at(recordings: Path, tmp_path: Path,
                                                        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sample, "LONG", 1.0)
    monkeypatch.setattr(sample, "PART", 0.8)
    monkeypatch.setattr(look, "SAMPLE", 0.0)
    page = prepare_folder(recordings, tmp_path / "out", then=first_look).read_text()
    assert "it is long" in page and "aligning" in page


def test_a_part_of_a_recording_is_its_pictures_and_their_sound(recordings: Path, tmp_path: Path) -> None:
    video, out = recordings / "demo_000.mp4", tmp_path / "part.mp4"
    rate, whole, sound = video_info(video).rate, read_video(video), read_audio(video)
    for first in (0, 9):
        count = cut(video, None, float(first / rate), 0.4, out)
        assert count == round(0.4 * rate) + 1 and video_info(out).rate == rate
        assert np.abs(read_video(out).astype(float) - whole[first:first + count]).mean() < 3
        start, heard = round(first / rate * 16000), read_audio(out)
        assert len(heard) == pytest.approx(count / rate * 16000, abs=1100)
        true = sound[start:start + len(heard)]
        lags = np.correlate(np.pad(true, 1600), heard[:len(true)], "valid")
        assert first == 0 or abs(int(lags.argmax()) - 1600) <= 1024  # a frame of sound is not cut


def test_a_header_tells_length_pictures_and_sound(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mp4", np.zeros((50, 32, 48, 3), np.uint8), 25, np.zeros(32000, np.float32), 16000)
    found = header(path)
    assert found.seconds == pytest.approx(2.0, abs=0.1)
    assert found.pictures == "48 x 32, 25 pictures a second, h264" and found.sound == "aac, 16000 Hz, mono"


def test_the_first_few_of_a_spread_lie_far_apart() -> None:
    first = spread(range(100), 4)
    assert first[0] == 0 and min(abs(a - b) for a in first for b in first if a != b) > 10
    assert sorted(spread(range(7), 7)) == list(range(7)) and spread([], 3) == []


def test_sounds_of_texts_are_counted_and_missing_triphones_told() -> None:
    recipe = Recipe(CorpusInfo("x", (0, 0), "25", {}, "en_us"))
    coverage = said([Source("a", "bee see", ("bee", "see")), Source("b", "bee", ("bee",))], recipe)
    assert coverage.phones == Counter({"IY": 3, "B": 2, "S": 1})
    assert coverage.heard == {"sil-B+IY", "B-IY+S", "IY-S+IY", "S-IY+sil", "B-IY+sil"} and coverage.triphones == 5
    wanted = {t for own in prompt_triphones("en_us").values() for t in own}
    lacking, count = unsaid(coverage, "en_us")
    assert count == len(wanted) and set(lacking) == wanted - coverage.heard
    assert unsaid(Coverage.of(Counter(), wanted), "en_us") == ([], count)


def test_points_of_a_group_are_joined_where_they_are_near() -> None:
    ring = np.array([[0.0, 0], [2, 0], [2, 2], [0, 2]])
    assert _strokes(ring) == [(0, 1), (1, 2), (2, 3), (3, 0)]
    assert _strokes(np.array([[0.0, 0], [1, 0], [2, 0], [3, 0]])) == [(0, 1), (1, 2), (2, 3)]
    assert _strokes(np.array([[0.0, 0], [1, 0], [9, 0], [10, 0]])) == [(0, 1), (2, 3)]  # two lines in one group
    assert _strokes(ring[:1]) == []


def test_only_recordings_are_looked_at(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no first look"):
        main([f"corpus.out={tmp_path / 'demo'}", "look=true"])
    assert not (tmp_path / "demo").exists()
