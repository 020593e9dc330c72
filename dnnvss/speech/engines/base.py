"""What an engine gives, and what all of them share: programs in subprocesses and wav files."""

import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.phones import SILENCE, SILENCES
from dnnvss.staging import scratch
from dnnvss.text.sentence import Sentence
from dnnvss.timing import Alignment, FrameClock, Segment, Tier

TIMEOUT = 120
"""Seconds after which a program that speaks is given up."""


@dataclass(frozen=True)
class Speech:
    """Sound and what it says.

    Args:
        samples: (n,) float32 in [-1, 1].
        rate: samples a second.
        alignment: tiers ``phones`` (the 41 labels) and ``words``, over the whole sound.
    """

    samples: np.ndarray
    rate: int
    alignment: Alignment


@runtime_checkable
class Engine(Protocol):
    """A text-to-speech engine with one of its voices.

    Attributes:
        name: what :func:`~dnnvss.speech.engines.find_engine` knows it by.
        voices: those that it may be built with, the best first.
        voice: the one that it speaks with.
    """

    name: str
    voices: tuple[str, ...]
    voice: str

    @property
    def imposes(self) -> bool:
        """Whether the voice can speak durations that are given."""
        ...

    def available(self) -> str | None:
        """None if the engine can speak here with its voice, else why not and what to install; told in milliseconds."""
        ...

    def speak(self, sentence: Sentence, alignment: Alignment | None = None) -> Speech:
        """Return the sentence as sound.

        Args:
            sentence: whose pronunciations the engine is made to follow.
            alignment: times to speak in. An engine that cannot impose them speaks in its own, and gives those.

        Raises:
            DnnvssError: the engine is missing or failed.
        """
        ...


def run(command: Sequence[str], engine: str, text: str = "") -> str:
    """Return what a program prints, given ``text`` on its standard input.

    Raises:
        DnnvssError: it is missing, fails, or takes longer than :data:`TIMEOUT` seconds.
    """
    try:
        done = subprocess.run(command, input=text, capture_output=True, text=True, encoding="utf-8",
                              errors="replace", timeout=TIMEOUT,
                              check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise DnnvssError(f"the speech engine {engine} did not run: {error}",
                          remedy="Choose another engine, e.g. speech.engine=formant") from error
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines()[-1:] or ["no message"]
        raise DnnvssError(f"the speech engine {engine} failed with status {done.returncode}: {said[0]}",
                          remedy="Choose another engine, e.g. speech.engine=formant")
    return done.stdout


@contextmanager
def workshop() -> Iterator[Path]:
    """Yield a temporary folder that is gone afterwards."""
    with scratch() as folder:
        yield folder


def read_wav(path: Path, engine: str) -> tuple[np.ndarray, int]:
    """Return the samples (n,) float32 in [-1, 1] and rate of a 16-bit wav that an engine wrote.

    Raises:
        DnnvssError: it wrote none, or an empty one.
    """
    from scipy.io import wavfile  # slow to import, and needed by programs that speak alone

    rate, samples = files.read(path, wavfile.read, f"The engine {engine} wrote no sound; choose another one")
    if samples.dtype != np.int16 or not samples.size:
        raise DnnvssError(f"the speech engine {engine} wrote {samples.size} samples of {samples.dtype}",
                          remedy="Choose another engine, e.g. speech.engine=formant")
    return samples.reshape(len(samples), -1)[:, 0].astype(np.float32) / 32768, int(rate)


def fitted(samples: np.ndarray, rate: int, alignment: Alignment) -> np.ndarray:
    """Return the samples cut or filled with silence to the length of the alignment."""
    edges = FrameClock(rate).edges(np.array([alignment.start, alignment.end]))
    count = int(edges[1] - edges[0])
    return np.pad(samples[:count], (0, max(count - len(samples), 0))).astype(np.float32)


def with_silences(speech: Speech, lead_in: float, lead_out: float) -> Speech:
    """Return the speech with these seconds of silence before its first phone and after its last one."""
    phones, words = speech.alignment["phones"], speech.alignment["words"]
    spoken = [s for s in phones if s.label not in SILENCES]
    start, end = spoken[0].start, spoken[-1].end
    whole = lead_in + end - start + lead_out

    def framed(tier: Tier, pause: str, inside: list[Segment]) -> Tier:
        rows = [(0.0, lead_in, pause)] if lead_in > 0 else []
        rows += [(lead_in + s.start - start, lead_in + s.end - start, s.label) for s in inside]
        return Tier(tier.name, [*rows, (lead_in + end - start, whole, pause)] if lead_out > 0 else rows)

    kept = [[s for s in tier if start - 1e-6 <= s.start and s.end <= end + 1e-6] for tier in (phones, words)]
    alignment = Alignment([framed(phones, SILENCE, kept[0]), framed(words, "", kept[1])])
    first, last = (round(t * speech.rate) for t in (start, end))
    before, after = round(lead_in * speech.rate), round(lead_out * speech.rate)
    samples = np.concatenate([np.zeros(max(before - first, 0)), speech.samples[max(first - before, 0) : last + after],
                              np.zeros(max(last + after - len(speech.samples), 0))])
    return Speech(fitted(samples.astype(np.float32), speech.rate, alignment), speech.rate, alignment)
