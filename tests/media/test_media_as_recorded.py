"""Recordings as phones, cameras and editors write them: what players show and let hear is what is read."""

import wave
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from films import BACK, HALF, MIRRORED, QUARTER, film, number_of, pictures, tone, trim

from dnnvss.errors import DnnvssError
from dnnvss.media import (
    SPEECH_RATE,
    read_audio,
    read_video,
    timed_audio,
    timed_frames,
    video_frames,
    video_info,
    write_wav,
)
from dnnvss.media.index import picture_index


@pytest.mark.parametrize("matrix, size, corner", [
    (QUARTER, (48, 64), (0, 1)), (HALF, (64, 48), (1, 1)), (BACK, (48, 64), (1, 0)), (MIRRORED, (64, 48), (0, 1))])
def test_pictures_are_turned_upright(tmp_path: Path, matrix: tuple[int, ...], size: tuple[int, int],
                                     corner: tuple[int, int]) -> None:
    path = film(tmp_path / "a.mp4", pictures(5), range(5), 25, matrix=matrix)
    info, video = video_info(path), read_video(path)
    assert info.size == size and not info.plain and video.shape == (5, size[1], size[0], 3)
    bright = {(y, x): video[0][-4 if y else 3, -4 if x else 3].mean() for y in (0, 1) for x in (0, 1)}
    assert max(bright, key=lambda c: bright[c]) == corner
    small = next(video_frames(path, (size[0] // 2, size[1] // 2), grey=True))
    assert small.shape == (size[1] // 2, size[0] // 2)
    assert [number_of(v) for v in video] == list(range(5))


def test_shape_of_pixels_turns_with_the_picture(tmp_path: Path) -> None:
    lying = film(tmp_path / "a.mp4", pictures(3), range(3), 25, pixel=Fraction(4, 3))
    standing = film(tmp_path / "b.mp4", pictures(3), range(3), 25, pixel=Fraction(4, 3), matrix=QUARTER)
    assert video_info(lying).pixel == Fraction(4, 3) and video_info(standing).pixel == Fraction(3, 4)


@pytest.mark.parametrize("codec, name, sound", [
    ("mpeg4", "a.avi", "pcm_s16le"), ("mpeg2video", "a.mpg", "mp2"), ("prores_ks", "a.mov", "pcm_s16le"),
    ("wmv2", "a.wmv", "aac"), ("mpeg4", "a.mkv", "aac")])
def test_old_codecs_are_read_frame_by_frame(tmp_path: Path, codec: str, name: str, sound: str) -> None:
    path = film(tmp_path / name, pictures(12), range(12), 25, codec=codec, sounds=[[(0.0, tone(0.48, 48000))]],
                rate=48000, sound_codec=sound)
    assert [number_of(v) for v in read_video(path)] == list(range(12))
    assert len(read_audio(path)) == pytest.approx(0.48 * 16000, abs=1024)


def test_interlaced_pictures_become_whole_ones_and_keep_their_numbers(tmp_path: Path) -> None:
    path = film(tmp_path / "a.mp4", pictures(12), range(12), 25, options={"crf": "1", "x264-params": "tff=1"})
    assert not video_info(path).plain
    assert [number_of(v) for v in read_video(path)] == list(range(12))


@pytest.mark.parametrize("between", ["0", "3"])
def test_pictures_of_an_avi_are_shown_from_the_first_moment(tmp_path: Path, between: str) -> None:
    """AVI numbers its pictures; FFmpeg guesses H.264 there a picture late, with and without others between."""
    path = film(tmp_path / "a.avi", pictures(12), range(12), 25, options={"crf": "1", "bf": between})
    found = list(timed_frames(path))
    assert [time for time, _ in found] == pytest.approx([k / 25 for k in range(12)])
    assert [number_of(image) for _, image in found] == list(range(12))
    if between == "0":
        index = picture_index(path)
        assert [index.seconds(int(t)) for t in index.shown] == pytest.approx([k / 25 for k in range(12)])
        return
    with pytest.raises(DnnvssError, match="does not say when each of its pictures is shown"):
        picture_index(path)  # a copy of them would jump back and forth


@pytest.mark.parametrize("between", ["0", "3"])
def test_pictures_of_a_trimmed_recording_keep_their_place(tmp_path: Path, between: str) -> None:
    """Trimmed 1.25 pictures into it: the first one that begins there is shown 30 ms later, and FFmpeg says at once."""
    path = film(tmp_path / "a.mp4", pictures(12), range(0, 12 * 512, 512), 12800, options={"crf": "1", "bf": between})
    trim(path, 640)
    found, index = list(timed_frames(path)), picture_index(path)
    assert [number_of(image) for _, image in found] == list(range(2, 12))
    assert [time for time, _ in found] == pytest.approx([k / 25 - 0.05 for k in range(2, 12)], abs=1e-4)
    assert [index.seconds(int(t)) for t in index.shown] == pytest.approx([time for time, _ in found], abs=1e-4)


def test_raw_aac_begins_with_its_sound(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).normal(0, 0.1, (1, 2 * SPEECH_RATE)).astype(np.float32)
    with av.open(str(tmp_path / "a.aac"), "w", format="adts") as container:
        stream = container.add_stream("aac", rate=SPEECH_RATE, layout="mono")
        frame = av.AudioFrame.from_ndarray(noise, format="fltp", layout="mono")
        frame.sample_rate = SPEECH_RATE
        container.mux([*stream.encode(frame), *stream.encode(None)])
    heard = read_audio(tmp_path / "a.aac")
    lags = np.correlate(heard[4000:8000], noise[0, 4000:8000], "full")
    assert abs(int(lags.argmax()) - 3999) <= 1


def test_sound_after_a_gap_stays_in_its_place(tmp_path: Path) -> None:
    blocks = [(0.0, tone(0.192)), (0.704, tone(0.256))]
    path = film(tmp_path / "a.mkv", pictures(24), range(24), 25, sounds=[blocks])
    loud = np.flatnonzero(np.abs(read_audio(path)) > 0.1) / 16000
    assert len(read_audio(path)) == pytest.approx(0.96 * 16000, abs=20)
    assert ((loud < 0.2) | (loud > 0.703)).all() and (loud > 0.9).any()


def test_where_sound_starts_late_its_time_says_so(tmp_path: Path) -> None:
    path = film(tmp_path / "a.mkv", pictures(24), range(24), 25, sounds=[[(0.3, tone(0.6))]])
    sound, start = timed_audio(path)
    assert start == pytest.approx(0.3, abs=2e-3) and len(sound) == pytest.approx(0.6 * 16000, abs=20)


def test_the_first_track_that_holds_sound_is_heard(tmp_path: Path) -> None:
    silent, spoken = [(0.0, 0 * tone(0.4))], [(0.0, tone(0.4))]
    path = film(tmp_path / "a.mkv", pictures(10), range(10), 25, sounds=[silent, spoken])
    assert np.abs(read_audio(path)).max() == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize("left, right", [(1.0, -1.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, -0.9)])
def test_channels_that_cancel_or_are_silent_cost_no_level(tmp_path: Path, left: float, right: float) -> None:
    block = np.concatenate([left * tone(0.4), right * tone(0.4)])
    path = film(tmp_path / "a.mkv", pictures(10), range(10), 25, sounds=[[(0.0, block)]])
    assert np.abs(read_audio(path)).max() == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize("offset", [0.02, -0.1, 0.005])
def test_a_constant_offset_is_taken_out(tmp_path: Path, offset: float) -> None:
    path = film(tmp_path / "a.mkv", pictures(10), range(10), 25, sounds=[[(0.0, tone(0.4) + offset)]])
    sound = read_audio(path)
    assert abs(sound.mean()) < 1e-3 and np.abs(sound).max() == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize("rate", [8000, 11025, 22050, 44100, 96000, 192000])
def test_sound_of_any_rate_keeps_its_pitch(tmp_path: Path, rate: int) -> None:
    path = film(tmp_path / "a.mkv", pictures(25), range(25), 25, sounds=[[(0.0, tone(1.0, rate, 440.0))]], rate=rate)
    sound = read_audio(path)
    peak = int(np.abs(np.fft.rfft(sound[:16000])).argmax())
    assert abs(peak - 440) <= 1


@pytest.mark.parametrize("offset", [0.0, 0.1])
def test_a_wav_of_ours_is_what_ffmpeg_hears_in_it(tmp_path: Path, offset: float) -> None:
    wav = write_wav(tmp_path / "a.wav", np.random.default_rng(0).normal(offset, 0.1, 5001), 16000)
    (tmp_path / "a.bin").write_bytes(wav.read_bytes())  # under this name FFmpeg reads it
    ours, theirs = timed_audio(wav), timed_audio(tmp_path / "a.bin")
    np.testing.assert_array_equal(ours[0], theirs[0])
    assert ours[1] == theirs[1] == 0 and ours[0].dtype == theirs[0].dtype


@pytest.mark.parametrize("at, value", [(16, 255), (22, 0), (41, 255), (36, 0)])
def test_a_wav_with_a_damaged_head_is_left_to_ffmpeg(tmp_path: Path, at: int, value: int) -> None:
    wav = write_wav(tmp_path / "a.wav", np.random.default_rng(0).normal(0, 0.1, 500), 16000)
    data = bytearray(wav.read_bytes())
    data[at] = value
    found = []
    for path in (wav, tmp_path / "a.bin"):
        path.write_bytes(data)
        try:
            found.append(read_audio(path).tolist())
        except DnnvssError as error:
            found.append(error.problem.replace(path.name, ""))
    assert found[0] == found[1]


@pytest.mark.parametrize("channels", [6, 8, 16])
def test_sound_of_many_channels_is_that_of_those_that_hold_any(tmp_path: Path, channels: int) -> None:
    """Recorders of eight tracks: PyAV read beyond the planes of such sound, and the process ended."""
    speech = (8000 * np.sin(np.arange(SPEECH_RATE) / 20)).astype("<i2")
    table = np.zeros((SPEECH_RATE, channels), "<i2")
    table[:, channels - 1] = speech
    with wave.open(str(tmp_path / "a.wav"), "wb") as sound:
        sound.setparams((channels, 2, SPEECH_RATE, 0, "NONE", ""))
        sound.writeframes(table.tobytes())
    assert np.abs(read_audio(tmp_path / "a.wav") - speech / 32768).max() < 1e-3
