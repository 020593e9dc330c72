"""A made-up corpus in GRID's layout is prepared: words, splits, broken starts; some of the real one where it is."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from conftest import run_command

from data_prep.grid import DIGITS, WORDS, prepare_grid, words_of
from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.formats import write_grid_align
from dnnvss.media import read_audio, write_video
from dnnvss.phones import VOWELS
from dnnvss.speech.formant import synthesise
from dnnvss.text.lexicon import pronunciations
from dnnvss.timing import Alignment, Tier

IDS = ("bbaf2n", "lgbz3a", "prim4p", "swwu5s", "bwax6n")
POINTS, GROUPS = 12, {"lips_outer": [0, 6], "face_oval": [6, 12]}


def truth(name):
    """What is said in the recording of an id, and when: silence of 0.5 s, phones of 100 and 140 ms, silence to 3 s."""
    phones, words, t = [(0.0, 0.5, "sil")], [(0.0, 0.5, "")], 0.5
    for word in words_of(name):
        first, start = pronunciations(word, "en_gb", {"a": "EY"})[0], t
        for phone in first:
            phones.append((t, t := round(t + (0.14 if phone in VOWELS else 0.1), 3), phone))
        words.append((start, t, word))
    end = 3.0 if t < 2.9 else round(t + 0.3, 2)
    return Alignment([Tier("phones", [*phones, (t, end, "sil")]), Tier("words", [*words, (t, end, "")])])


def pictures(count, rng):
    y, x = np.mgrid[0:48, 0:64]
    face = ((x - 32) / 12) ** 2 + ((y - 26) / 18) ** 2 < 1
    return [np.clip(np.where(face, 180, 60 + y)[..., None] + rng.normal(0, 2, (48, 64, 3)), 0, 255).astype(np.uint8)
            for _ in range(count)]


def points(count, rng):
    angle = 2 * np.pi * np.arange(POINTS) / POINTS
    shape = np.stack([32 + 10 * np.cos(angle), 26 + 14 * np.sin(angle)], axis=1)
    moving = np.sin(np.arange(count)[:, None, None] / 5) * (angle < 1)[:, None]
    return shape + moving + rng.normal(0, 0.05, (count, POINTS, 2))


def record(raw, name):
    rng = np.random.default_rng(IDS.index(name))
    said = truth(name)
    count = round(said.end * 25)
    sound = synthesise(said, 16000).astype(np.float32) + rng.normal(0, 1e-4, round(said.end * 16000)).astype(np.float32)
    write_video(raw / "video" / f"{name}.mp4", pictures(count, rng), 25, sound, 16000)
    write_grid_align(raw / "align" / f"{name}.align", said["words"])
    files.write_arrays(raw / "landmarks" / f"{name}.npz", points=np.round(points(count, rng) * 32).astype(np.int16),
                       valid=np.ones(count, bool))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    raw = tmp_path_factory.mktemp("grid") / "raw"
    for name in IDS:
        record(raw, name)
    files.write_json(raw / "landmarks.json", {"scale": 32, "groups": GROUPS})
    return raw


@pytest.fixture
def raw(recorded, tmp_path):
    return Path(shutil.copytree(recorded, tmp_path / "raw"))


def states(out):
    rows = [json.loads(line) for line in (out / "report.jsonl").read_text().splitlines()]
    return {row["id"]: row for row in rows}


def test_an_id_spells_its_sentence():
    assert words_of("bbaf2n") == ("bin", "blue", "at", "f", "two", "now")
    assert words_of("swwzzs") == ("set", "white", "with", "z", "zero", "soon")
    assert words_of("bbaw2n") is None  # GRID leaves out w
    assert words_of("readme") is None
    assert [len(table) for table in WORDS] == [4, 4, 4, 25, len(DIGITS), 4]


def test_a_corpus_is_prepared_and_comes_out_as_it_was_recorded(recorded, tmp_path):
    out = prepare_grid(recorded, tmp_path / "out", jobs=1, sound_delay={".mp4": 0.0})
    corpus = Corpus.open(out)
    assert sorted(corpus.utterances) == sorted(IDS)
    assert corpus.info.size == (64, 48)
    assert (corpus.info.rate, corpus.info.variant) == ("25", "en_gb")
    assert corpus.info.landmark_groups == {"lips_outer": (0, 6), "face_oval": (6, 12)}
    assert sorted(u.id for s in ("train", "val", "test") for u in corpus.split(s)) == sorted(IDS)
    for name, u in corpus.utterances.items():
        said = truth(name)
        assert u.text == " ".join(words_of(name))
        assert u.frames == round(said.end * 25)
        assert u.alignment.end == pytest.approx(u.frames / 25)
        assert [w for w in u.alignment["words"].labels if w] == list(words_of(name))
        starts = [s.start for s in u.alignment["words"] if s.label]
        assert starts == pytest.approx([s.start for s in said["words"] if s.label], abs=0.08)
        found, valid = corpus.landmarks(u)
        stored = np.load(recorded / "landmarks" / f"{name}.npz")["points"] / 32
        assert found.dtype == np.float32
        np.testing.assert_allclose(found[valid], stored[valid], atol=1e-6)
        assert len(read_audio(corpus.path(u, "audio"))) == u.frames * 640
    z = corpus.utterances["lgbz3a"].alignment
    k = int(z["phones"].indices_at(np.array([next(s.start for s in z["words"] if s.label == "z") + 0.01]))[0])
    assert z["phones"].labels[k : k + 3] == ("Z", "EH", "D")
    assert {row["status"] for row in states(out).values()} == {"kept"}


def test_broken_pictures_ghosts_and_bad_files_are_reported(raw, tmp_path):
    rng = np.random.default_rng(9)
    frames = pictures(round(truth("bbaf2n").end * 25), rng)
    frames[:12] = [np.full((48, 64, 3), 128, np.uint8)] * 12
    sound = read_audio(raw / "video" / "bbaf2n.mp4")
    write_video(raw / "video" / "bbaf2n.mp4", frames, 25, sound, 16000)
    marks = read_arrays(raw / "landmarks" / "prim4p.npz")
    marks["points"][40:42] += (200 * rng.normal(size=(2, POINTS, 2))).astype(np.int16)
    files.write_arrays(raw / "landmarks" / "prim4p.npz", **marks)
    (raw / "align" / "swwu5s.align").write_text("0 9000 sil\n9500 12000 set\n")
    out = prepare_grid(raw, tmp_path / "out", jobs=1, sound_delay={".mp4": 0.0})
    found = states(out)
    assert {name: row["status"] for name, row in found.items()} == {
        "bbaf2n": "repaired", "bwax6n": "kept", "lgbz3a": "kept", "prim4p": "repaired", "swwu5s": "dropped"}
    assert found["bbaf2n"]["reasons"] == ["broken pictures in 12 frames (0-11)"]
    assert "landmarks that are not the face in" in found["prim4p"]["reasons"][0]
    assert "swwu5s.align: line 2" in found["swwu5s"]["reasons"][0]
    corpus = Corpus.open(out)
    points_, valid = corpus.landmarks(corpus.utterances["bbaf2n"])
    assert np.flatnonzero(~valid).tolist() == list(range(12))
    assert (points_[:12] == points_[12]).all()
    assert (out / "report.md").read_text().count("| dropped | 1 |") == 1


def test_other_text_than_was_said_is_dropped(raw, tmp_path):
    text = (raw / "align" / "lgbz3a.align").read_text()
    (raw / "align" / "lgbz3a.align").write_text(text.replace("green", "soon").replace("three", "white"))
    out = prepare_grid(raw, tmp_path / "out", jobs=1, sound_delay={".mp4": 0.0})
    assert "the text 'lay soon by z white again'" in states(out)["lgbz3a"]["reasons"][-1]
    assert "its id spells" in states(out)["lgbz3a"]["notes"][0]


def test_a_second_run_does_no_work_and_gives_the_same_corpus(recorded, tmp_path, monkeypatch):
    out = prepare_grid(recorded, tmp_path / "out", jobs=1)
    first = Corpus.open(out).fingerprint
    for work in ("recordings.media", "checks.read_raw", "alignments.heard", "checks.write_clean"):
        monkeypatch.setattr(f"data_prep.{work}", None)
    assert Corpus.open(prepare_grid(recorded, tmp_path / "out", jobs=1)).fingerprint == first


def test_plain_mpg_without_word_times_and_given_splits(raw, tmp_path):
    for path in (raw / "video").iterdir():
        path.rename(raw / f"{path.stem}.mpg")  # the reader goes by what is inside
    shutil.rmtree(raw / "align")
    for name, ids in (("train", IDS[:3]), ("val", IDS[3:4]), ("test", IDS[4:]), ("unseen_test", IDS[:1])):
        files.write_text(raw / "splits" / f"{name}.txt", "\n".join(ids))
    corpus = Corpus.open(prepare_grid(raw, tmp_path / "out", jobs=1, sound_delay={".mp4": 0.0}))
    assert [u.id for u in corpus.split("train")] == list(IDS[:3])
    assert [u.id for u in corpus.split("test", "unseen")] == ["bbaf2n"]
    assert corpus.path(corpus.utterances["bbaf2n"], "video").suffix == ".mpg"


def test_the_command_reads_its_configuration(recorded, tmp_path, capsys):
    assert run_command("prepare", "corpus=grid", f"corpus.raw={recorded}", f"corpus.out={tmp_path}/grid", "jobs=1") == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"Corpus grid: {tmp_path / 'grid'}"
    assert Corpus.open(tmp_path / "grid").info.name == "grid"


def test_a_missing_setting_is_named(capsys):
    assert run_command("prepare", "corpus=grid") == 2
    assert "corpus.raw is not set. Add corpus.raw=... to the command" in capsys.readouterr().err


def test_nothing_to_prepare_is_an_error(raw, tmp_path):
    with pytest.raises(DnnvssError, match="holds no video"):
        prepare_grid(tmp_path, tmp_path / "out")
    for path in (raw / "landmarks").iterdir():
        path.unlink()
    with pytest.raises(DnnvssError, match="none of the 5 utterances can be used"):
        prepare_grid(raw, tmp_path / "out", jobs=1)
    assert not (tmp_path / "out" / "corpus.json").exists()
    (raw / "landmarks.json").unlink()
    with pytest.raises(DnnvssError, match=r"landmarks\.json: no such file"):
        prepare_grid(raw, tmp_path / "out", jobs=1)


@pytest.mark.grid
def test_real_recordings(grid_raw, tmp_path):
    raw = tmp_path / "raw"
    ids = ["brwg8p", "pbio7a", "sbbuzn", "srbh8n", "swab9a", "bbwt1a"]
    for name in ids:
        mpg = grid_raw / "raw" / f"{name}.mpg"
        video = mpg if mpg.is_file() else grid_raw / "video" / f"{name}.mp4"
        for path, folder in ((video, "video"), (grid_raw / "align" / f"{name}.align", "align"),
                             (grid_raw / "landmarks" / f"{name}.npz", "landmarks")):
            (raw / folder).mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, raw / folder / path.name)
    shutil.copyfile(grid_raw / "landmarks.json", raw / "landmarks.json")
    out = prepare_grid(raw, tmp_path / "out", jobs=1)
    found = states(out)
    assert found["pbio7a"]["status"] == "dropped"
    assert found["brwg8p"]["status"] == "repaired"
    assert found["brwg8p"]["reasons"][0] == "broken pictures in 12 frames (0-11)"
    assert found["bbwt1a"]["notes"][0].startswith("'bin' is heard 0.")
    corpus = Corpus.open(out)
    late = [s.start - b.start for u in corpus.utterances.values() if u.id != "bbwt1a"
            for s, b in zip([s for s in u.alignment["words"] if s.label],
                            [s for s in Tier("words", _given(grid_raw, u.id)) if s.label], strict=True)]
    assert np.median(np.abs(late)) < 0.03


def _given(grid_raw, name):
    from dnnvss.formats import read_grid_align
    return read_grid_align(grid_raw / "align" / f"{name}.align").segments
