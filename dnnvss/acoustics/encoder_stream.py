"""The encoder's outputs on a clock while the sound arrives."""

import numpy as np

from dnnvss.acoustics.analysis import RATE, check_samples
from dnnvss.acoustics.encoder import SPREAD, STEP, Encoder, causal_outputs, places_of
from dnnvss.acoustics.encoder_model import WIDTH
from dnnvss.acoustics.normalise import Running
from dnnvss.errors import DnnvssError
from dnnvss.timing import FrameClock


class EncoderStream:
    """Rows of the causal encoder while samples arrive; the same as of the whole recording.

    Args:
        encoder: a causal one.
        clock: of the frames.
        running: whether outputs are normalised by those so far.

    Raises:
        DnnvssError: the encoder hears all of the recording.
    """

    def __init__(self, encoder: Encoder, clock: FrameClock, running: bool = False) -> None:
        if not encoder.causal:
            raise DnnvssError("labels.encoder hears the whole recording, so it cannot be worked out "
                              "as the sound comes", remedy="Use labels.encoder.causal=true")
        self.encoder, self.clock = encoder, clock
        self._norm = Running(SPREAD, RATE / STEP) if running else None
        self._held, self._begin, self._heard, self._frames = np.zeros(0, np.float32), 0, 0, 0
        self._outputs, self._first = np.zeros((0, WIDTH), np.float32), 0

    def push(self, samples: np.ndarray) -> np.ndarray:
        """Rows (n, 384) float32 of the frames that are settled once these samples (m,) came.

        Raises:
            DnnvssError: samples that are no finite numbers in about [-1, 1].
        """
        samples = np.asarray(samples)
        check_samples(samples)
        self._heard += len(samples)
        self._held = np.concatenate([self._held, samples.astype(np.float32)])
        while (self._next + self._reach) * STEP <= self._heard:
            self._encode()
        reached = (self._next - 1) * STEP / RATE  # what lies up to the last output can be told
        return self._settled(int(np.floor(reached * float(self.clock.rate) + 0.5)))

    def finish(self) -> np.ndarray:
        """Rows (n, 384) of the frames up to the end of the sound."""
        last = self._heard // STEP + 2
        while self._next < last:
            self._encode()
        return self._settled(self.clock.edge(self._heard / RATE), last)

    @property
    def _reach(self) -> int:
        """Outputs from the next one to the end of the sound that it needs."""
        return self.encoder.hop - 1 + self.encoder.ahead

    @property
    def _next(self) -> int:
        """The output to be made next."""
        return self._first + len(self._outputs)

    def _encode(self) -> None:
        """Make some outputs more; forget the sound that no later one hears."""
        made = causal_outputs(self._held, self.encoder, self._next, self._begin)
        made = made.astype(np.float16)
        if self._norm is not None:
            made = self._norm.push(made)
        self._outputs = np.concatenate([self._outputs, made.astype(np.float32)])
        oldest = self._next + self._reach - self.encoder.window
        spent = min(max(oldest * STEP - self._begin, 0), len(self._held))
        self._held, self._begin = self._held[spent:], self._begin + spent

    def _settled(self, frames: int, count: int | None = None) -> np.ndarray:
        """Rows of the frames up to ``frames``; outputs that no later one lies beside are forgotten."""
        wanted = np.arange(self._frames, max(frames, self._frames))
        if not len(wanted):
            return np.zeros((0, WIDTH), np.float32)
        before, share = places_of(self.clock, wanted, self._next if count is None else count)
        rows = mixed(self._outputs, before - self._first, share.astype(np.float32))
        self._frames += len(wanted)
        spent = int(before[-1]) - self._first
        self._outputs, self._first = self._outputs[spent:], self._first + spent
        return rows


def mixed(outputs: np.ndarray, before: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Rows (n, 384) between outputs ``before`` (n,) and the next ones, at a share (n,) of the way."""
    low, high = outputs[before].astype(np.float32), outputs[before + 1].astype(np.float32)
    return low + share[:, None] * (high - low)
