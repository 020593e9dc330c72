"""A folder as users bring it: what is in it is understood or named, and nothing is silently wrong."""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from films import talker_folder

from data_prep.align import contrast, given
from data_prep.folder import prepare_folder, unspeakable, unspoken, words_of, written
from data_prep.report import Outcome, write_report
from data_prep.shelf import Shelf
from data_prep.splits import given_splits, read_splits, resolved
from data_prep.upright import askew
from dnnvss import files
from dnnvss.corpus import Corpus
from dnnvss.corpus.checkup import held
from dnnvss.errors import DnnvssError
from dnnvss.formats import read_alignment, write_alignment
from dnnvss.media import read_audio, read_video, write_video, write_wav
from dnnvss.timing import Alignment, Tier


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return talker_folder(tmp_path_factory.mktemp("brought"), 5, 64)


@pytest.fixture
def raw(recordings: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(recordings, tmp_path / "raw"))


def prepared(raw: Path, out: Path) -> tuple[Corpus, str]:
    corpus = Corpus.open(prepare_folder(raw, out, jobs=1))
    return corpus, files.read_text(out / "report.md", "")


def test_an_alignment_without_phones_is_told_and_made_anew(tmp_path: Path) -> None:
    path = write_alignment(tmp_path / "a.TextGrid", Alignment([Tier("words", [(0, 0.4, ""), (0.4, 1, "i")]),
                                                               Tier("Ann", [(0, 0.4, ""), (0.4, 1, "AY")])]))
    task = ("a", tmp_path, path, [("i", [("AY",)])], 25, "25", 0.0)
    found = given(*task, audio=tmp_path / "a.wav")["other"]
    assert found.startswith("its alignment has no tier of phones (words, Ann): the sound was aligned in its place")
    with pytest.raises(DnnvssError, match="has no tier of phones"):
        given(*task)


def test_of_an_alignment_and_a_text_of_two_sentences_the_sound_decides(raw: Path, tmp_path: Path) -> None:
    """The alignment is another clip's, the text is another one's, and both are of other clips."""
    shutil.copyfile(raw / "demo_002.TextGrid", raw / "demo_001.TextGrid")
    files.write_text(raw / "demo_003.txt", "A $100 fee plus 5% of $2000.")
    shutil.copyfile(raw / "demo_001.TextGrid", raw / "demo_004.TextGrid")
    files.write_text(raw / "demo_004.txt", "Nobody ever spoke of a hundred hungry elephants")
    corpus, report = prepared(raw, tmp_path / "out")
    assert set(corpus.utterances) == {"demo_000", "demo_001", "demo_002", "demo_003"}
    for name, said in (("demo_001", "its alignment is of another sentence"),
                       ("demo_003", "its text is not what is said"),
                       ("demo_004", "demo_004.TextGrid: utterance demo_004: its words are")):
        assert any(name in line and said in line for line in report.splitlines()), name
    spoken = corpus.utterances["demo_001"]
    first = files.read_text(raw / "demo_001.txt", "").split()[0].lower()
    assert next(w for w in spoken.alignment["words"].labels if w) == first


def test_times_of_half_the_length_and_off_by_half_a_second_are_not_taken(raw: Path, tmp_path: Path) -> None:
    right = {}
    for name, scale, shift in (("demo_001", 0.5, 0.0), ("demo_002", 1.0, -0.25), ("demo_003", 1.0, 0.0)):
        path = raw / f"{name}.TextGrid"
        right[name] = read_alignment(path)
        tiers = []
        for tier in right[name].tiers:
            rows = [(max(s.start * scale + shift, 0), s.end * scale + shift, s.label) for s in tier]
            tiers.append(Tier(tier.name, [(a, b, p) for a, b, p in rows if b > a]))
        write_alignment(path, Alignment(tiers))
    corpus, report = prepared(raw, tmp_path / "out")
    for name, taken in (("demo_001", False), ("demo_002", False), ("demo_003", True)):
        assert any(name in line and "off its sound" in line for line in report.splitlines()) != taken, name
        found = [s.start for s in corpus.utterances[name].alignment["words"] if s.label]
        assert found == pytest.approx([s.start for s in right[name]["words"] if s.label], abs=0.08), name


def test_an_alignment_with_a_word_that_its_aligner_did_not_know_is_made_anew(raw: Path, tmp_path: Path) -> None:
    path = raw / "demo_001.TextGrid"
    right, text = read_alignment(path), path.read_text()
    before, _, behind = text.rpartition(f'text = "{right["phones"].labels[-2]}"')
    path.write_text(f'{before}text = "spn"{behind}')
    corpus, report = prepared(raw, tmp_path / "out")
    assert "its alignment has a word that its aligner did not know (spn): the sound was aligned in its place" in report
    found = [s.start for s in corpus.utterances["demo_001"].alignment["words"] if s.label]
    assert np.abs(np.array(found) - [s.start for s in right["words"] if s.label]).max() < 0.1


def test_one_other_word_is_noted(raw: Path, tmp_path: Path) -> None:
    text = files.read_text(raw / "demo_001.txt", "")
    first, *rest = text.split()
    files.write_text(raw / "demo_001.txt", " ".join(["Elephants", *rest]))
    corpus, report = prepared(raw, tmp_path / "out")
    assert "demo_001" in corpus.utterances and f"its alignment says {first.lower()!r} where" in report


@pytest.mark.parametrize("turned, where", [
    (lambda p: p[..., ::-1], "beside"), (lambda p: p * [1, -1] + [0, 64], "above"),
    (lambda p: p * [-1, 1] + [64, 0], ""), (lambda p: p, "")])
def test_landmarks_of_a_face_that_stands_on_its_head_are_named(
        raw: Path, turned: Callable[[np.ndarray], np.ndarray], where: str) -> None:
    points = np.load(raw / "demo_001.npz")["points"]
    groups = files.read_json(raw / "landmarks.json")["groups"]
    said = askew(turned(points), np.ones(len(points), bool), groups)
    assert (f"the lips {where} the eyes" in said) if where else not said
    assert not askew(points, np.zeros(len(points), bool), groups) and not askew(points, np.ones(len(points), bool), {})


def test_landmarks_that_are_mirrored_or_held_are_told(raw: Path, tmp_path: Path) -> None:
    """x counts from the right in one file, the last face is written again for lost frames in two others."""
    mirrored, stuck, again = (np.load(raw / f"demo_00{k}.npz")["points"] for k in range(3))
    files.write_arrays(raw / "demo_000.npz", points=mirrored * np.float32([-1, 1]) + np.float32([64, 0]))
    files.write_arrays(raw / "demo_001.npz", points=np.repeat(stuck[:1], len(stuck), axis=0))
    again[11:17] = again[10]
    files.write_arrays(raw / "demo_002.npz", points=again)
    corpus, report = prepared(raw, tmp_path / "out")
    assert set(corpus.utterances) == {"demo_002", "demo_003", "demo_004"}
    assert "demo_000 | its landmarks are mirrored: the right eye stands where the left one should" in report
    assert f"{len(stuck) - 1} frames repeat the landmarks of an earlier one: not taken" in report
    assert "demo_002 | landmarks not found in 6 frames (11-16)" in report


def test_what_counts_as_held() -> None:
    moving = np.random.default_rng(0).normal(size=(60, 3, 2))
    assert not held(moving).any()
    moving[10:15], moving[30:36] = moving[9], moving[29]
    assert np.flatnonzero(held(moving)).tolist() == [*range(10, 15), *range(30, 36)]
    moving[14] += 1e-6
    assert np.flatnonzero(held(moving)).tolist() == [*range(30, 36)]
    assert not held(np.round(moving * 100)).any()


def test_times_ten_times_too_small_are_refused(raw: Path, tmp_path: Path) -> None:
    alignment = read_alignment(raw / "demo_001.TextGrid")
    (raw / "demo_001.TextGrid").unlink()
    text = write_alignment(raw / "demo_001.lab", alignment).read_text()
    rows = [line.split() for line in text.splitlines()]
    lines = [f"{int(a) // 10} {int(b) // 10} {' '.join(rest)}" for a, b, *rest in rows]
    files.write_text(raw / "demo_001.lab", "\n".join(lines))
    corpus, report = prepared(raw, tmp_path / "out")
    assert "demo_001" not in corpus.utterances and "too small, about 10 times" in report


def test_silence_that_is_louder_than_speech_is_told() -> None:
    loud = np.random.default_rng(0).normal(0, 0.1, 16000).astype(np.float32)
    loud[8000:] *= 0.001
    right = Tier("phones", [(0, 0.5, "AA"), (0.5, 1, "sil")])
    assert contrast(right, loud) == pytest.approx(60, abs=3)
    assert contrast(Tier("phones", [(0, 0.5, "sil"), (0.5, 1, "AA")]), loud) == pytest.approx(-60, abs=3)
    assert contrast(Tier("phones", [(0, 1, "AA")]), loud) == 0
    drift = np.abs(np.linspace(-1, 1, 16000, dtype=np.float32)) ** 3  # silence at either end is louder with it
    middle = Tier("phones", [(0, 0.25, "sil"), (0.25, 0.75, "AA"), (0.75, 1, "sil")])
    assert contrast(middle, np.roll(loud, 4000) + drift) > 6


def test_names_of_every_system_and_editor_are_one_recording(raw: Path, tmp_path: Path) -> None:
    """Latin-1 bytes, accents taken apart, suffixes in capitals, and the clutter of two systems."""
    for path in sorted(raw.glob("demo_001.*")):
        path.rename(Path(os.fsdecode(os.fsencode(raw) + b"/caf\xe9_1" + path.suffix.encode())))
    for path, stem in zip(sorted(raw.glob("demo_002.*")), ("mu\u0308ll", "m\u00fcll") * 9, strict=False):
        path.rename(raw / f"{stem}{path.suffix}")
    for path in sorted(raw.glob("demo_003.*")):
        path.rename(raw / f"demo_003{path.suffix.upper()}")
    for name in ("._demo_000.mp4", "Thumbs.db", "desktop.ini", ".DS_Store", "._demo_000.txt"):
        (raw / name).write_bytes(b"\0\x05\x16\x07")
    corpus, report = prepared(raw, tmp_path / "out")
    assert set(corpus.utterances) == {"demo_000", "caf\u00e9_1", "m\u00fcll", "demo_003", "demo_004"}
    assert "the name caf\\xe9_1.mp4 is not UTF-8" in report


def test_names_with_a_suffix_too_many_or_of_a_language_are_of_their_video(tmp_path: Path) -> None:
    for name in ("a.mp4", "a.mp4.txt", "A.TextGrid", "b.mov", "b.en-US.srt", "b.wav.vtt", "b.de.srt", "c.mkv",
                 "c.txt.TXT", "c.wav", "d.e.mp4", "d.e.txt"):
        (tmp_path / name).write_text("hi")
    shelf = Shelf(tmp_path)
    taken = {name: [p.name for s in (".txt", ".textgrid", ".srt", ".vtt", ".wav") if (p := shelf.get(name, s))]
             for name in ("a", "b", "c", "d.e")}
    assert taken == {"a": ["a.mp4.txt", "A.TextGrid"], "b": ["b.en-US.srt", "b.wav.vtt"], "c": ["c.txt.TXT", "c.wav"],
                     "d.e": ["d.e.txt"]}
    assert "b.de.srt" in [p.name for p in shelf.others("b")]


def test_others_of_a_recording_are_its_own_and_those_behind_a_dot(tmp_path: Path) -> None:
    names = ["a.mp4", "a.old.mp4", "a.old.doc", "ab.mp4", "b.x.y.rtf", ".hidden.doc"]
    for name in names:
        (tmp_path / name).write_bytes(b"")
    shelf = Shelf(tmp_path)
    found = {name: sorted(p.name for p in shelf.others(name)) for name in ("a", "a.old", "ab", "b", "b.x", "c", "")}
    assert found == {"a": ["a.mp4", "a.old.doc", "a.old.mp4"], "a.old": ["a.old.doc", "a.old.mp4"], "ab": ["ab.mp4"],
                     "b": ["b.x.y.rtf"], "b.x": ["b.x.y.rtf"], "c": [], "": []}


def test_a_text_that_lies_there_in_another_form_is_named_with_what_to_do(tmp_path: Path) -> None:
    for name, other, said in (("a", "a.docx", "save its words as plain text, a.txt"),
                              ("b", "b.de.srt", "rename it b.srt"), ("e", "e.npz", "corpus.importer.transcribe=true"),
                              ("c d", "c d.ass", "ffmpeg -i 'c d.ass' 'c d.srt'")):
        (tmp_path / f"{name}.mp4").touch()
        (tmp_path / other).touch()
        with pytest.raises(DnnvssError, match="no such file") as found:
            written(Shelf(tmp_path), name)
        assert said in str(found.value)


def test_a_muted_video_takes_the_sound_beside_it_and_a_spare_sound_is_told(raw: Path, tmp_path: Path) -> None:
    for name, level in (("demo_001", 0.0), ("demo_002", 1.0)):
        pictures, sound = read_video(raw / f"{name}.mp4"), read_audio(raw / f"{name}.mp4")
        write_wav(raw / f"{name}.wav", sound, 16000)
        write_video(raw / f"{name}.mp4", pictures, 30, level * sound)
    corpus, report = prepared(raw, tmp_path / "out")
    assert {"demo_001", "demo_002"} <= set(corpus.utterances)
    assert "demo_002 | it has a sound of its own: demo_002.wav is not used" in report
    assert "demo_001.wav" not in report


@pytest.mark.parametrize("encoded, noted", [
    (lambda t: t.encode("utf-16"), False), (lambda t: t.encode("utf-8-sig"), False),
    (lambda t: t.encode("utf-16-be"), False), (lambda t: t.encode("cp1252"), True),
    (lambda t: t.replace("\n", "\r\n").encode(), False), (lambda t: t.replace("\n", "\r").encode(), False)])
def test_transcripts_of_every_editor_are_read(raw: Path, tmp_path: Path, encoded: Callable[[str], bytes],
                                              noted: bool) -> None:
    text = "\u201c" + files.read_text(raw / "demo_001.txt", "").strip() + "\u201d\n"
    (raw / "demo_001.txt").write_bytes(encoded(text))
    corpus, report = prepared(raw, tmp_path / "out")
    assert corpus.utterances["demo_001"].text == text.strip()
    assert ("demo_001 | its transcript is not UTF-8" in report) == noted


def test_a_transcript_named_lab_is_taken_and_one_of_times_is_named(raw: Path, tmp_path: Path) -> None:
    (raw / "demo_001.txt").rename(raw / "demo_001.lab")
    files.write_text(raw / "demo_002.txt", "0.1\t0.5\tthe\n0.5\t0.9\tcat\n")
    corpus, report = prepared(raw, tmp_path / "out")
    assert "demo_001" in corpus.utterances and "demo_002" not in corpus.utterances
    assert "demo_002.txt: utterance demo_002: holds times, and no text" in report


def test_splits_of_editors_name_recordings_and_what_is_none_is_told(raw: Path, tmp_path: Path) -> None:
    (raw / "splits").mkdir()
    (raw / "splits" / "Train.TXT").write_bytes("\ufeffdemo_000\r\nclips/demo_001.mp4\r\nnobody\r\n".encode())
    (raw / "splits" / "val.txt").write_bytes("DEMO_002\n\n".encode("utf-16"))
    (raw / "splits" / "._val.txt").write_bytes(b"\0\0")
    corpus, report = prepared(raw, tmp_path / "out")
    ids = {split: [u.id for u in corpus.split(split)] for split in ("train", "val", "test")}
    assert ids["train"] == ["demo_000", "demo_001"] and ids["val"] == ["demo_002"]
    assert set(ids["test"]) <= {"demo_003", "demo_004"} and ids["test"]
    assert "splits/train.txt names what is no recording here: nobody" in report


def test_lines_of_splits_as_tools_write_them_name_their_recordings(tmp_path: Path) -> None:
    ids = ["a", "b", "c d", "e,f"]
    lines = {"a.mp4;b": ["a", "b"], "a, c d.wav": ["a", "c d"], "b|three words": ["b"], "a\t0.5\t1": ["a"],
             "e,f": ["e,f"], "'a','b'": ["a", "b"], "x|a": [], "# a": [],
             "a b": ["a", "b"], "a # held out": ["a"], "12 b": ["b"], '["a",': ["a"], "b\u200b": ["b"], "x a": []}
    for line, want in lines.items():
        found, notes = resolved({"train": [line]}, ids)
        assert found["train"] == want and bool(notes) == (line in ("x|a", "x a")), line
    folder = tmp_path / "splits"
    folder.mkdir()
    (folder / "dev.txt").write_text("b\n")
    assert read_splits(folder) == {"val": ["b"]}
    for name, role in (("Training", "train"), ("tst", "test"), ("train_list", "train"), ("filelist_test", "test")):
        (folder / f"{name}.txt").write_text("id\na\n")
        assert read_splits(folder) == {"val": ["b"], role: ["a"]}, name
        (folder / f"{name}.txt").unlink()
    (folder / "train.csv").write_text("id\na\n")
    with pytest.raises(DnnvssError, match=r"train\.csv: is no list .* train\.txt"):
        read_splits(folder)


def test_a_recording_in_two_splits_under_two_names_is_refused() -> None:
    with pytest.raises(DnnvssError, match="both name a"):
        resolved({"train": ["a"], "test": ["a.mp4"]}, ["a", "b"])


def test_splits_beside_the_recordings_are_not_passed_over(tmp_path: Path) -> None:
    """A folder of another case is read; a list in no folder is refused, unless it is the transcript of a recording."""
    for name in ("a.mp4", "b.mp4", "test.mp4"):
        (tmp_path / name).touch()
    (tmp_path / "test.txt").write_text("a b\n")
    (tmp_path / "train.txt").write_text("what is this\n")
    assert given_splits(tmp_path) == {}
    (tmp_path / "train.txt").write_text("b.mp4\na.mp4\n")
    with pytest.raises(DnnvssError, match=r"train\.txt: is a list of recordings, and lies beside them\. .*splits"):
        given_splits(tmp_path)
    (tmp_path / "Splits").mkdir()
    (tmp_path / "train.txt").rename(tmp_path / "Splits" / "train.txt")
    assert given_splits(tmp_path) == {"train": ["b.mp4", "a.mp4"]}


def test_a_word_in_other_letters_is_not_passed_over() -> None:
    """The words around it would be laid over its sound."""
    assert words_of("Beta \u03b1, na\u00efve \U0001f642!", "en_us", Path("a.txt"), "a") == ("beta", "alpha", "naive")
    assert words_of("20 k\u03a9 on it", "en_us", Path("a.txt"), "a") == ("twenty", "kiloohms", "on", "it")
    for text, word in (("hello \u043c\u0438\u0440 friend", "\u043c\u0438\u0440"), ("\u65e5\u672c", "\u65e5\u672c"),
                       ("it\ufffds fine", "it\ufffds")):
        with pytest.raises(DnnvssError, match=f"cannot speak '{word}'. Write it in English words"):
            words_of(text, "en_us", Path("a.txt"), "a")
    assert not list(unspeakable("Beta \u03b1 it's", "en_us"))
    (told,) = unspoken(list(unspeakable("hello \u043c\u0438\u0440 friend", "en_us")))
    assert told.endswith("that cannot be spoken, and are not learnt from where they are said (1): '\u043c\u0438\u0440'")


def test_a_name_with_a_line_break_stays_in_its_row_of_the_report(tmp_path: Path) -> None:
    dropped = Outcome("new\nli|ne")
    dropped.drop("its name")
    rows = write_report(tmp_path, [dropped]).read_text().splitlines()
    assert "| new li\\|ne | its name |" in rows
