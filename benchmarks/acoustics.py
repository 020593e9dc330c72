"""What features of the sound cost: the share of one core, of a whole recording and as the sound comes.

    python benchmarks/acoustics.py
"""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from dnnvss.acoustics import (
    RATE,
    AcousticStream,
    Analysis,
    Encoder,
    EncoderStream,
    Energy,
    Formants,
    LogMel,
    Lpc,
    Lsf,
    Mfcc,
    Voicing,
    analyse,
    encoder_outputs,
)
from dnnvss.formats.tables import markdown_table
from dnnvss.media import Sound
from dnnvss.timing import FrameClock

SECONDS, PIECE = 3, 320
CLOCK = FrameClock(100)
SOUND = Sound(np.random.default_rng(0).normal(0, 0.05, SECONDS * RATE).astype(np.float32), RATE)
ANALYSES: tuple[Any, ...] = (LogMel, Mfcc, Lpc, Lsf, Formants, Energy, Voicing)
FORMS = (Encoder(causal=True), Encoder(causal=True, hop=4, ahead=6), Encoder(causal=True, window=100, hop=4, ahead=6))


def share(work: Callable[[], object]) -> str:
    """Processor seconds for a second of sound, after a first time that is not counted."""
    work()
    start = time.process_time()
    work()
    return f"{100 * (time.process_time() - start) / SECONDS:.1f} %"


def streamed(kind: Callable[[Any, FrameClock], AcousticStream | EncoderStream], analysis: Analysis | Encoder) -> None:
    """Push the sound in pieces of 20 ms into a new stream."""
    stream = kind(analysis, CLOCK)
    for start in range(0, len(SOUND.samples), PIECE):
        stream.push(SOUND.samples[start : start + PIECE])
    stream.finish()


def main() -> None:
    """Print the table."""
    rows: list[tuple[str, str, str]] = []
    for kind in ANALYSES:
        rows.append((kind.name, share(partial(analyse, SOUND, kind(), CLOCK, 0, 100 * SECONDS)),
                     share(partial(streamed, AcousticStream, kind(causal=True)))))
    rows.append(("encoder", share(lambda: encoder_outputs(SOUND, Encoder())), ""))
    for form in FORMS:
        name = f"encoder, causal: window {form.window}, hop {form.hop}, ahead {form.ahead}"
        rows.append((name, "", share(partial(streamed, EncoderStream, form))))
    print(markdown_table(("feature, 100 rows a second", "whole recording", "in pieces of 20 ms"), rows))


if __name__ == "__main__":
    main()
