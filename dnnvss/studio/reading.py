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
from dnnvss.media import SOUND_RATE, SPEECH_RATE, read_audio

SOUND, TIMES = "sound", "times"
"""What is brought."""
MEMORY = 3_000_000_000
"""Bytes that the process may use."""
LONGEST = 600.0
"""Seconds of a sound."""


def _read(kind: str, given: Path, out: Path) -> None:
    """Read what was given and write what it holds."""
    if kind == TIMES:
        files.write_json(out, read_alignment(given).to_json())
        return
    full = read_audio(given, SOUND_RATE)
    if not len(full):
        raise DnnvssError("it holds no sound")
    if len(full) > LONGEST * SOUND_RATE:
        raise DnnvssError(f"it lasts {len(full) / SOUND_RATE:.0f} s, and {LONGEST:g} are taken",
                          remedy="Use synth.py wav= for long ones")
    files.write_arrays(out, full=full.astype(np.float32), speech=read_audio(given, SPEECH_RATE).astype(np.float32))


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    try:
        _read(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]))
    except DnnvssError as error:
        print(error.problem, file=sys.stderr)
        sys.exit(1)
