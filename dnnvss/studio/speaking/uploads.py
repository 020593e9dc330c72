"""What users bring: sounds and phone times, read in a process of its own that can be ended."""

import subprocess
import sys
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
from dnnvss.staging import scratch
from dnnvss.studio.reading import SOUND, TIMES
from dnnvss.synthesis.request import Recording

SECONDS = 60
"""How long a process may take that reads what somebody brought."""
ALIGNMENTS = (".textgrid", ".lab", ".align")
"""Suffixes of phone times that are tried."""


class Uploads:
    """The last sounds that were brought, by id, each in a file.

    Args:
        folder: of the files.
        most: sounds that are kept.
        bytes_most: that they take on the disk.
    """

    def __init__(self, folder: Path, most: int = 64, bytes_most: float = 5e8) -> None:
        self._folder, self._most, self._bytes_most = files.make_folder(folder), most, bytes_most
        self._sizes, self._lock = OrderedDict[str, int](), threading.Lock()

    def sound(self, data: bytes) -> dict[str, Any]:
        """Keep a sound of any format that can be decoded; return its id and how long it is.

        Raises:
            DnnvssError: it cannot be read, is empty or too long.
        """
        name = token_urlsafe(9)
        with _read_apart(SOUND, data, ".sound") as out:
            recording = read_sound(out)
            out.replace(self._path(name))
        with self._lock:
            self._sizes[name] = self._path(name).stat().st_size
            while len(self._sizes) > self._most or (sum(self._sizes.values()) > self._bytes_most
                                                    and len(self._sizes) > 1):
                self._path(self._sizes.popitem(last=False)[0]).unlink(missing_ok=True)
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

    def path(self, name: str) -> Path:
        """The file of the sound of an id, for :func:`read_sound`.

        Raises:
            DnnvssError: it is not there any more.
        """
        with self._lock:
            if name not in self._sizes:
                raise DnnvssError("this sound is not kept any more", remedy="Record or drop it again")
            self._sizes.move_to_end(name)
            return self._path(name)

    def _path(self, name: str) -> Path:
        return self._folder / f"{name}.npz"


def read_sound(path: Path) -> Recording:
    """The sound in a file that :class:`Uploads` keeps."""
    arrays = read_arrays(path, "Record it again")
    check_arrays(arrays, {"full": Held(("n",)), "speech": Held(("m",))}, path, "Record it again")
    return Recording(arrays["full"], SOUND_RATE, arrays["speech"])


@contextmanager
def _read_apart(kind: str, data: bytes, suffix: str) -> Iterator[Path]:
    """A file with what another process made of the data, for the block.

    Raises:
        DnnvssError: what was wrong with the data in that process's words, or that it had to be ended.
    """
    with scratch() as folder:
        given, out = folder / f"given{suffix}", folder / ("read.npz" if kind == SOUND else "read.json")
        given.write_bytes(data)
        command = [sys.executable, "-m", "dnnvss.studio.reading", kind, str(given), str(out)]
        try:
            done = subprocess.run(command, capture_output=True, timeout=SECONDS, check=False, text=True,
                                  stdin=subprocess.DEVNULL)
        except subprocess.TimeoutExpired:
            raise DnnvssError(f"it could not be read within {SECONDS} s", remedy="Give a shorter one") from None
        if done.returncode == -9:
            raise DnnvssError("the system ended the process that read it", remedy="Send it again in a moment")
        if done.returncode or not out.is_file():
            said = done.stderr.strip().splitlines()[-1:] if done.returncode == 1 else []
            raise DnnvssError((said or ["it cannot be read"])[0].replace(str(given), "what was sent"),
                              remedy="Give a WAV, or phone times as TextGrid")
        yield out
