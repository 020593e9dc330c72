"""The sound of a recording, every block at its time, mono."""

from pathlib import Path
from typing import Any

import av
import numpy as np

from dnnvss.media.containers import opened

_JITTER = 0.02
"""Seconds by which the time stamp of a block may differ from the end of the one before: clocks of milliseconds."""
_LONGEST = 600.0
"""Seconds beyond which a gap is a mistake of the file, and no pause in it."""
_OFFSET = 1e-3
"""Share of full scale from which a constant offset is taken out."""
_SILENT = 1e-4
"""Largest sample of a channel that holds nothing."""
_CANCELLED = 0.5
"""Share of the loudest channel's power below which a mix of the channels is worse than that channel alone."""


def mono(path: Path, tracks: int, rate: int) -> tuple[np.ndarray, float]:
    """The sound (samples,) float32 at ``rate`` of the first track that holds any, and its first time stamp in seconds.

    Gaps in it are filled with silence, so that what follows stays in its place. Channels are mixed; those that hold
    nothing do not count, and where they cancel each other (a lead with swapped wires), the loudest stands alone. A
    constant offset, as cheap sound cards add, is taken out.
    """
    first = np.zeros(0, np.float32), 0.0
    for track in range(tracks):
        with opened(path) as container:
            channels, start = _channels(container, track, rate)
        sound = mixed(channels)
        if np.abs(sound).max(initial=0.0) > _SILENT:
            return sound, start
        first = first if track else (sound, start)
    return first


def mixed(channels: np.ndarray) -> np.ndarray:
    """One channel (n,) of several (C, n), each without its offset."""
    means = channels.mean(axis=1, keepdims=True) if channels.size else 0.0
    centred = channels - np.where(np.abs(means) > _OFFSET, means, 0).astype(np.float32)
    if len(centred) == 1:
        return np.asarray(centred[0])
    power = (centred.astype(np.float64) ** 2).mean(axis=1) if centred.size else np.zeros(len(centred))
    heard = centred[power > _SILENT**2]
    if not len(heard):
        return np.asarray(centred.mean(axis=0))
    mix = heard.mean(axis=0)
    return mix if (mix.astype(np.float64) ** 2).mean() >= _CANCELLED**2 * power.max() else centred[power.argmax()]


def _channels(container: Any, track: int, rate: int) -> tuple[np.ndarray, float]:
    """All channels (C, n) of a track at ``rate`` on one line of time, and the time stamp of its first block."""
    line: _Line | None = None
    for frame in container.decode(audio=track):
        line = line or _Line(rate, frame.time or 0.0)
        line.add(frame)
    return (line.joined(), line.start) if line is not None else (np.zeros((1, 0), np.float32), 0.0)


class _Line:
    """Blocks of sound laid on a line of time."""

    def __init__(self, rate: int, start: float) -> None:
        self.rate, self.start = rate, start
        self.seconds, self.setup = 0.0, tuple[Any, ...]()
        self.parts = list[np.ndarray]()
        self.resampler: Any = None

    def add(self, frame: Any) -> None:
        """Lay a block behind the others, or behind a gap where its time stamp says that there is one."""
        missing = 0.0 if frame.time is None else frame.time - self.start - self.seconds
        setup = frame.format.name, frame.layout.name, frame.sample_rate
        if _JITTER < missing < _LONGEST or setup != self.setup:
            self._flush()
            self.resampler, self.setup = av.AudioResampler(format="fltp", layout=frame.layout, rate=self.rate), setup
        if _JITTER < missing < _LONGEST:
            self.seconds += missing
            lacking = round(self.seconds * self.rate) - sum(p.shape[1] for p in self.parts)
            self.parts.append(np.zeros((len(frame.layout.channels), max(lacking, 0)), np.float32))
        self.seconds += frame.samples / frame.sample_rate
        frame.pts = None  # blocks follow each other; gaps are filled above
        self.parts += [block.to_ndarray() for block in self.resampler.resample(frame)]

    def _flush(self) -> None:
        if self.resampler is not None:
            self.parts += [block.to_ndarray() for block in self.resampler.resample(None)]
            self.resampler = None

    def joined(self) -> np.ndarray:
        """All blocks (C, n); where their channels differ, all have the most of them."""
        self._flush()
        most = max((len(p) for p in self.parts), default=1)
        full = (np.pad(p, ((0, most - len(p)), (0, 0)), mode="edge") for p in self.parts)
        return np.concatenate([np.zeros((most, 0), np.float32), *full], axis=1)
