"""Pictures of a recording as players show them: upright, of whole frames, each at its time."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import av
import numpy as np

from dnnvss.media.edits import hidden

_SHORT = 60.0
"""Seconds of a recording up to which one thread decodes it: to start others takes what they save."""


@dataclass(frozen=True)
class Look:
    """How the pictures of a stream are to be shown.

    Args:
        matrix: of the file, row by row, as integers: for (a, b, _, c, d, ...) a point goes to ``x' = a x + c y``,
            ``y' = b x + d y``.
        pixel: width of a stored pixel over its height.
        interlaced: two half pictures, taken one after the other, make a frame.
    """

    matrix: tuple[int, ...] = ()
    pixel: Fraction = Fraction(1)
    interlaced: bool = False

    @property
    def on_side(self) -> bool:
        """Whether rows are to become columns."""
        return bool(self.matrix) and abs(self.matrix[1]) > abs(self.matrix[0])

    @property
    def turned(self) -> bool:
        """Whether the pictures are stored in another way than they are shown."""
        return bool(self.matrix) and (self.on_side or self.matrix[0] < 0 or self.matrix[4] < 0)

    @property
    def upright_pixel(self) -> Fraction:
        """Width of a pixel over its height in the upright picture."""
        return 1 / self.pixel if self.on_side else self.pixel

    def upright(self, image: np.ndarray) -> np.ndarray:
        """A stored picture (H, W_, ...) as it is shown; turned by quarters and mirrored, as the matrix says."""
        if not self.turned:
            return image
        shown = np.swapaxes(image, 0, 1) if self.on_side else image
        across, down = (self.matrix[3], self.matrix[1]) if self.on_side else (self.matrix[0], self.matrix[4])
        return np.ascontiguousarray(shown[:: -1 if down < 0 else 1, :: -1 if across < 0 else 1])

    def shown_size(self, width: int, height: int) -> tuple[int, int]:
        """Width and height of the upright picture."""
        return (height, width) if self.on_side else (width, height)


def main_stream(container: Any) -> Any:
    """The stream of pictures that players show; a cover in the file is none."""
    return container.streams.best("video") or container.streams.video[0]


def look_of(frame: Any, stream: Any) -> Look:
    """How pictures are to be shown, as a first frame and its stream say."""
    data = next((d for d in frame.side_data.keys() if d.type.name == "DISPLAYMATRIX"), None)  # noqa: SIM118
    matrix = tuple(int(v) for v in np.frombuffer(data, np.int32)) if data is not None else ()
    pixel = stream.sample_aspect_ratio or stream.codec_context.sample_aspect_ratio
    sane = pixel is not None and Fraction(1, 8) < pixel < 8
    return Look(matrix, Fraction(pixel) if sane else Fraction(1), bool(frame.interlaced_frame))


def numbered(container: Any) -> bool:
    """Whether a container (AVI) numbers its pictures and does not say when they are shown.

    What FFmpeg guesses there is a picture or more late: the n-th picture shown has the number of the n-th one stored.
    """
    return bool(container.format.name == "avi")


def decoded(container: Any) -> Iterator[tuple[float | None, Any, Look]]:
    """Time in seconds, frame and look of every picture of a recording; interlaced ones become whole pictures."""
    stream = main_stream(container)
    stream.thread_type = "NONE" if 0 < (container.duration or 0) <= _SHORT * av.time_base else "AUTO"
    numbers = deque[int]()
    packets = _noted(container, stream, numbers) if numbered(container) else container.demux(stream)
    late = float(hidden(container, stream.index))
    for frame, look in _whole(packets, stream):
        time = float(numbers.popleft() * stream.time_base) if numbers else frame.time
        yield None if time is None else time + late, frame, look


def _noted(container: Any, stream: Any, numbers: deque[int]) -> Iterator[Any]:
    """Yield the packets of a stream and note their numbers."""
    for packet in container.demux(stream):
        if packet.size and packet.dts is not None:
            numbers.append(packet.dts)
        yield packet


def _whole(packets: Iterator[Any], stream: Any) -> Iterator[tuple[Any, Look]]:
    """Yield frame and look of every picture in packets."""
    look, graph = None, None
    for frame in (frame for packet in packets for frame in packet.decode()):
        if look is None:
            look = look_of(frame, stream)
            graph = _deinterlacer(stream) if look.interlaced else None
        if graph is None:
            yield frame, look
        else:
            graph.vpush(frame)
            yield from ((whole, look) for whole in _pulled(graph))
    if graph is not None and look is not None:
        graph.vpush(None)
        yield from ((whole, look) for whole in _pulled(graph))


def _deinterlacer(stream: Any) -> Any:
    """A filter that makes each interlaced frame one whole picture, so that frames keep their numbers."""
    graph = av.filter.Graph()
    parts = [graph.add_buffer(template=stream), graph.add("bwdif", "mode=send_frame:deint=interlaced"),
             graph.add("buffersink")]
    graph.link_nodes(*parts).configure()
    return graph


def _pulled(graph: Any) -> Iterator[Any]:
    while True:
        try:
            yield graph.vpull()
        except (av.BlockingIOError, av.EOFError):
            return
