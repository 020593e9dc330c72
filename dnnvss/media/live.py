"""Sound that comes byte by byte: raw samples, or a wav file as it is written."""

import struct

import av
import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.media.reading import SPEECH_RATE
from dnnvss.media.sound import RATES

_REMEDY = "Give 16-bit samples (s16le), raw or in a wav file: ffmpeg -i IN -f s16le -ac 1 -ar 16000 -"
_HEAD = 64
"""Bytes that tell what is coming: two milliseconds of raw samples."""
_OTHERS = {b"RIFX": "a wav file of another byte order", b"RF64": "a wav file of 64 bits", b"riff": "Wave64",
           b"fLaC": "FLAC", b"OggS": "Ogg", b"ID3": "mp3", b"FORM": "AIFF", b".snd": "an au file",
           b"caff": "CAF", b"#!AMR": "AMR", b"\x1aE\xdf\xa3": "Matroska or WebM",
           b"\x89PNG": "a picture", b"0&\xb2u": "wma"}
"""First bytes of files that hold no samples one behind the other."""
_TEXT = frozenset(b"\t\n\r" + bytes(range(32, 127)))
_LEAST_TEXT = 12
"""Bytes of which a text has at least so many."""
_ENDLESS = 0x7F000000
"""Bytes of samples from which a header means that nobody knew how many would come, as that of none."""
_LONGEST = 1 << 20
"""Bytes before the samples of a wav file, beyond which it is none."""
_PCM, _EXTENSIBLE = 1, 0xFFFE


class SoundBytes:
    """Mono samples at :data:`SPEECH_RATE` of bytes that arrive in any pieces.

    Args:
        rate: samples a second of raw sound; a wav file tells its own.
        channels: of raw sound, one behind the other; they are averaged.
        wav: whether it must be a wav file.
    """

    def __init__(self, rate: int = SPEECH_RATE, channels: int = 1, wav: bool = False) -> None:
        self.rate, self.channels, self.wav = rate, channels, wav
        self.waiting, self.begun = b"", False
        self.left: int | None = None
        self.told = False
        self.resampler: av.AudioResampler | None = None

    def push(self, data: bytes) -> np.ndarray:
        """Samples (m,) float32 in [-1, 1] that these bytes complete.

        What stands behind the samples of a wav file is none of them.

        Raises:
            DnnvssError: a wav file of another kind than 16-bit PCM, or no samples at all.
        """
        self.waiting += data
        if not self.begun and not (len(self.waiting) >= _HEAD and self._begin()):
            return np.zeros(0, np.float32)
        return self._samples()

    def finish(self) -> np.ndarray:
        """Samples (m,) that were held back; half a sample at the end is left out.

        Raises:
            DnnvssError: as :meth:`push`; or a wav file breaks off before its samples.
        """
        if not self.begun and not self._begin():
            raise DnnvssError("the wav file breaks off before its samples", remedy=_REMEDY)
        samples = self._samples()
        if self.resampler is None:
            return samples
        return np.concatenate([samples, *map(_row, self.resampler.resample(None))])

    def _samples(self) -> np.ndarray:
        """What is whole of the bytes that wait."""
        whole = len(self.waiting) - len(self.waiting) % (2 * self.channels)
        taken, self.waiting = self.waiting[:whole], self.waiting[whole:]
        if self.left is not None:
            taken = taken[: self.left - self.left % (2 * self.channels)]
            self.left -= len(taken)
        samples = np.frombuffer(taken, "<i2").reshape(-1, self.channels).mean(1) / 32768
        return self._at_speech_rate(samples.astype(np.float32))

    def _begin(self) -> bool:
        """Whether it is clear what is coming; the header of a wav file is then gone."""
        head = self.waiting[:_HEAD]
        if head[:4] == b"RIFF":
            if len(head) >= 12 and head[8:12] != b"WAVE":
                raise DnnvssError("is a RIFF file of another kind than wav", remedy=_REMEDY)
            self.begun = self._header()
            return self.begun
        other = next((name for start, name in _OTHERS.items() if head.startswith(start)), None)
        if head[4:8] == b"ftyp":
            other = "mp4"
        if len(head) >= _LEAST_TEXT and _TEXT.issuperset(head):
            other = "text"
        if other:
            raise DnnvssError(f"is {other}, and no samples one behind the other", remedy=_REMEDY)
        if self.wav:
            raise DnnvssError("is no wav file" if head else "is empty", remedy=_REMEDY)
        self.begun = True
        return True

    def _header(self) -> bool:
        """Read the chunks before the samples, once all of them are here."""
        at = 12
        while at + 8 <= len(self.waiting):
            name, size = struct.unpack("<4sI", self.waiting[at : at + 8])
            if name == b"data":
                if not self.told:
                    raise DnnvssError("the wav file does not say what its samples are", remedy=_REMEDY)
                self.waiting = self.waiting[at + 8 :]
                self.left = size if 0 < size < _ENDLESS else None
                return True
            if name == b"fmt " and at + 24 <= len(self.waiting):
                self._format(*struct.unpack("<HHIIHH", self.waiting[at + 8 : at + 24]))
            if (at := at + 8 + size + size % 2) > _LONGEST:
                raise DnnvssError("the wav file has no samples", remedy=_REMEDY)
        return False

    def _format(self, kind: int, channels: int, rate: int, _: int, __: int, bits: int) -> None:
        sane = 0 < channels <= 64 and RATES[0] <= rate <= RATES[1]
        if kind not in (_PCM, _EXTENSIBLE) or bits != 16 or not sane:
            raise DnnvssError(f"a wav file of kind {kind} with {bits} bits, {channels} channels "
                              f"and {rate} samples a second", remedy=_REMEDY)
        self.rate, self.channels, self.told = rate, channels, True

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
