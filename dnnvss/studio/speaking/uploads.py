"""What users bring: sounds and phone times, read in a process of its own that can be ended."""

import asyncio
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from secrets import token_urlsafe
from typing import Any

from dnnvss import files
from dnnvss.archives import Held, check_arrays, read_arrays
from dnnvss.errors import DnnvssError
from dnnvss.media import SOUND_RATE
from dnnvss.staging import scratch
from dnnvss.studio.pool import kill
from dnnvss.studio.reading import SOUND, TIMES
from dnnvss.studio.speaking.latest import Latest
from dnnvss.synthesis.request import Recording

SECONDS = 60
"""How long a process may take that reads what somebody brought."""
ALIGNMENTS = (".textgrid", ".lab", ".phn", ".ctm", ".align")
"""Suffixes of phone times that are tried."""


class Uploads:
    """The last sounds that were brought, by id, each in a file.

    Args:
        folder: of the files.
        most: sounds that are kept.
        bytes_most: that they take on the disk.
    """

    def __init__(self, folder: Path, most: int = 64, bytes_most: float = 5e8) -> None:
        self._folder, self._sounds = files.make_folder(folder), Latest[Path](most, bytes_most)

    async def sound(self, data: bytes) -> dict[str, Any]:
        """Keep a sound of any format that can be decoded; return its id and how long it is.

        Raises:
            DnnvssError: it cannot be read, is empty or too long.
        """
        name = token_urlsafe(9)
        async with _read_apart(SOUND, data, ".sound") as out:
            recording = await asyncio.to_thread(read_sound, out)
            path = out.replace(self._path(name))
        for old in self._sounds.put(name, path, path.stat().st_size):
            self._path(old).unlink(missing_ok=True)
        return {"id": name, "seconds": round(len(recording.samples) / recording.rate, 3)}

    async def alignment(self, name: str, data: bytes) -> Any:
        """Phone times out of a file, as :meth:`dnnvss.timing.Alignment.to_json` gives them.

        Raises:
            DnnvssError: another format, or it cannot be read.
        """
        suffix = Path(name).suffix.lower()
        if suffix not in ALIGNMENTS:
            raise DnnvssError(f"phone times in {suffix[:12] or 'a file without suffix'} are not read",
                              remedy=f"Give one of {', '.join(ALIGNMENTS)}")
        async with _read_apart(TIMES, data, suffix) as out:
            return files.read_json(out)

    def path(self, name: str) -> Path:
        """The file of the sound of an id, for :func:`read_sound`.

        Raises:
            DnnvssError: it is not there any more.
        """
        if (path := self._sounds.get(name)) is None:
            raise DnnvssError("this sound is not kept any more", remedy="Record or drop it again")
        return path

    def _path(self, name: str) -> Path:
        return self._folder / f"{name}.npz"


def read_sound(path: Path) -> Recording:
    """The sound in a file that :class:`Uploads` keeps."""
    arrays = read_arrays(path, "Record it again")
    check_arrays(arrays, {"full": Held(("n",)), "speech": Held(("m",))}, path, "Record it again")
    return Recording(arrays["full"], SOUND_RATE, arrays["speech"])


@asynccontextmanager
async def _read_apart(kind: str, data: bytes, suffix: str) -> AsyncIterator[Path]:
    """A file with what another process made of the data, for the block; who leaves ends that process.

    Raises:
        DnnvssError: what was wrong with the data in that process's words, or that it had to be ended.
    """
    with scratch() as folder:
        given, out = folder / f"given{suffix}", folder / ("read.npz" if kind == SOUND else "read.json")
        given.write_bytes(data)
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "dnnvss.studio.reading", kind, str(given), str(out),
            stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.DEVNULL, stderr=asyncio.subprocess.PIPE,
            start_new_session=True)
        try:
            async with asyncio.timeout(SECONDS):
                _, told = await process.communicate()
        except TimeoutError:
            raise DnnvssError(f"it could not be read within {SECONDS} s", remedy="Give a shorter one") from None
        finally:
            kill(process)
            await asyncio.shield(process.wait())
        if process.returncode == -9:
            raise DnnvssError("the system ended the process that read it", remedy="Send it again in a moment")
        if process.returncode or not out.is_file():
            said = told.decode(errors="replace").strip().splitlines()[-1:] if process.returncode == 1 else []
            raise DnnvssError((said or ["it cannot be read"])[0].replace(str(given), "what was sent"),
                              remedy="Give a WAV, or phone times as TextGrid")
        yield out
