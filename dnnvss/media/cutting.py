"""A clip cut out of a long recording: its pictures copied as they are stored, or encoded where they cannot be."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import av
import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.media.containers import opened
from dnnvss.media.decoding import Look, decoded, main_stream
from dnnvss.media.index import REMEDY, PictureIndex
from dnnvss.media.reading import SOUND_RATE
from dnnvss.media.storing import stretch
from dnnvss.media.writing import SoundTrack, video_frame, video_stream
from dnnvss.shortages import shortage_of

COPIED = ("h264", "hevc", "av1", "libdav1d", "vp9", "mpeg4", "mjpeg", "mpeg2video", "mpeg1video")
"""How pictures are coded that an mp4 file can hold."""
_LEAD = 15.0
"""Seconds of pictures before a clip that its copy may hold, and that players pass over."""
_LATER = 0.35
"""Seconds by which a copy may end later than it should."""
_TICK = 1e-3
"""Seconds by which a picture of a copy may be shown earlier or later."""
_QUALITY = 12
_REMEDY = "Check that it plays"


@dataclass(frozen=True)
class Cut:
    """A clip of a recording.

    Args:
        first, end: the pictures in the order in which they are shown.
        start: seconds of its first picture, from where players begin.
        copied: its pictures are those of the recording, bit by bit.
    """

    first: int
    end: int
    start: float
    copied: bool


def cut(path: Path, index: PictureIndex, sound: Path, start: float, end: float, out: Path) -> Cut:
    """Cut a clip and return which pictures it holds.

    Pictures are copied from the last one before the clip that can be decoded by itself; an edit list hides those
    before the clip. Where that is not possible (another kind of coding, a copy that reads otherwise, or more than
    15 s to hide), the pictures are encoded anew, hardly with a loss, each at its time.

    Args:
        path: the recording.
        index: its pictures.
        sound: its sound as :func:`dnnvss.media.storing.store_sound` wrote it at 48 kHz, from where players begin.
        start, end: seconds from where players begin.
        out: the clip, ``.mp4``; its sound is mono.

    Raises:
        DnnvssError: there is no picture in between, or the recording cannot be read there.
    """
    shown = index.shown
    first, last = np.searchsorted(shown, [index.ticks(start), index.ticks(end)])
    if first >= min(last, len(shown)):
        raise DnnvssError(f"has no picture from {start:.2f} to {end:.2f} s", file=path, remedy=_REMEDY)
    found = _copied(path, index, sound, int(first), int(last), out) if index.codec in COPIED else None
    try:
        return found or _encoded(path, index, sound, int(first), int(last), out)
    except av.FFmpegError as error:
        if (short := shortage_of(error, out)) is not None:
            raise short from error
        raise DnnvssError(f"cannot be cut from {start:.2f} to {end:.2f} s ({error})", file=path,
                          remedy=REMEDY) from error


def _copied(path: Path, index: PictureIndex, sound: Path, first: int, last: int, out: Path) -> Cut | None:
    """The clip as a copy, None where that cannot be."""
    shown, ends = index.shown, index.ends
    begin = int(shown[first])
    stop = int(ends[np.searchsorted(np.maximum.accumulate(index.stamps)[ends - 1], shown[last - 1])])
    keys = np.flatnonzero(index.keys[:stop] & (index.stamps[:stop] <= begin))
    latest = int(index.stamps[:stop].max())
    end = int(np.searchsorted(shown, latest, "right"))
    if not len(keys) or (latest - shown[last - 1]) * index.base > _LATER:
        return None
    if (begin - int(index.stamps[keys[-1]])) * index.base > _LEAD:
        return None
    wanted = (shown[first:end] - begin) * float(index.base)
    try:
        with files.replacing(out) as temporary:
            packets = _packets(path, index.stamps[keys[-1] : stop], begin)
            _mux(temporary, path, packets, _sound(sound, index, begin, latest))
            made = _stamps(temporary)
            if len(made) != len(wanted) or np.abs(made - wanted).max(initial=0.0) > _TICK:
                raise _OtherwiseError
    except (_OtherwiseError, av.FFmpegError, ValueError):
        files.remove(out)
        return None
    return Cut(first, end, index.seconds(begin), True)


class _OtherwiseError(Exception):
    """A copy does not read as it was meant."""


_BACK = (0.0, 10.0, np.inf)
"""Seconds before a place from which it is looked for: some containers are searched by guessing, and read through
where that fails."""


def _packets(path: Path, stamps: np.ndarray, begin: int) -> Iterator[Any]:
    """Yield the packets that are stored with these stamps (n,), their times from ``begin``.

    When each is to be decoded is worked out anew: not every container tells.
    """
    ordered = np.sort(stamps)
    decode = ordered - (ordered - stamps).max() - begin
    key, at = int(stamps[0]), 0
    for back in _BACK:
        with opened(path) as container:
            for packet in _demuxed(container, key, back):
                stamp = packet.pts if packet.pts is not None else packet.dts
                if not at and stamp != key:
                    if stamp is not None and stamp > key and np.isfinite(back):
                        break  # it is before
                    continue
                packet.pts, packet.dts = stamp - begin, int(decode[at])
                yield packet
                at += 1
                if at == len(stamps):
                    return
            if at:
                return


def _demuxed(container: Any, place: int, back: float) -> Iterator[Any]:
    """Yield the packets with pictures from some seconds before a place on."""
    _seek(container, place, back)
    yield from (packet for packet in container.demux(main_stream(container)) if packet.size)


def _seek(container: Any, place: int, back: float) -> None:
    if np.isfinite(back):
        stream = main_stream(container)
        container.seek(max(place - round(back / float(stream.time_base)), stream.start_time or 0), stream=stream,
                       backward=True)


def _frames(path: Path, begin: int, latest: int) -> Iterator[tuple[Any, Look]]:
    """Yield the pictures from one tick to another, and how they are shown."""
    for back in _BACK:
        with opened(path) as container:
            _seek(container, begin, back)
            early = False
            for _, frame, look in decoded(container):
                if frame.pts is None or frame.pts < begin:
                    early = True
                    continue
                if not early and frame.pts > begin and back < _BACK[-1]:
                    break  # it is before
                if frame.pts > latest:
                    return
                early = True
                yield frame, look
            if early:
                return


def _mux(out: Path, path: Path, packets: Iterator[Any], samples: np.ndarray) -> None:
    with opened(path) as source, av.open(str(out), "w", format="mp4", options={"movflags": "faststart"}) as made:
        stream = made.add_stream_from_template(main_stream(source))
        track = SoundTrack(made, samples, SOUND_RATE) if len(samples) else None
        for packet in packets:
            packet.stream = stream
            if track is not None:
                track.write_until(float(packet.dts * packet.time_base))
            made.mux(packet)
        if track is not None:
            track.finish()


def _stamps(path: Path) -> np.ndarray:
    """When the pictures of a copy are shown, in seconds; the first is decoded, to see that it can be."""
    with opened(path) as container:
        if not container.streams.video or (first := next(container.decode(main_stream(container)), None)) is None:
            return np.zeros(0)
        if first.pts != 0:
            return np.zeros(0)
    with opened(path) as container:
        stream = main_stream(container)
        found = [packet.pts for packet in container.demux(stream)
                 if packet.size and packet.pts is not None and not packet.is_discard]
        return np.sort(np.array(found, float)) * float(stream.time_base)


def _sound(sound: Path, index: PictureIndex, begin: int, latest: int) -> np.ndarray:
    """The sound of the pictures from one tick to another."""
    step = float(np.median(np.diff(index.shown[:1000]))) if len(index.stamps) > 1 else 0.0
    return stretch(sound, SOUND_RATE, index.seconds(begin), index.seconds(latest) + step * float(index.base))


def _encoded(path: Path, index: PictureIndex, sound: Path, first: int, last: int, out: Path) -> Cut:
    """The clip, encoded."""
    shown = index.shown
    begin, latest = int(shown[first]), int(shown[last - 1])
    samples = _sound(sound, index, begin, latest)
    with files.replacing(out) as temporary, av.open(
            str(temporary), "w", format="mp4", options={"movflags": "faststart"}) as made:
        stream, track, count = None, None, 0
        for frame, look in _frames(path, begin, latest):
            image = look.upright(frame.to_ndarray(format="rgb24"))
            if stream is None:
                stream = video_stream(made, image.shape, 1 / index.base, _QUALITY, look.upright_pixel)
                track = SoundTrack(made, samples, SOUND_RATE) if len(samples) else None
            picture = video_frame(image)
            picture.pts, picture.time_base = frame.pts - begin, index.base
            made.mux(stream.encode(picture))
            if track is not None:
                track.write_until(float((frame.pts - begin) * index.base))
            count += 1
        if stream is None or count != last - first:
            raise DnnvssError(f"gives {count} of the {last - first} pictures from {index.seconds(begin):.2f} s",
                              file=path, remedy=_REMEDY)
        made.mux(stream.encode(None))
        if track is not None:
            track.finish()
    return Cut(first, last, index.seconds(begin), False)
