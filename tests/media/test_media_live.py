"""Bytes that come are samples, or are refused: other files, headers that break off or lie, what stands behind."""

import struct

import numpy as np
import pytest

from dnnvss.errors import DnnvssError
from dnnvss.media.live import SoundBytes

SAMPLES = (np.sin(np.arange(800) / 9) * 9000).astype("<i2")


def header(size: int, rate: int = 16000, kind: int = 1, channels: int = 1) -> bytes:
    return struct.pack("<4sI4s4sIHHIIHH4sI", b"RIFF", 36 + len(SAMPLES) * 2, b"WAVE", b"fmt ", 16, kind, channels, rate,
                       rate * 2, 2, 16, b"data", size)


def heard(data: bytes, sound: SoundBytes | None = None) -> np.ndarray:
    """The samples as 16-bit numbers, from pieces of 7 bytes."""
    sound = sound or SoundBytes()
    parts = [sound.push(data[k : k + 7]) for k in range(0, len(data), 7)]
    return np.rint(np.concatenate([*parts, sound.finish()]) * 32768).astype(int)


@pytest.mark.parametrize("size, count", [(1600, 800), (400, 200), (401, 200), (0, 806), (0x7FFFFFFF, 806),
                                         (0xFFFFFFFF, 806)])
def test_samples_end_where_the_header_says_unless_nobody_knew(size: int, count: int) -> None:
    behind = b"LIST" + struct.pack("<I", 4) + b"INFO"
    found = heard(header(size) + SAMPLES.tobytes() + behind)
    np.testing.assert_array_equal(found, np.frombuffer(SAMPLES.tobytes() + behind, "<i2")[:count])


@pytest.mark.parametrize("data, message", [
    (b"fLaC" + bytes(200), "is FLAC"), (b"OggS" + bytes(200), "is Ogg"), (b"ID3\x04" + bytes(200), "is mp3"),
    (b"\0\0\0\x20ftypisom" + bytes(200), "is mp4"), (b"RF64" + header(1600)[4:] + bytes(200), "of 64 bits"),
    (b"RIFX" + header(1600)[4:] + bytes(200), "byte order"),
    (b"RIFF\0\0\0\0AVI " + bytes(200), "another kind than wav"),
    (b"hello, this is no sound\n" * 9, "is text"), (b"hello, world", "is text"), (b"\x89PNG" + bytes(99), "a picture"),
    (header(1600)[:30], "breaks off before its samples"), (header(1600)[:4], "breaks off before its samples"),
    (header(1600)[:12] + header(1600)[36:] + bytes(99), "does not say what its samples are"),
    (header(1600, rate=4_000_000_000 // 2) + bytes(99), "2000000000 samples a second"),
    (header(1600, rate=1) + bytes(99), "1 samples a second"), (header(1600, channels=0) + bytes(99), "0 channels")])
def test_what_holds_no_samples_is_refused(data: bytes, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        heard(data)


@pytest.mark.parametrize("data, message", [(b"", "is empty"), (bytes(200), "is no wav file")])
def test_where_a_wav_file_is_promised_there_must_be_one(data: bytes, message: str) -> None:
    with pytest.raises(DnnvssError, match=message):
        heard(data, SoundBytes(wav=True))
    assert len(heard(data)) == len(data) // 2


@pytest.mark.parametrize("count", [0, 1, 2, 31, 32, 33, 800])
def test_raw_samples_of_any_number_come_whole(count: int) -> None:
    np.testing.assert_array_equal(heard(SAMPLES[:count].tobytes() + b"\0"), SAMPLES[:count])
