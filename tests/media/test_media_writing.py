"""Video files: frame times at every rate, sound in step, and nothing half-written."""

import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.media import read_audio, read_video, video_info, write_video
from dnnvss.media.writing import video_frame


def _frames(count: int, size: tuple[int, int] = (32, 48)) -> list[np.ndarray]:
    return [np.full((*size, 3), 16 + i % 200, dtype=np.uint8) for i in range(count)]


def _times(path: Path) -> list[Fraction]:
    with av.open(str(path)) as container:
        base = container.streams.video[0].time_base
        return [frame.pts * base for frame in container.decode(video=0)]


@pytest.mark.parametrize(("rate", "exact"), [("25", Fraction(25)), ("29.97", Fraction(30000, 1001)),
                                             (30, Fraction(30)), (Fraction(60), Fraction(60)),
                                             ("23.976", Fraction(24000, 1001)), (12.5, Fraction(25, 2))])
def test_every_frame_stands_at_its_exact_time(tmp_path: Path, rate: object, exact: Fraction) -> None:
    path = write_video(tmp_path / "a.mp4", _frames(61), rate)  # type: ignore[arg-type]
    assert _times(path) == [i / exact for i in range(61)]
    info = video_info(path)
    assert info.rate == exact and info.size == (48, 32) and not info.has_audio


@pytest.mark.parametrize("audio_rate", [16000, 44100])
def test_a_voice_is_written_nearly_as_it_sounds(tmp_path: Path, audio_rate: int) -> None:
    times = np.arange(2 * audio_rate) / audio_rate
    phase = 2 * np.pi * np.cumsum(110 + 15 * np.sin(2 * np.pi * 1.5 * times)) / audio_rate
    voice = sum(np.sin(n * phase) / n**1.2 for n in range(1, 30)) * (0.1 + 0.1 * np.sin(2 * np.pi * 3 * times))
    breath = np.random.default_rng(0).normal(0, 0.002, len(times))
    sound = (voice + breath).astype(np.float32)
    path = write_video(tmp_path / "a.mp4", _frames(50), 25, sound, audio_rate)
    with av.open(str(path)) as container:
        heard = np.concatenate([frame.to_ndarray()[0] for frame in container.decode(audio=0)])[: len(sound)]
    error = sound[: len(heard)] - heard
    assert 10 * np.log10(np.square(sound).mean() / np.square(error).mean()) > 20


def test_ten_minutes_at_29_97_end_within_a_frame_of_the_clock(tmp_path: Path) -> None:
    rate = Fraction(30000, 1001)
    count = round(600 * rate)
    picture = np.zeros((16, 16, 3), dtype=np.uint8)
    path = write_video(tmp_path / "long.mp4", (picture for _ in range(count)), "29.97", quality=51)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        last = max(packet.pts for packet in container.demux(stream) if packet.pts is not None) * stream.time_base
        assert stream.frames == count
    assert last == (count - 1) / rate
    assert abs(float(last) + 1 / 29.97 - 600) < 1 / 29.97


@pytest.mark.parametrize("audio_rate", [16000, 22050, 44100, 48000, 10000])
def test_sound_is_in_step(tmp_path: Path, audio_rate: int) -> None:
    sound = np.zeros(2 * audio_rate, dtype=np.float32)
    clicks = [0.25, 1.5]
    for click in clicks:
        start = int(click * audio_rate)
        sound[start:start + audio_rate // 200] = 0.8 * np.sin(np.arange(audio_rate // 200))
    path = write_video(tmp_path / "a.mp4", _frames(50), 25, sound, audio_rate)
    heard = read_audio(path, audio_rate)
    for click in clicks:
        part = slice(int((click - 0.2) * audio_rate), int((click + 0.2) * audio_rate))
        lag = np.argmax(np.correlate(heard[part], sound[part], "full")) - (part.stop - part.start - 1)
        assert abs(lag) / audio_rate < 0.002
    assert abs(len(heard) / audio_rate - 2) < 0.1
    with av.open(str(path)) as container:
        assert {s.start_time for s in container.streams} == {0}


def test_pictures_keep_their_colours_and_odd_sides_grow_by_a_pixel(tmp_path: Path) -> None:
    colour = np.array([180, 90, 60], dtype=np.uint8)
    path = write_video(tmp_path / "a.mp4", [np.tile(colour, (31, 45, 1))] * 3, 25)
    back = read_video(path)
    assert back.shape == (3, 32, 46, 3)
    assert np.abs(back.astype(int) - colour).max() <= 4


def test_a_picture_for_the_encoder_is_that_of_bt601_with_the_mean_colour_of_four_pixels() -> None:
    image = np.random.default_rng(0).integers(0, 256, (6, 8, 3), np.uint8)
    frame = video_frame(image)
    planes = [np.frombuffer(p, np.uint8).reshape(p.height, p.line_size)[:, : p.width].astype(float)
              for p in frame.planes]
    red, green, blue = np.moveaxis(image / 255, -1, 0)
    grey = 0.299 * red + 0.587 * green + 0.114 * blue
    mean = [part.reshape(3, 2, 4, 2).mean(axis=(1, 3)) for part in (grey, blue, red)]
    assert np.abs(planes[0] - (16 + 219 * grey)).max() <= 1
    assert np.abs(planes[1] - (128 + 224 * (mean[1] - mean[0]) / 1.772)).max() <= 1
    assert np.abs(planes[2] - (128 + 224 * (mean[2] - mean[0]) / 1.402)).max() <= 1


def test_index_stands_before_the_data_so_that_browsers_start_at_once(tmp_path: Path) -> None:
    data = write_video(tmp_path / "a.mp4", _frames(5), 25, np.zeros(3200, np.float32)).read_bytes()
    assert 0 < data.find(b"moov") < data.find(b"mdat")


def test_bad_frames_say_so_and_leave_nothing(tmp_path: Path) -> None:
    with pytest.raises(DnnvssError, match=r"a\.mp4: there is no frame to write"):
        write_video(tmp_path / "a.mp4", [], 25)
    with pytest.raises(DnnvssError, match=r"frame 3 has shape \(30, 48, 3\) and the first has \(32, 48, 3\)"):
        write_video(tmp_path / "a.mp4", [*_frames(3), *_frames(1, (30, 48))], 25)
    with pytest.raises(DnnvssError, match="frame rate"):
        write_video(tmp_path / "a.mp4", _frames(1), 0)
    assert not list(tmp_path.iterdir())


def test_ctrl_c_keeps_the_old_file_and_leaves_no_other(tmp_path: Path) -> None:
    path = write_video(tmp_path / "a.mp4", _frames(3), 25)
    before = path.read_bytes()

    def interrupted():
        yield from _frames(30)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_video(path, interrupted(), 25, np.zeros(16000, np.float32))
    assert path.read_bytes() == before and [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


_FULL_DISK = """
import resource, signal, sys
import numpy as np
from dnnvss.errors import DnnvssError
from dnnvss.media import write_video
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
noise = (np.random.default_rng(i).integers(0, 256, (64, 64, 3), dtype=np.uint8) for i in range(60))
try:
    write_video(sys.argv[1], noise, 25, np.zeros(38400, np.float32))
except DnnvssError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="limits the size of files as POSIX does")
def test_a_disk_that_takes_no_more_says_so_and_leaves_nothing(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-c", _FULL_DISK, str(tmp_path / "a.mp4")], capture_output=True, text=True,
                          check=True, timeout=60)
    assert "a.mp4: cannot be written" in done.stdout and "Free some space" in done.stdout
    assert not list(tmp_path.iterdir())
