"""Recordings of any size, clock and turn in one folder become one corpus, their landmarks with them."""

import json
import shutil
import struct
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from films import QUARTER, film, pictures, talker_folder
from scipy.io import wavfile

from data_prep.evening import moved, placed, told
from data_prep.folder import prepare_folder
from data_prep.media import CLIPPED, media
from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.corpus import Corpus
from dnnvss.formats import write_npz
from dnnvss.formats.openface import Landmarks
from dnnvss.media import SOUND_RATE, read_audio, read_video, video_info, write_video, write_wav


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return talker_folder(tmp_path_factory.mktemp("films"), 5, 64)


@pytest.fixture
def raw(recordings: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(recordings, tmp_path / "raw"))


def remade(raw: Path, name: str, suffix: str = ".mp4", images: np.ndarray | None = None, ticks: object = None,
           base: int = 30, scale: tuple[float, float] = (1, 1), often: int = 1, **film_settings: object) -> Path:
    """Write a recording anew, and its landmarks as a tracker sees them in the new one."""
    old = raw / f"{name}.mp4"
    shown = read_video(old) if images is None else images
    shown = np.repeat(shown, often, axis=0)
    sound = read_audio(old, SOUND_RATE)
    old.unlink()
    kept = read_arrays(raw / f"{name}.npz")
    points = (kept["points"] + 0.5) * np.array(scale, np.float32) - 0.5
    write_npz(raw / f"{name}.npz", Landmarks(np.repeat(points, often, 0), np.repeat(kept["valid"], often, 0)))
    ticks = range(len(shown)) if ticks is None else ticks
    return film(raw / f"{name}{suffix}", list(shown), ticks, base, sounds=[[(0.0, sound[None])]],  # type: ignore[arg-type]
                rate=SOUND_RATE, sound_codec="pcm_s16le" if suffix == ".mov" else "aac", **film_settings)  # type: ignore[arg-type]


def check_same(raw: Path, corpus: Corpus, name: str, far: float) -> None:
    """The clip and its landmarks are those of the talker, within ``far`` pixels."""
    u = corpus.utterances[name]
    points, valid = corpus.landmarks(u)
    assert video_info(corpus.path(u, "video")).plain and len(read_video(corpus.path(u, "video"))) == u.frames
    assert len(points) == u.frames and valid.mean() > 0.8
    assert len(read_audio(corpus.path(u, "audio"))) == round(float(u.frames / u.rate) * 16000)
    truth = read_arrays(raw / f"{name}.truth.npz")["points"]
    nearest = np.minimum(np.round(np.arange(u.frames) / float(u.rate) * 30).astype(int), len(truth) - 1)
    assert np.abs(points - truth[nearest])[valid].max() < far


def keep_truth(raw: Path) -> None:
    for path in raw.glob("demo_???.npz"):
        shutil.copyfile(path, path.with_suffix(".truth.npz"))


def prepared(raw: Path, out: Path) -> tuple[Corpus, dict[str, str]]:
    corpus = Corpus.open(prepare_folder(raw, out, jobs=1))
    rows = [json.loads(line) for line in files.read_text(out / "report.jsonl", "").splitlines()]
    return corpus, {row["id"]: "; ".join(row["notes"]) for row in rows}


def test_turned_wide_large_and_fast_recordings_join_the_others(raw: Path, tmp_path: Path) -> None:
    keep_truth(raw)
    up = read_video(raw / "demo_001.mp4")
    remade(raw, "demo_001", images=np.rot90(up, 1, axes=(1, 2)), matrix=QUARTER)
    narrow = read_video(raw / "demo_002.mp4")[:, :, ::2]
    remade(raw, "demo_002", images=narrow, pixel=Fraction(2), scale=(0.5, 1))
    large = read_video(raw / "demo_003.mp4").repeat(2, axis=1).repeat(2, axis=2)
    remade(raw, "demo_003", images=large, scale=(2, 2))
    remade(raw, "demo_004", often=2, base=60, told=60)
    corpus, notes = prepared(raw, tmp_path / "out")
    assert set(corpus.utterances) == {f"demo_00{k}" for k in range(5)} and corpus.info.size == (64, 64)
    assert {u.rate for u in corpus.utterances.values()} == {Fraction(30)}
    for name, far in (("demo_001", 1e-3), ("demo_002", 1e-3), ("demo_003", 1e-3), ("demo_004", 1e-3)):
        check_same(raw, corpus, name, far)
    turned = read_video(corpus.path(corpus.utterances["demo_001"], "video"))
    assert np.abs(turned.astype(float) - up).mean() < 3
    assert "from 32 x 64 with pixels of 2 to 64 x 64" in notes["demo_002"]
    assert "from 128 x 128 to 64 x 64" in notes["demo_003"] and "from 60 by its time stamps" in notes["demo_004"]


def test_quicktime_clips_of_600_ticks_have_one_rate(raw: Path, tmp_path: Path) -> None:
    for name in ("demo_000", "demo_001", "demo_002", "demo_003", "demo_004"):
        count = len(read_video(raw / f"{name}.mp4"))
        ticks = [round(k * 1001 / 30000 * 600) for k in range(count)]
        remade(raw, name, ".mov", ticks=ticks, base=600, told=Fraction(30000, 1001))
    corpus, notes = prepared(raw, tmp_path / "out")
    assert len(corpus.utterances) == 5
    assert {u.rate for u in corpus.utterances.values()} == {Fraction(30000, 1001)}
    assert not any("brought" in note for note in notes.values())


def test_of_a_variable_rate_pictures_and_sound_stay_together(raw: Path, tmp_path: Path) -> None:
    keep_truth(raw)
    count = len(read_video(raw / "demo_001.mp4"))
    missing = [k for k in range(count) if k % 7 and not 20 <= k < 24]
    images = read_video(raw / "demo_001.mp4")[missing]
    kept = read_arrays(raw / "demo_001.npz")
    write_npz(raw / "demo_001.npz", Landmarks(kept["points"][missing], kept["valid"][missing]))
    remade(raw, "demo_001", images=images, ticks=[3000 * k for k in missing], base=90000)
    corpus, _ = prepared(raw, tmp_path / "out")
    u = corpus.utterances["demo_001"]
    points, valid = corpus.landmarks(u)
    truth = kept["points"]
    assert abs(u.frames - count) <= 1
    # frame 1 is the first that was taken, so tick i of the corpus is frame i + 1
    off = np.abs(points - truth[np.minimum(np.arange(u.frames) + 1, count - 1)]).max(axis=(1, 2))
    taken = np.isin(np.arange(u.frames) + 1, missing)
    assert off[taken & valid].max() < 1e-3


@pytest.mark.parametrize("short", [1, 2, -1, -2])
def test_landmarks_a_row_or_two_short_or_long_are_used_and_told(raw: Path, tmp_path: Path, short: int) -> None:
    kept = read_arrays(raw / "demo_001.npz")
    rows = np.minimum(np.arange(len(kept["points"]) - short), len(kept["points"]) - 1)
    write_npz(raw / "demo_001.npz", Landmarks(kept["points"][rows], kept["valid"][rows]))
    corpus, notes = prepared(raw, tmp_path / "out")
    assert "demo_001" in corpus.utterances
    assert f"has {len(rows)} rows of landmarks for {len(kept['points'])} frames" in notes["demo_001"]


def test_a_smaller_picture_of_another_shape_stands_in_the_middle() -> None:
    assert placed((640, 480), Fraction(1), (320, 240)) == (0.5, 0.5, 0, 0)
    assert placed((480, 640), Fraction(1), (320, 240)) == (180 / 480, 240 / 640, 70, 0)
    assert placed((720, 576), Fraction(16, 15), (768, 576)) == (768 / 720, 1, 0, 0)
    points = np.array([[0.0, 0.0], [479.0, 639.0]])
    np.testing.assert_allclose(moved(points, (0.375, 0.375, 70, 0)), [[69.6875, -0.3125], [249.3125, 239.3125]])


def test_sound_that_is_clipped_is_told_and_one_beyond_full_scale_keeps_its_shape(tmp_path: Path) -> None:
    video = write_video(tmp_path / "a.mp4", np.zeros((50, 32, 48, 3), np.uint8), 25)
    wave = np.sin(np.arange(32000) / 20) * np.linspace(0, 1, 32000)
    for gain, wanted in ((0.9, False), (5.0, True)):
        sound = write_wav(tmp_path / "a.wav", (gain * wave).astype(np.float32), 16000)
        known = media("a", video, tmp_path / "out", 0.0, sound)
        assert (known["clipped"] > CLIPPED) == wanted
        assert ("is clipped" in str(told(known, {"size": known["size"], "untouched": True}))) == wanted
    wavfile.write(tmp_path / "a.wav", 16000, (5 * wave).astype(np.float32))
    known = media("a", video, tmp_path / "out", 0.0, tmp_path / "a.wav")
    kept = read_audio(tmp_path / "out" / known["sound"])
    assert known["clipped"] < CLIPPED and np.corrcoef(kept, wave[: len(kept)])[0, 1] > 0.9999


def test_sound_that_ends_elsewhere_than_the_pictures_is_told(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).normal(0, 0.1, 64000).astype(np.float32)
    for seconds, said in ((4.0, "goes on for 2.0 s after its last picture"), (1.0, "ends 1.0 s before"), (2.2, "")):
        video = write_video(tmp_path / "a.mp4", np.zeros((50, 32, 48, 3), np.uint8), 25,
                            noise[: round(seconds * 16000)], 16000)
        known = media("a", video, tmp_path / "out", 0.0)
        assert known["ends"] == pytest.approx(seconds - 2, abs=0.1)
        notes = told(known, {"size": known["size"], "untouched": True})
        assert len(notes) == bool(said) and said in "".join(notes)


def test_a_recording_that_breaks_off_is_told(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).normal(0, 0.1, (1, 48000)).astype(np.float32)
    path = film(tmp_path / "a.mkv", pictures(25) * 3, range(75), 25, sounds=[[(0.0, noise)]])
    assert media("a", path, tmp_path / "out", 0.0)["lacks"] < 0.1
    data = bytearray(path.read_bytes())
    at = data.index(b"\x44\x89\x88") + 3  # its length in milliseconds
    data[at : at + 8] = struct.pack(">d", 5000.0)
    path.write_bytes(data)
    known = media("a", path, tmp_path / "out", 0.0)
    notes = "".join(told(known, {"size": known["size"], "untouched": True}))
    assert "breaks off: of the 5.0 s that it says it lasts, 3.0 s are there" in notes
