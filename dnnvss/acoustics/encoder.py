"""Speech as a pretrained encoder hears it: 384 numbers, 50 times a second, much alike for any voice."""

import hashlib
from dataclasses import dataclass

import numpy as np

from dnnvss.acoustics.analysis import RATE, resampled
from dnnvss.acoustics.encoder_model import WEIGHTS, WIDTH, run_encoder
from dnnvss.acoustics.whisper import encoder_input
from dnnvss.archives import Held, read_declared
from dnnvss.errors import DnnvssError
from dnnvss.files import write_arrays
from dnnvss.media import Sound
from dnnvss.settings import check_settings, setting
from dnnvss.timing import FrameClock

STEP = 320
"""Samples from one output to the next; output i belongs to sample ``320 i``."""
SPREAD = 1.0
"""About how much an output deviates."""
_VERSION = 1
_SILENCE = 50  # outputs of silence that follow a recording, as the encoder's training had it
_MOST, _BESIDE = 1500, 125  # outputs at once (30 s, as in its training), and those beside that only help


@dataclass(frozen=True)
class Encoder:
    """How the encoder of Whisper tiny.en hears.

    A recording goes through it at once; one of more than half a minute in overlapping pieces of
    30 s, of whose outputs those in the middle count. The causal form hears ``window`` outputs'
    worth of sound that end ``ahead`` outputs behind the last of each ``hop``; before the recording
    there is silence.

    **Source**: Radford et al. 2022, "Robust speech recognition via large-scale weak supervision".

    Args:
        causal: whether what lies far behind a moment is not heard.
        window: of the causal form, how much it hears at a time, in outputs of 20 ms.
        hop: of the causal form, how many outputs are made at a time.
        ahead: of the causal form, outputs behind the last of them that are heard.

    Raises:
        DnnvssError: a setting out of range, or a window that does not hold what it is to give.
    """

    causal: bool = setting(False, doc="whether only little behind a moment is heard")
    window: int = setting(50, least=20, most=_MOST, doc="outputs of 20 ms that are heard at a time")
    hop: int = setting(5, least=1, most=100, doc="outputs that are made at a time")
    ahead: int = setting(5, least=1, most=100, doc="outputs behind the last of them that are heard")

    def __post_init__(self) -> None:
        check_settings(self, "labels.encoder")
        if self.hop + self.ahead > self.window:
            raise DnnvssError(f"labels.encoder.window={self.window} does not hold hop={self.hop} and "
                              f"ahead={self.ahead} outputs", remedy="Take a longer window")

    @property
    def lookahead(self) -> float | None:
        """Seconds behind a moment that are heard at most; None for all of the recording."""
        return (self.hop + self.ahead) * STEP / RATE if self.causal else None

    @property
    def columns(self) -> tuple[str, ...]:
        """``e001`` and so on."""
        return tuple(f"e{i:03d}" for i in range(1, WIDTH + 1))

    @property
    def key(self) -> str:
        """A hash of everything that the numbers depend on."""
        form = (self.window, self.hop, self.ahead) if self.causal else ()
        return hashlib.sha256(repr((_VERSION, WEIGHTS, *form)).encode()).hexdigest()[:8]


def encoder_outputs(sound: Sound, encoder: Encoder) -> np.ndarray:
    """The outputs (n, 384) float16 of a sound, a little beyond its end.

    Where the sound names a folder for what is slow to work out, they are kept there, named by the
    samples.

    Raises:
        DnnvssError: the encoder is not installed, or the sound is none.
    """
    samples = resampled(sound)
    if sound.kept is None:
        return _worked_out(samples, encoder)
    name = hashlib.sha256(np.ascontiguousarray(samples).tobytes()).hexdigest()[:32]
    path = sound.kept / f"encoder-{encoder.key}" / f"{name}.npz"
    if not path.is_file():
        write_arrays(path, outputs=_worked_out(samples, encoder))
    held = {"outputs": Held((count_of(len(samples)), WIDTH), "f")}
    return read_declared(path, held, f"Delete {path.parent}")["outputs"]


def count_of(samples: int) -> int:
    """Outputs of so many samples."""
    return samples // STEP + 2


def places_of(clock: FrameClock, frames: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Between which outputs the centres of frames (n,) lie.

    Returns:
        The output before each, and how far the centre lies from it to the next, 0 to 1; that of the
        last of ``count`` for centres behind it.
    """
    exact = np.clip(clock.times(frames + 0.5) * RATE / STEP, 0, count - 1)
    before = np.minimum(np.floor(exact), count - 2)
    return before.astype(np.int64), exact - before


def _worked_out(samples: np.ndarray, encoder: Encoder) -> np.ndarray:
    count = count_of(len(samples))
    out = np.empty((count, WIDTH), np.float16)
    size = encoder.hop if encoder.causal else _MOST - 2 * _BESIDE
    if not encoder.causal and count + _SILENCE <= _MOST:
        size = count
    for first in range(0, count, size):
        last = min(first + size, count)
        made = causal_outputs(samples, encoder, first) if encoder.causal else _piece(samples, first, last)
        out[first:last] = made[: last - first]
    return out


def _piece(samples: np.ndarray, first: int, last: int) -> np.ndarray:
    """Outputs ``first`` to ``last - 1``, heard with what lies around them."""
    start = max(first - _BESIDE, 0)
    stop = min(last + _BESIDE, count_of(len(samples)) + _SILENCE)
    heard = between(samples, start * STEP, stop * STEP)
    return run_encoder(encoder_input(heard))[first - start : last - start]


def causal_outputs(samples: np.ndarray, encoder: Encoder, first: int, begin: int = 0) -> np.ndarray:
    """The ``hop`` outputs from ``first`` on, which is a multiple of it.

    Args:
        samples: of the sound, from sample ``begin`` on; what lies before and behind is silence.
        encoder: a causal one.
        first: the first output.
        begin: what was left out at the start.
    """
    stop = first + encoder.hop - 1 + encoder.ahead
    heard = between(samples, (stop - encoder.window) * STEP - begin, stop * STEP - begin)
    found = run_encoder(encoder_input(heard))
    return found[encoder.window - (stop - first) :][: encoder.hop]


def between(samples: np.ndarray, start: int, stop: int) -> np.ndarray:
    """Samples ``start`` to ``stop - 1``, silence where there are none."""
    inner = samples[max(start, 0) : max(stop, 0)]
    before = min(max(-start, 0), stop - start)
    return np.pad(inner, (before, stop - start - before - len(inner)))
