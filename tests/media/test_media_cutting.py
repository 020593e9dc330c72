"""A clip of a long recording shows and sounds as the recording does there, and costs no loss where it can be copied."""

from fractions import Fraction
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from films import QUARTER, UPRIGHT, film, number_of, pictures

from dnnvss.errors import DnnvssError
from dnnvss.media import read_audio, timed_audio, timed_frames, video_info
from dnnvss.media.cutting import cut
from dnnvss.media.index import picture_index, seconds_of
from dnnvss.media.storing import store_sound, stored, stretch

RATE = 16000
NOISE = np.random.default_rng(0).uniform(-0.3, 0.3, (2, 2 * RATE)).astype(np.float32)
BETWEEN = {"crf": "1", "bf": "3", "g": "25"}


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Two seconds with pictures between others and a picture in 25 that stands alone."""
    film(path := tmp_path / "long.mp4", pictures(24) * 2, range(48), 24, sounds=[[(0.0, NOISE)]], options=BETWEEN)
    return path


@pytest.mark.parametrize("start", [0.0, 0.55, 1.3])
def test_a_copy_has_the_very_pictures_and_the_sound_of_its_place(recording: Path, tmp_path: Path, start: float) -> None:
    index = picture_index(recording)
    store_sound(recording, wav := tmp_path / "48.wav", 48000, index.zero)
    made = cut(recording, index, wav, start, start + 0.5, clip := tmp_path / "clip.mp4")
    assert made.copied and made.first == np.ceil(start * 24) and 12 <= made.end - made.first <= 12 + 8
    assert made.start == pytest.approx(made.first / 24)
    want = [image for _, image in islice(timed_frames(recording), made.first, made.end)]
    got = list(timed_frames(clip))
    assert [time for time, _ in got] == pytest.approx([k / 24 for k in range(len(want))])
    np.testing.assert_array_equal([image for _, image in got], want)
    sound, first = timed_audio(clip, RATE)
    there = read_audio(recording)[round(made.start * RATE) :][: len(sound)]
    lags = np.correlate(sound[2000:6000], there[2000:6000], "full")
    assert first == pytest.approx(0, abs=1e-3) and abs(int(lags.argmax()) - 3999) <= 1


@pytest.mark.parametrize("kind", ["turned.mp4", "late.mkv", "stream.ts", "old.avi"])
def test_containers_of_all_kinds_are_copied(kind: str, tmp_path: Path) -> None:
    known = {"late.mkv": (range(12, 60), 24), "stream.ts": (range(0, 48 * 3750, 3750), 90000)}
    ticks = known.get(kind, (range(48), 24))
    film(path := tmp_path / kind, pictures(24) * 2, *ticks, sounds=[[(0.2, NOISE[:1])]],
         codec="mpeg4" if kind == "old.avi" else "libx264", sound_codec="mp2" if kind == "stream.ts" else "pcm_s16le",
         matrix=QUARTER if kind == "turned.mp4" else UPRIGHT, options=None if kind == "old.avi" else BETWEEN)
    index = picture_index(path)
    store_sound(path, wav := tmp_path / "48.wav", 48000, index.zero)
    start = index.seconds(int(index.shown[12]))
    made = cut(path, index, wav, start, start + 0.7, clip := tmp_path / "clip.mp4")
    assert made.copied and made.first == 12 and video_info(clip).size == video_info(path).size
    want = [image for _, image in islice(timed_frames(path), 12, made.end)]
    np.testing.assert_array_equal([image for _, image in timed_frames(clip)], want)


def test_what_cannot_be_copied_is_encoded_at_its_times(tmp_path: Path) -> None:
    ticks = [0, 40, 80, 120, 200, 240, 280, 400, 440, 480]
    film(path := tmp_path / "long.avi.mkv", pictures(10), ticks, 1000, codec="ffv1", sounds=[[(0.0, NOISE)]])
    index = picture_index(path)
    store_sound(path, wav := tmp_path / "48.wav", 48000, index.zero)
    made = cut(path, index, wav, 0.07, 0.42, clip := tmp_path / "clip.mp4")
    got = list(timed_frames(clip))
    assert not made.copied and (made.first, made.end) == (2, 8)
    assert [number_of(image) for _, image in got] == [2, 3, 4, 5, 6, 7]
    assert [time for time, _ in got] == pytest.approx([0, 0.04, 0.12, 0.16, 0.2, 0.32], abs=2e-3)
    with pytest.raises(DnnvssError, match=r"has no picture from 8\.00 to 9\.00 s"):
        cut(path, index, wav, 8.0, 9.0, tmp_path / "none.mp4")
    assert not (tmp_path / "none.mp4").exists()


def test_sound_that_is_stored_block_by_block_is_that_which_is_read(recording: Path, tmp_path: Path) -> None:
    wav = tmp_path / "a.wav"
    assert store_sound(recording, wav, RATE) == pytest.approx(2.0)
    np.testing.assert_allclose(stretch(wav, RATE, 0, 9), read_audio(recording), atol=1e-4)
    film(late := tmp_path / "late.mkv", pictures(20), range(20), 10, sounds=[[(0.5, NOISE[:1] * 0)], [(0.5, NOISE)]])
    store_sound(late, wav, RATE, 0.0)
    assert np.abs(stored(wav)[: RATE // 2 - 100]).max() == 0 and np.abs(stored(wav)[RATE // 2 + 100 :]).max() > 5000
    assert seconds_of(recording) == pytest.approx(2.0, abs=0.1)


def test_a_recording_without_sound_pictures_or_times_is_refused(tmp_path: Path) -> None:
    film(silent := tmp_path / "silent.mp4", pictures(5), range(5), 25)
    with pytest.raises(DnnvssError, match="has no sound"):
        store_sound(silent, tmp_path / "a.wav", RATE)
    film(quiet := tmp_path / "quiet.mkv", pictures(5), range(5), 25, sounds=[[(0.0, NOISE * 0)]])
    with pytest.raises(DnnvssError, match="its sound is silence"):
        store_sound(quiet, tmp_path / "a.wav", RATE)
    (torn := tmp_path / "torn.mp4").write_bytes(silent.read_bytes()[:300])
    with pytest.raises(DnnvssError):
        picture_index(torn)
    assert picture_index(silent).base < Fraction(1, 20)
