"""Acoustic features while the sound arrives: the causal form of an analysis, frame by frame."""

import numpy as np

from dnnvss.acoustics.analysis import RATE, Analysis, check_samples, cut, window_starts
from dnnvss.acoustics.normalise import Running
from dnnvss.errors import DnnvssError
from dnnvss.timing import FrameClock


class AcousticStream:
    """Rows of a causal analysis while samples arrive; the same as :func:`analyse` gives of them all.

    Between calls it holds one window of sound at most.

    Args:
        analysis: a causal one.
        clock: of the frames.
        running: whether rows are normalised by those so far.

    Raises:
        DnnvssError: the analysis looks ahead.
    """

    def __init__(self, analysis: Analysis, clock: FrameClock, running: bool = False) -> None:
        if not analysis.causal:
            raise DnnvssError(f"labels.{analysis.name} looks at sound behind its frame, so it "
                              "cannot be worked out as the sound comes",
                              remedy=f"Use labels.{analysis.name}.causal=true")
        self.analysis, self.clock = analysis, clock
        self._norm = Running(analysis.spread, float(clock.rate)) if running else None
        self._held, self._first, self._heard, self._frames = np.zeros(0), 0, 0, 0

    def push(self, samples: np.ndarray) -> np.ndarray:
        """Rows (n, C) float64 of the frames that end with these samples (m,), which follow the last.

        Args:
            samples: any number of them, at :data:`~dnnvss.acoustics.RATE`.

        Raises:
            DnnvssError: samples that are no finite numbers in about [-1, 1].
        """
        samples = np.asarray(samples)
        check_samples(samples)
        self._heard += len(samples)
        self._held = np.concatenate([self._held, samples])
        return self._settled(self._complete())

    def finish(self) -> np.ndarray:
        """Rows (n, C) of the frames that the end of the sound cuts, if half of them is there."""
        return self._settled(self.clock.edge(self._heard / RATE))

    def _complete(self) -> int:
        """How many frames end with the samples that were heard."""
        count = max(self._frames, int(self._heard / RATE * self.clock.rate) - 1)
        size = self.analysis.samples
        while window_starts(self.analysis, self.clock, np.array([count]))[0] + size <= self._heard:
            count += 1
        return count

    def _settled(self, count: int) -> np.ndarray:
        """Rows of the frames up to ``count``; what no later one looks at is forgotten."""
        size, frames = self.analysis.samples, np.arange(self._frames, max(count, self._frames))
        starts = window_starts(self.analysis, self.clock, frames)
        out = np.empty((len(frames), len(self.analysis.columns)))
        for low in range(0, len(frames), 4096):
            part = slice(low, low + 4096)
            out[part] = self.analysis.rows(cut(self._held, starts[part] - self._first, size))
        self._frames += len(frames)
        ahead = window_starts(self.analysis, self.clock, np.array([self._frames]))[0]
        spent = min(max(int(ahead) - self._first, 0), len(self._held))
        self._held, self._first = self._held[spent:], self._first + spent
        return out if self._norm is None else self._norm.push(out)
