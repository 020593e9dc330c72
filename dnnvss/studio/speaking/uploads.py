"""What users bring: sounds and phone times, read in a process of its own that can be ended."""

import subprocess
import sys
import tempfile
import threading
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from secrets import token_urlsafe
from typing import Any

from dnnvss import files
from dnnvss.archives import Held, check_arrays, read_arrays
from dnnvss.errors import DnnvssError
from dnnvss.media import SOUND_RATE
from dnnvss.studio.reading import SOUND, TIMES
from dnnvss.synthesis.request import Recording

SECONDS = 60
"""How long a process may take that reads what somebody brought."""
ALIGNMENTS = (".textgrid", ".lab", ".align")
"""Suffixes of phone times that are tried."""


class Uploads:
    """The last sounds that were brought, by id.

    Args:
        most: sounds that are kept.
    """

    def __init__(self, most: int = 8) -> None:
        self._sounds: OrderedDict[str, Recording] = OrderedDict()
        self._most, self._lock = most, threading.Lock()

    def sound(self, data: bytes) -> dict[str, Any]:
        """Keep a sound of any format that can be decoded; return its id and how long it is.

        Raises:
            DnnvssError: it cannot be read, is empty or too long.
        """
        with _read_apart(SOUND, data, ".sound") as out:
            arrays = read_arrays(out, "Record it again")
            check_arrays(arrays, {"full": Held(("n",)), "speech": Held(("m",))}, out, "Record it again")
            recording = Recording(arrays["full"], SOUND_RATE, arrays["speech"])
        name = token_urlsafe(9)
        with self._lock:
            self._sounds[name] = recording
            while len(self._sounds) > self._most:
                self._sounds.popitem(last=False)
        return {"id": name, "seconds": round(len(recording.samples) / recording.rate, 3)}

    def alignment(self, name: str, data: bytes) -> Any:
        """Phone times out of a file, as :meth:`dnnvss.timing.Alignment.to_json` gives them.

        Raises:
            DnnvssError: another format, or it cannot be read.
        """
        suffix = Path(name).suffix.lower()
        if suffix not in ALIGNMENTS:
            raise DnnvssError(f"phone times in {suffix[:12] or 'a file without suffix'} are not read",
                              remedy=f"Give one of {', '.join(ALIGNMENTS)}")
        with _read_apart(TIMES, data, suffix) as out:
            return files.read_json(out)

    def get(self, name: str) -> Recording:
        """The sound of an id.

        Raises:
            DnnvssError: it is not there any more.
        """
        with self._lock:
            if name not in self._sounds:
                raise DnnvssError("this sound is not kept any more", remedy="Record or drop it again")
            self._sounds.move_to_end(name)
            return self._sounds[name]


@contextmanager
def _read_apart(kind: str, data: bytes, suffix: str) -> Iterator[Path]:
    """A file with what another process made of the data, for the block.

    Raises:
        DnnvssError: what was wrong with the data in that process's words, or that it had to be ended.
    """
    with tempfile.TemporaryDirectory(prefix="dnnvss-upload-") as folder:
        given, out = Path(folder) / f"given{suffix}", Path(folder) / ("read.npz" if kind == SOUND else "read.json")
        given.write_bytes(data)
        command = [sys.executable, "-m", "dnnvss.studio.reading", kind, str(given), str(out)]
        try:
            done = subprocess.run(command, capture_output=True, timeout=SECONDS, check=False, text=True,
                                  stdin=subprocess.DEVNULL)
        except subprocess.TimeoutExpired:
            raise DnnvssError(f"it could not be read within {SECONDS} s", remedy="Give a shorter one") from None
        if done.returncode or not out.is_file():
            said = done.stderr.strip().splitlines()[-1:] if done.returncode == 1 else []
            raise DnnvssError((said or ["it cannot be read"])[0].replace(str(given), "what was sent"),
                              remedy="Give a WAV, or phone times as TextGrid")
        yield out
