"""The program that reads what somebody brought: a process of its own, which may be ended and needs no torch.

    python -m dnnvss.studio.reading sound|times GIVEN OUT
"""

import resource
import sys
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.formats import read_alignment
from dnnvss.media import SOUND_RATE, SPEECH_RATE, opened, read_audio

SOUND, TIMES = "sound", "times"
"""What is brought."""
MEMORY = 2_000_000_000
"""Bytes that the process may use."""
LONGEST = 600.0
"""Seconds of a sound."""
_REMEDY = "Give a WAV"


def _check_length(given: Path) -> None:
    """Refuse what opens to too much, before so much of it is held: hours of silence take a few kilobytes."""
    with opened(given) as container:
        seconds, tracks = 0.0, container.streams.audio
        for frame in container.decode(*tracks) if tracks else ():
            seconds += frame.samples / max(frame.sample_rate, 1)
            if seconds > LONGEST * len(tracks):
                raise _too_long(f"more than {seconds:.0f} s")


def _too_long(how: str) -> DnnvssError:
    return DnnvssError(f"it lasts {how}, and {LONGEST:g} s are taken", remedy="Use dnnvss speak wav= for long ones")


def _read(kind: str, given: Path, out: Path) -> None:
    """Read what was given and write what it holds."""
    if kind == TIMES:
        files.write_json(out, read_alignment(given).to_json())
        return
    files.read(given, _check_length, _REMEDY)
    full = read_audio(given, SOUND_RATE)
    if not len(full):
        raise DnnvssError("it holds no sound")
    if len(full) > LONGEST * SOUND_RATE:
        raise _too_long(f"{len(full) / SOUND_RATE:.0f} s")
    files.write_arrays(out, full=full.astype(np.float32), speech=read_audio(given, SPEECH_RATE).astype(np.float32))


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    try:
        _read(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]))
    except DnnvssError as error:
        print(error.problem, file=sys.stderr)
        sys.exit(1)
