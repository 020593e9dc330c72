"""A face that follows a voice: the same however the sound is cut, as late as it says, and as the offline result."""

import io
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from conftest import CLOCK, ROOT, composed, run_command

from dnnvss.acoustics import Encoder, LogMel, encoder
from dnnvss.commands import live
from dnnvss.commands.live import Outputs, Sink, blocks, check_places, follow
from dnnvss.commands.train import train
from dnnvss.corpus import Corpus
from dnnvss.curves import Stream
from dnnvss.errors import DnnvssError
from dnnvss.features import FeatureTable, Settings
from dnnvss.features.encode import encode_recording
from dnnvss.features.recording import Recording
from dnnvss.features.stream import FeatureStream, heard_ahead, reach
from dnnvss.media import Sound, read_audio, write_wav
from dnnvss.media.live import SoundBytes
from dnnvss.runs.run import Run
from dnnvss.synthesis.live import LiveDial, LiveFace, LiveResampling, LiveSettings, gains
from dnnvss.systems import Example
from dnnvss.timing import Alignment, FrameClock, Tier

RATE = 16000
TABLE = FeatureTable(("logmel", "logmel_window", "energy"), Settings(
    logmel=LogMel(bands=6, causal=True), logmel_offsets=(-7, 3)))


def noise(seconds: float, seed: int = 0) -> np.ndarray:
    """A sound that swells, float32."""
    count = round(seconds * RATE)
    swell = np.sin(np.arange(count) / RATE * 9) ** 2
    return (np.random.default_rng(seed).normal(size=count) * 0.1 * swell).astype(np.float32)


def cut(samples: np.ndarray, seed: int) -> Iterator[np.ndarray]:
    """Pieces of any size, also none."""
    ends = np.sort(np.random.default_rng(seed).integers(0, len(samples), 40))
    yield from np.split(samples, ends)


@pytest.mark.parametrize("seconds", [0.6, 0.604, 0.02])
def test_columns_are_those_of_the_whole_sound(seconds: float) -> None:
    table = FeatureTable(("logmel", "logmel_window"), TABLE.settings)
    samples = noise(seconds)
    whole = encode_recording(Recording(None, "", Sound(samples, RATE)), table, CLOCK)
    stream = FeatureStream(table, CLOCK)
    found = [stream.push(piece)[1] for piece in cut(samples, 1)]
    assert len(np.concatenate(found)) >= len(whole) - 3 - 1  # what the offsets wait for
    found.append(stream.finish()[1])
    np.testing.assert_allclose(np.concatenate(found), whole.numeric(np.arange(len(whole))), rtol=1e-5, atol=1e-5)
    assert max(len(rows) for rows in stream.rows.values()) <= 7 + 3 + 1 + len(whole)


def test_what_the_encoder_hears_comes_frame_by_frame_too(monkeypatch: pytest.MonkeyPatch) -> None:
    mix = np.random.default_rng(0).normal(size=(80, 384)) / 9
    monkeypatch.setattr(encoder, "run_encoder", lambda energies: (energies[:, ::2].T @ mix).astype(np.float32))
    table = FeatureTable(("logmel", "encoder", "encoder_window"), replace(
        TABLE.settings, encoder=Encoder(causal=True, window=30, hop=3, ahead=4), encoder_offsets=(-3, 2)))
    samples = noise(0.9)
    whole = encode_recording(Recording(None, "", Sound(samples, RATE)), table, CLOCK)
    stream = FeatureStream(table, CLOCK)
    found = np.concatenate([*(stream.push(piece)[1] for piece in cut(samples, 1)), stream.finish()[1]])
    np.testing.assert_allclose(found, whole.numeric(np.arange(len(whole))), rtol=1e-3, atol=1e-3)
    assert heard_ahead(table) == pytest.approx(0.14) and reach(table) == (3, 2)


def test_what_nobody_knows_in_time_is_refused() -> None:
    with pytest.raises(DnnvssError, match=r"reads phones, which nobody knows as the sound comes"):
        FeatureStream(FeatureTable(("centre_phone", "logmel"), TABLE.settings), CLOCK)
    with pytest.raises(DnnvssError, match=r"labels\.logmel\.causal=true"):
        FeatureStream(FeatureTable(("logmel",)), CLOCK)


@pytest.mark.parametrize("target", [25, "29.97", 60, 100])
def test_rows_between_clocks_lie_on_lines(target: object) -> None:
    clock = FrameClock(target)  # type: ignore[arg-type]
    rows = np.random.default_rng(0).normal(size=(53, 2))
    centres, wanted = CLOCK.centres(53), clock.centres(clock.edge(0.53))
    expected = np.stack([np.interp(wanted, centres, column) for column in rows.T], 1)
    for size in (1, 7, 53):
        stream = LiveResampling(CLOCK, clock, 2)
        found = [stream.push(rows[k : k + size]) for k in range(0, 53, size)]
        np.testing.assert_allclose(np.concatenate([*found, stream.finish()]), expected, atol=1e-9)
    assert len(LiveResampling(CLOCK, clock, 2).finish()) == 0


def test_the_dial_scales_about_a_slow_mean() -> None:
    dial = LiveDial(np.array([2.0, 1.0]), CLOCK)
    rows = np.ones((3000, 2))
    found = dial(rows)
    assert found[0] == pytest.approx([2.0, 1.0], abs=0.01)  # about zero
    assert found[-1] == pytest.approx([1.0, 1.0], abs=0.01)  # about where it has been for half a minute
    np.testing.assert_array_equal(found[:, 1], rows[:, 1])


def wav(samples: np.ndarray, rate: int, channels: int = 1) -> bytes:
    path = io.BytesIO()
    import scipy.io.wavfile

    scipy.io.wavfile.write(path, rate, np.repeat((samples * 32767).astype(np.int16)[:, None], channels, 1))
    return path.getvalue()


@pytest.mark.parametrize("channels", [1, 2])
def test_bytes_become_samples_however_they_are_cut(channels: int) -> None:
    samples = noise(0.3)
    data = wav(samples, RATE, channels)
    for whole, make in ((data, SoundBytes), (data[44:], lambda: SoundBytes(RATE, channels))):
        sound, at, rng = make(), 0, np.random.default_rng(3)
        found = []
        while at < len(whole):
            size = int(rng.integers(1, 50))
            found.append(sound.push(whole[at : at + size]))
            at += size
        found.append(sound.finish())
        np.testing.assert_allclose(np.concatenate(found), samples, atol=1e-4)
        assert (sound.rate, sound.channels) == (RATE, channels)


def test_other_rates_are_resampled_as_a_file_is(tmp_path: Path) -> None:
    write_wav(tmp_path / "a.wav", noise(0.5), 44100)
    sound, data = SoundBytes(), (tmp_path / "a.wav").read_bytes()
    found = np.concatenate([*(sound.push(data[k : k + 999]) for k in range(0, len(data), 999)), sound.finish()])
    expected = read_audio(tmp_path / "a.wav")
    assert abs(len(found) - len(expected)) <= 20
    count = min(len(found), len(expected)) - 50
    np.testing.assert_allclose(found[:count], expected[:count], atol=2e-3)


@pytest.mark.parametrize("head, message", [
    (wav(noise(0.1), RATE)[:20] + b"\x03\x00" + wav(noise(0.1), RATE)[22:], "a wav file of kind 3")])
def test_other_kinds_of_wav_are_refused(head: bytes, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        SoundBytes().push(head)


@pytest.fixture(scope="module")
def home(encoded: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A corpus and a run of a causal network that listens."""
    home = tmp_path_factory.mktemp("live")
    shutil.copytree(encoded, home / "demo")
    given = [f"corpus.out={home}/demo", f"run={home}/run", "labels=mel_causal",
             "labels.blocks=[logmel,logmel_window,energy]", "+labels.logmel_offsets=[-4,2]", "model=recurrent",
             "model.network.width=16", "model.network.lookahead=5", "trainer.epochs=2", "trainer.progress=false",
             "trainer.figure_every=0",
             "trainer.accelerator=cpu", "aam.modes=8", "jobs=1", "sample=false", "folds=0"]
    train(composed("train", *given))
    corpus = Corpus.open(home / "demo")
    sound = corpus.sound(corpus.split("test")[0])
    write_wav(home / "said.wav", sound.samples, sound.rate)
    return home


@pytest.fixture(scope="module")
def run(home: Path) -> Run:
    return Run.open(home / "run")


def offline(run: Run, samples: np.ndarray, settings: LiveSettings) -> np.ndarray:
    """The causal result of a whole sound, by the steps that have no streaming form of ours in them but the curves."""
    sound = Sound(samples, RATE)
    codes = encode_recording(Recording(None, "", sound), run.task.table, run.task.clock)
    tier = Tier("speech", [(0.0, len(codes) / 100, "speech")])
    prediction = run.model.predict(Example("x", Alignment([tier]), codes))
    curves = Stream(prediction.mean.shape[2], round(100 * settings.smoothing), run.task.windows)
    rows = np.concatenate([curves.push(prediction.mean, prediction.variance), curves.finish()])
    rows = LiveDial(gains(run, settings.articulation), run.task.clock)(rows)
    clock = FrameClock(run.voice.rate)
    wanted = clock.centres(clock.edge(len(rows) / 100))
    return np.stack([np.interp(wanted, run.task.clock.centres(len(rows)), column) for column in rows.T], 1)


@pytest.mark.parametrize("pieces", [0, 1, 2])
def test_frames_are_those_of_the_offline_causal_result(run: Run, home: Path, pieces: int) -> None:
    samples = read_audio(home / "said.wav")
    face = LiveFace(run)
    given = [samples] if not pieces else cut(samples, pieces)
    found = np.concatenate([*(face.push(piece) for piece in given), face.finish()])
    np.testing.assert_allclose(found, offline(run, samples, LiveSettings()), rtol=1e-4, atol=1e-4)


def test_no_picture_is_later_than_was_told(run: Run, home: Path) -> None:
    samples, face = read_audio(home / "said.wav")[: 2 * RATE], LiveFace(run)
    shown, latest = 0, 0.0
    for k in range(0, len(samples), 16):  # a millisecond at a time
        for _ in face.push(samples[k : k + 16]):
            latest = max(latest, (k + 16) / RATE - (shown + 0.5) / float(face.clock.rate))
            shown += 1
    assert shown > 40 and face.lag - 0.04 < latest <= face.lag + 0.002
    assert face.lag == pytest.approx(0.005 + 0.02 + 0.05 + 0.04 + 0.01)


def test_silence_and_nothing_at_all_are_survived(run: Run) -> None:
    face = LiveFace(run)
    rows = np.concatenate([face.push(np.zeros(3 * RATE, np.float32)), face.finish()])
    assert np.isfinite(rows).all() and len(rows) == 3 * float(face.clock.rate)
    face = LiveFace(run)
    assert follow(face, Outputs(face, io.BytesIO(), None), []) == "0 pictures of 0.0 s of sound"


def test_lines_and_pictures_come_out(run: Run, home: Path) -> None:
    samples, lines, video = read_audio(home / "said.wav"), io.BytesIO(), io.BytesIO()
    face = LiveFace(run)
    outputs = Outputs(face, lines, video)
    told = follow(face, outputs, cut(samples, 5))
    rows = [json.loads(line) for line in lines.getvalue().splitlines()]
    width, height = outputs.pictures.size  # type: ignore[union-attr]
    assert len(rows) == outputs.count == len(video.getvalue()) // (3 * width * height) and str(outputs.count) in told
    assert rows[2]["frame"] == 2 and rows[2]["seconds"] == pytest.approx(2.5 / float(face.clock.rate), abs=1e-6)
    assert {"aperture", "aam01"} <= rows[0].keys()


def test_a_file_goes_at_its_own_pace(home: Path) -> None:
    import time

    begun = time.monotonic()
    with (home / "said.wav").open("rb") as file:
        count = sum(len(part) for part in blocks(file, RATE, paced=True))
    assert count / RATE - 0.05 < time.monotonic() - begun < count / RATE + 5


def test_a_source_that_stutters_and_stops_midway(home: Path) -> None:
    """Through a pipe, byte by byte now and then, broken off inside a sample: all that was heard is shown."""
    data = (home / "said.wav").read_bytes()[: 44 + 2 * RATE + 1]
    words = [sys.executable, "-m", "dnnvss", "live", str(home / "run"), "--sound", "-"]
    program = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               env={**os.environ, "PYTHONPATH": str(ROOT)})
    assert program.stdin and program.stdout and program.stderr
    for k in range(0, len(data), 4001):
        program.stdin.write(data[k : k + 4001])
        program.stdin.flush()
    out, told = program.communicate(timeout=120)
    assert program.returncode == 0 and b"the face follows 125 ms behind the sound" in told
    assert len(out.splitlines()) == 30


@pytest.mark.parametrize("given, message", [
    (["--curves", "-", "--video", "-"], "both write to standard output"),
    (["--sound", "nothing.wav"], "nothing.wav: no such file"), (["--sound", "."], "is a folder"),
    (["--articulation", "nan"], "--articulation=nan is out of range: 0 to 100"),
    (["--scale", "1e9"], "--scale=1e9 is out of range: above 0, at most 16"),
    (["--scale", "x"], "--scale=x is no number"),
    (["--fps", "5000"], "more than 1000 pictures a second")])
def test_mistakes_are_told_in_a_line(home: Path, given: list[str], message: str,
                                     capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command("live", home / "run", *given) in (1, 2)
    assert message in capsys.readouterr().err


@pytest.mark.parametrize("name, data, message", [
    ("a.mp3", b"x", "a.mp3: .mp3 files hold no samples"), ("a.wav", bytes(99), "a.wav: is no wav file"),
    ("a.wav", b"", "a.wav: is empty")])
def test_what_cannot_be_heard_is_named_and_older_curves_stay(home: Path, tmp_path: Path, name: str, data: bytes,
                                                             message: str, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / name).write_bytes(data)
    (tmp_path / "old.jsonl").write_text("old")
    given = ["--sound", tmp_path / name, "--fast", "--curves", tmp_path / "old.jsonl"]
    assert run_command("live", home / "run", *given) == 1
    assert message in capsys.readouterr().err and (tmp_path / "old.jsonl").read_text() == "old"


def test_outputs_are_new_files_each_with_a_place_of_its_own(tmp_path: Path) -> None:
    sound = tmp_path / "a.wav"
    sound.write_bytes(b"x")
    for outputs, message in (([sound], "would be written over"), ([tmp_path / "b", tmp_path / "b"], "two outputs"),
                             ([tmp_path], "is a folder"), ([sound / "b"], "cannot be made")):
        with pytest.raises(DnnvssError, match=message):
            check_places(str(sound), [str(path) for path in outputs])
    check_places(str(sound), ["-", "/dev/null", "/dev/null", str(tmp_path / "new" / "c")])
    assert not (tmp_path / "new" / "c").exists() and sound.read_bytes() == b"x"


def test_a_sink_is_opened_when_something_comes(tmp_path: Path) -> None:
    path = tmp_path / "c"
    path.write_text("old")
    with Sink(str(path)) as sink:
        assert path.read_text() == "old"
        sink.flush()
        assert path.read_text() == ""
        sink.write(b"new")
    assert path.read_text() == "new"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is always full")
def test_a_full_disk_is_told_with_the_file() -> None:
    with pytest.raises(DnnvssError, match="/dev/full: cannot be written any further"), Sink("/dev/full") as sink:
        sink.write(b"x" * 100)
        sink.flush()


def test_ctrl_c_ends_it_with_what_was_given_out(home: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path,
                                                capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted(*_: object) -> Iterator[np.ndarray]:
        yield noise(1.0)
        raise KeyboardInterrupt

    monkeypatch.setattr(live, "blocks", interrupted)
    given = ["--sound", home / "said.wav", "--curves", tmp_path / "c"]
    assert run_command("live", home / "run", *given) == 130
    count = len((tmp_path / "c").read_text().splitlines())
    assert count > 20 and f"stopped after {count} pictures" in capsys.readouterr().err
