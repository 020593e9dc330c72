"""``dnnvss live RUN``: a face that moves while somebody speaks.

Sound comes from standard input, or from a file at its own pace: raw 16-bit samples (s16le, mono, ``--rate``) or a wav
file. Out come lines of JSON (``frame``, ``seconds`` and the face's gauges and coefficients) or raw pictures (rgb24),
each a bounded time after its sound; how long is told at the start, on standard error. RUN is a run of a network with
a look-ahead whose labels read the sound alone, by causal analyses:

    dnnvss train corpus=grid +experiment=live
    arecord -f S16_LE -r 16000 -c 1 -t raw | dnnvss live runs/NAME
    dnnvss live runs/NAME --sound speech.wav --video - | ffplay -f rawvideo -pixel_format rgb24 -video_size WxH -
"""

import argparse
import io
import json
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Protocol

import numpy as np

from dnnvss import files
from dnnvss.commands.flags import Flags, given_as, number, whole
from dnnvss.commands.usage import DONE, INTERRUPTED, UsageError
from dnnvss.errors import DnnvssError
from dnnvss.media import RATES, SPEECH_RATE
from dnnvss.media.folders import SOUNDS, VIDEOS
from dnnvss.timing import FrameClock

if TYPE_CHECKING:
    from dnnvss.synthesis.live import LiveFace

_BLOCK = 0.02
"""Seconds of sound that a file gives at a time."""
_MOST = 1 << 16
"""Bytes that are read at a time."""
STDIO = "-"
_INPUT, _OUTPUT = "standard input", "standard output"
_MOST_PICTURES = 1000
"""Pictures a second, beyond which no screen goes."""
_TOLD = 1.0
"""Seconds of sound, of which the share of a core means something."""
_OTHER_SOUNDS = frozenset((*SOUNDS, *VIDEOS, ".oga", ".au", ".amr")) - {".wav"}


def main(arguments: Sequence[str]) -> int:
    """Follow the sound until it ends."""
    parser = Flags(prog="dnnvss live", description=__doc__)
    parser.add_argument("run", type=Path, metavar="RUN", help="a run folder")
    parser.add_argument("--sound", default=STDIO, metavar="FILE", help="- for standard input (-)")
    parser.add_argument("--rate", type=whole(*RATES), default=16000, help="samples a second of raw sound (16000)")
    parser.add_argument("--curves", metavar="FILE", help="lines of JSON; - for standard output, as without --video")
    parser.add_argument("--video", metavar="FILE", help="raw pictures, rgb24; - for standard output")
    parser.add_argument("--fps", type=given_as(_pictures_a_second), help="pictures a second; the talker's unless given")
    parser.add_argument("--scale", type=number(0, 16, above=True), default=1.0, help="size of the pictures (1)")
    parser.add_argument("--smoothing", type=whole(0, 10000), default=40,
                        help="milliseconds that parameter generation waits for, as far as its windows let it (40)")
    parser.add_argument("--articulation", type=number(0, 100), default=1.0,
                        help="the dial: 1 for the talker's variance (1)")
    parser.add_argument("--fast", action="store_true", help="a file as fast as it can be read")
    options = parser.read(arguments)
    if options.curves is None and options.video is None:
        options.curves = STDIO
    if options.curves == options.video == STDIO:
        raise UsageError("--curves and --video both write to standard output", remedy="Give one of them a file")
    return _live(options)


def _live(options: argparse.Namespace) -> int:
    import torch

    from dnnvss.runs.run import Run
    from dnnvss.synthesis.live import LiveFace, LiveSettings

    check_places(options.sound, [name for name in (options.curves, options.video) if name is not None])
    torch.set_num_threads(1)
    run = Run.open(options.run)
    try:
        face = LiveFace(run, LiveSettings(options.smoothing / 1000, options.articulation, options.fps))
    except DnnvssError as error:
        raise DnnvssError(error.problem, file=run.folder, remedy=error.remedy) from error
    with ExitStack() as stack:
        source = _standard_input() if options.sound == STDIO else stack.enter_context(_opened(options.sound))
        curves, video = (None if name is None else stack.enter_context(Sink(name))
                         for name in (options.curves, options.video))
        outputs = Outputs(face, curves, video, options.scale)
        print(told(face), *outputs.told, sep="\n", file=sys.stderr, flush=True)
        paced = options.sound != STDIO and Path(options.sound).is_file() and not options.fast
        sound = blocks(source, options.rate, paced, options.sound)
        try:
            print(follow(face, outputs, sound), file=sys.stderr)
        except KeyboardInterrupt:
            print(f"stopped after {outputs.count} pictures", file=sys.stderr)
            return INTERRUPTED
    return DONE


def _pictures_a_second(text: str) -> FrameClock:
    clock = FrameClock(text)
    if clock.rate > _MOST_PICTURES:
        raise DnnvssError(f"more than {_MOST_PICTURES} pictures a second")
    return clock


def check_places(sound: str, outputs: Sequence[str]) -> None:
    """Refuse outputs that cannot be written, that are one file, or the file that is read.

    Raises:
        DnnvssError: the first of them.
    """
    read = [Path("/dev/stdin" if sound == STDIO else sound)]
    written = [Path(name) for name in outputs if name != STDIO]
    for path in written:
        if path.is_dir():
            raise DnnvssError("is a folder", file=path, remedy="Name a file in it")
        files.make_folder(path.parent)
        if not os.access(path if path.exists() else path.parent, os.W_OK):
            raise DnnvssError("cannot be written", file=path, remedy="Choose another place")
    files.check_apart([path for path in written if path.is_file() or not path.exists()],
                      [path for path in read if path.is_file()])


def told(face: "LiveFace") -> str:
    """How far behind the sound the face is, and why."""
    parts = ", ".join(f"{name} {1000 * seconds:.0f}" for name, seconds in face.parts.items())
    return (f"the face follows {1000 * face.lag:.0f} ms behind the sound (ms: {parts}), "
            f"at {float(face.clock.rate):g} pictures a second")


def blocks(source: BinaryIO, rate: int, paced: bool, name: str = STDIO) -> Iterator[np.ndarray]:
    """Samples (m,) as they come, in pieces of any size, until the source stops.

    Args:
        source: of bytes.
        rate: samples a second of raw sound.
        paced: whether to wait until each piece would have been spoken.
        name: of the source, for messages.

    Raises:
        DnnvssError: what comes is no sound that can be read so; names the source.
    """
    try:
        yield from _blocks(source, rate, paced, name.lower().endswith(".wav"))
    except DnnvssError as error:
        where = _INPUT if name == STDIO else name
        raise DnnvssError(error.problem, file=error.file or where, remedy=error.remedy) from error


def _blocks(source: BinaryIO, rate: int, paced: bool, wav: bool) -> Iterator[np.ndarray]:
    from dnnvss.media.live import SoundBytes

    sound, begun, given = SoundBytes(rate, wav=wav), time.monotonic(), 0
    while data := source.read(2 * sound.channels * round(sound.rate * _BLOCK)) if paced else _available(source):
        samples = sound.push(data)
        given += len(samples)
        if paced:
            time.sleep(max(0.0, begun + given / SPEECH_RATE - time.monotonic()))
        yield samples
    yield sound.finish()


def _available(source: BinaryIO) -> bytes:
    """What is there, at least a byte; nothing where the source has stopped."""
    return source.read1(_MOST) if isinstance(source, io.BufferedReader) else source.read(_MOST)


def follow(face: "LiveFace", outputs: "Outputs", sound: Iterable[np.ndarray]) -> str:
    """Let the face follow the sound to its end, and tell what it took."""
    begun, seconds = time.process_time(), 0.0
    for samples in sound:
        seconds += len(samples) / SPEECH_RATE
        outputs.write(face.push(samples))
    outputs.write(face.finish())
    outputs.end()
    given = f"{outputs.count} pictures of {seconds:.1f} s of sound"
    if seconds < _TOLD:
        return given
    return f"{given}, {100 * (time.process_time() - begun) / seconds:.0f} % of one core"


class Writable(Protocol):
    """What takes bytes."""

    def write(self, data: bytes, /) -> object:
        """Take the bytes."""

    def flush(self) -> object:
        """Hand on all that was taken."""


class Sink:
    """A file or standard output, opened when there is something to write: till then an older file stays as it was.

    Args:
        name: of the file; :data:`STDIO` for standard output.
    """

    def __init__(self, name: str) -> None:
        self.name, self.stack = name, ExitStack()
        self.file: BinaryIO | None = sys.stdout.buffer if name == STDIO else None

    def __enter__(self) -> "Sink":
        return self

    def __exit__(self, *_: object) -> None:
        self._tried(self.stack.close)

    def write(self, data: bytes) -> None:
        """Write the bytes.

        Raises:
            DnnvssError: the system does not let them be written.
            BrokenPipeError: the reader has read enough.
        """
        self._tried(lambda: self._opened().write(data))

    def flush(self) -> None:
        """Hand on what was written, be it nothing.

        Raises:
            DnnvssError, BrokenPipeError: as :meth:`write`.
        """
        self._tried(lambda: self._opened().flush())

    def _opened(self) -> BinaryIO:
        if self.file is None:
            self.file = io.BufferedWriter(io.FileIO(self.name, "w"))
            self.stack.callback(self.file.close)
        return self.file

    def _tried(self, step: Callable[[], object]) -> None:
        try:
            step()
        except BrokenPipeError:
            raise
        except OSError as error:
            raise DnnvssError(f"cannot be written any further ({error.strerror or error})",
                              file=_OUTPUT if self.name == STDIO else self.name,
                              remedy="Free some space or choose another place") from error


class Outputs:
    """Curves and pictures, each given out as soon as it is known.

    Args:
        face: whose they are.
        curves, video: where they go, None for not.
        scale: size of the pictures.
    """

    def __init__(self, face: "LiveFace", curves: Writable | None, video: Writable | None, scale: float = 1.0) -> None:
        from dnnvss.style.generator import all_gauges

        self.face, self.curves, self.video, self.count = face, curves, video, 0
        self.gauges = all_gauges(face.run.face) if curves else {}
        self.pictures = face.run.pictures(scale) if video else None

    @property
    def told(self) -> list[str]:
        """What a reader has to know of the pictures."""
        if self.pictures is None:
            return []
        width, height = self.pictures.size
        return [f"video: rgb24, {width}x{height}"]

    def write(self, rows: np.ndarray) -> None:
        """Give out the next pictures, of parameters (n, D)."""
        if not len(rows):
            return
        if self.curves:
            self.curves.write("".join(self._lines(rows)).encode())
            self.curves.flush()
        if self.video and self.pictures is not None:
            for picture in self.pictures.frames(rows):
                self.video.write(picture.tobytes())
            self.video.flush()
        self.count += len(rows)

    def end(self) -> None:
        """No more comes: where nothing came, the outputs are empty."""
        for sink in (self.curves, self.video):
            if sink is not None:
                sink.flush()

    def _lines(self, rows: np.ndarray) -> Iterator[str]:
        values = {name: gauge(rows) for name, gauge in self.gauges.items()}
        for k in range(len(rows)):
            frame = self.count + k
            middle = round(float(self.face.clock.seconds(2 * frame + 1)) / 2, 6)
            numbers = {name: round(float(row[k]), 5) for name, row in values.items()}
            yield json.dumps({"frame": frame, "seconds": middle, **numbers}) + "\n"


def _standard_input() -> BinaryIO:
    if sys.stdin is None:
        raise DnnvssError(f"{_INPUT} is closed", remedy="Pipe sound into it, or give --sound FILE")
    return sys.stdin.buffer


def _opened(name: str) -> BinaryIO:
    path = Path(name)
    if path.is_dir() or not path.exists():
        raise DnnvssError("is a folder" if path.is_dir() and name else "no such file", file=name or "''",
                          remedy="Check the path given as --sound")
    if path.suffix.lower() in _OTHER_SOUNDS:
        raise DnnvssError(f"{path.suffix} files hold no samples one behind the other", file=path,
                          remedy=f"Give a wav file, or decode it: ffmpeg -i {path} -f s16le -ac 1 -ar 16000 -")
    return path.open("rb")
