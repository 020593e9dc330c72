"""Sound that comes byte by byte: raw samples, or a wav file as it is written."""

import struct

import av
import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.media.reading import SPEECH_RATE

_REMEDY = "Give 16-bit samples (s16le), raw or in a wav file: ffmpeg -i IN -f s16le -ac 1 -ar 16000 -"
_HEAD = 12
"""Bytes that tell a wav file from raw samples."""
_LONGEST = 1 << 20
"""Bytes before the samples of a wav file, beyond which it is none."""
_PCM, _EXTENSIBLE = 1, 0xFFFE


class SoundBytes:
    """Mono samples at :data:`SPEECH_RATE` of bytes that arrive in any pieces.

    Args:
        rate: samples a second of raw sound; a wav file tells its own.
        channels: of raw sound, one behind the other; they are averaged.
    """

    def __init__(self, rate: int = SPEECH_RATE, channels: int = 1) -> None:
        self.rate, self.channels = rate, channels
        self.waiting, self.begun = b"", False
        self.resampler: av.AudioResampler | None = None

    def push(self, data: bytes) -> np.ndarray:
        """Samples (m,) float32 in [-1, 1] that these bytes complete.

        Raises:
            DnnvssError: a wav file of another kind than 16-bit PCM.
        """
        self.waiting += data
        if not self.begun and not self._begin():
            return np.zeros(0, np.float32)
        whole = len(self.waiting) - len(self.waiting) % (2 * self.channels)
        taken, self.waiting = self.waiting[:whole], self.waiting[whole:]
        samples = np.frombuffer(taken, "<i2").reshape(-1, self.channels).mean(1) / 32768
        return self._at_speech_rate(samples.astype(np.float32))

    def finish(self) -> np.ndarray:
        """Samples (m,) that were held back; half a sample at the end is left out."""
        self.begun = True
        samples = self.push(b"")
        if self.resampler is None:
            return samples
        return np.concatenate([samples, *map(_row, self.resampler.resample(None))])

    def _begin(self) -> bool:
        """Whether it is clear what is coming; the header of a wav file is then gone."""
        head = self.waiting[:_HEAD]
        if not b"RIFF".startswith(head[:4]) or (len(head) == _HEAD and head[8:] != b"WAVE"):
            self.begun = True
        elif len(head) == _HEAD:
            self.begun = self._header()
        return self.begun

    def _header(self) -> bool:
        """Read the chunks before the samples, once all of them are here."""
        at = _HEAD
        while at + 8 <= len(self.waiting):
            name, size = struct.unpack("<4sI", self.waiting[at : at + 8])
            if name == b"data":
                self.waiting = self.waiting[at + 8 :]
                return True
            if name == b"fmt " and at + 24 <= len(self.waiting):
                self._format(*struct.unpack("<HHIIHH", self.waiting[at + 8 : at + 24]))
            if (at := at + 8 + size + size % 2) > _LONGEST:
                raise DnnvssError("the wav file has no samples", remedy=_REMEDY)
        return False

    def _format(self, kind: int, channels: int, rate: int, _: int, __: int, bits: int) -> None:
        if kind not in (_PCM, _EXTENSIBLE) or bits != 16 or not 0 < channels <= 64 or rate < 1000:
            raise DnnvssError(f"a wav file of kind {kind} with {bits} bits, {channels} channels "
                              f"and {rate} samples a second", remedy=_REMEDY)
        self.rate, self.channels = rate, channels

    def _at_speech_rate(self, samples: np.ndarray) -> np.ndarray:
        if self.rate == SPEECH_RATE or not len(samples):
            return samples
        if self.resampler is None:
            self.resampler = av.AudioResampler(format="flt", layout="mono", rate=SPEECH_RATE)
        frame = av.AudioFrame.from_ndarray(samples[None], format="flt", layout="mono")
        frame.sample_rate = self.rate
        rows = [_row(made) for made in self.resampler.resample(frame)]
        return np.concatenate(rows) if rows else np.zeros(0, np.float32)


def _row(frame: av.AudioFrame) -> np.ndarray:
    return frame.to_ndarray().reshape(-1)
