"""Where the pictures of a recording stand in its file and in time, read without decoding them."""

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.media.containers import opened
from dnnvss.media.decoding import main_stream, numbered
from dnnvss.media.edits import hidden

REMEDY = ("Store it anew, with times: "
          "ffmpeg -fflags +genpts -i FILE -vf setpts=PTS-STARTPTS -fps_mode passthrough "
          "-c:v libx264 -crf 12 -c:a aac OUT.mp4")


@dataclass(frozen=True)
class PictureIndex:
    """The pictures of a recording, in the order in which they are stored.

    Args:
        base: seconds of a tick.
        stamps: (F,) int64, when each is shown, in ticks.
        keys: (F,) bool, whether it can be decoded by itself.
        zero: seconds at which players begin to count.
        codec: how they are coded.
        late: seconds by which they are shown later than their stamps say (:mod:`dnnvss.media.edits`).
    """

    base: Fraction
    stamps: np.ndarray
    keys: np.ndarray
    zero: float
    codec: str
    late: float = 0.0

    @property
    def shown(self) -> np.ndarray:
        """The stamps (F,) in the order in which the pictures are shown."""
        return np.sort(self.stamps)

    def ticks(self, seconds: float) -> int:
        """The tick at a time that counts from where players begin."""
        return round((seconds + self.zero - self.late) / float(self.base))

    def seconds(self, ticks: int) -> float:
        """The time of a tick, counted from where players begin."""
        return float(ticks * self.base) - self.zero + self.late

    @property
    def ends(self) -> np.ndarray:
        """Numbers of stored pictures at which a copy may end: all before are shown before all behind."""
        latest = np.maximum.accumulate(self.stamps)
        earliest = np.minimum.accumulate(self.stamps[::-1])[::-1]
        return np.append(np.flatnonzero(latest[:-1] < earliest[1:]) + 1, len(self.stamps))


def picture_index(path: str | Path) -> PictureIndex:
    """The index of a recording's pictures.

    Raises:
        DnnvssError: the file is missing or unreadable, has no picture, or does not say when they are shown.
    """

    def read(p: Path) -> PictureIndex:
        with opened(p) as container:
            if not container.streams.video:
                raise DnnvssError("has no video stream", file=p, remedy="Give a recording with pictures")
            stream = main_stream(container)
            ordered = not stream.codec_context.has_b_frames
            rows = [(_stamp(packet, ordered), packet.is_keyframe, packet.dts) for packet in container.demux(stream)
                    if packet.size and not packet.is_discard]
            zero, late = (container.start_time or 0) / 1e6, float(hidden(container, stream.index))
            guessed = numbered(container)
            base, codec = Fraction(stream.time_base), str(stream.codec_context.name)
        found, keys, numbers = zip(*rows, strict=True) if rows else ((), (), ())
        unordered = guessed and not ordered and codec == "h264"  # which FFmpeg knows of MPEG-4 without decoding
        if not rows or None in found or len(set(found)) < len(rows) or unordered:
            raise DnnvssError("does not say when each of its pictures is shown", file=p, remedy=REMEDY)
        stamps = np.array(found, np.int64)
        if guessed and None not in numbers:
            late = float(np.median(np.sort(np.array(numbers, np.int64)) - np.sort(stamps))) * float(base)
        return PictureIndex(base, stamps, np.array(keys, bool), zero, codec, late)

    found: PictureIndex = files.read(path, read, REMEDY)
    return found


def _stamp(packet: Any, ordered: bool) -> int | None:
    """When a packet is shown; where pictures are stored in order, that is when it is decoded."""
    if packet.pts is not None:
        return int(packet.pts)
    return int(packet.dts) if ordered and packet.dts is not None else None


def seconds_of(path: str | Path) -> float:
    """How long a recording says that it lasts, 0 where it does not say.

    Raises:
        DnnvssError: it is missing or unreadable.
    """

    def read(p: Path) -> float:
        with opened(p) as container:
            return (container.duration or 0) / 1e6

    return float(files.read(path, read, "Check that it plays"))
