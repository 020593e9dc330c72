"""The takes that the service knows: what was asked for, and which worker keeps what came of it."""

import json
import threading
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from shutil import rmtree
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.studio.speaking.saying import Saying


@dataclass
class Known:
    """A take.

    Args:
        saying: what was asked for; the same gives the same again.
        worker: that keeps what came of it, if it is still there.
        size: bytes of the saying.
        files: bytes of the files that were made of it.
    """

    saying: Saying
    worker: int
    size: int
    files: int = 0

    @property
    def told(self) -> Mapping[str, Any]:
        """The saying in plain containers."""
        return asdict(self.saying)


class KnownTakes:
    """The last takes, by id; of older ones nothing is left.

    Args:
        folder: the files of each lie in it, in a folder named by its id.
        most: takes that are known.
        bytes_most: that their sayings hold.
        files_most: bytes of their files; those of takes that were not asked for the longest go first.
    """

    def __init__(
        self,
        folder: Path,
        most: int = 2000,
        bytes_most: int = 50_000_000,
        files_most: int = 1_000_000_000,
    ) -> None:
        self._folder, self._most, self._bytes_most, self._files_most = (
            folder,
            most,
            bytes_most,
            files_most,
        )
        self._takes, self._lock = OrderedDict[str, Known](), threading.Lock()

    def __len__(self) -> int:
        return len(self._takes)

    def put(self, name: str, saying: Saying, worker: int) -> None:
        """Know a take."""
        known = Known(saying, worker, len(json.dumps(asdict(saying))))
        with self._lock:
            self._takes[name] = known
            while len(self._takes) > self._most or (
                sum(k.size for k in self._takes.values()) > self._bytes_most
                and len(self._takes) > 1
            ):
                old, _ = self._takes.popitem(last=False)
                rmtree(self._folder / old, ignore_errors=True)

    def get(self, name: str) -> Known:
        """The take of an id.

        Raises:
            DnnvssError: it is not there any more.
        """
        with self._lock:
            if name not in self._takes:
                raise DnnvssError("this take is not kept any more", remedy="Say it again")
            self._takes.move_to_end(name)
            return self._takes[name]

    def file(self, name: str, file: str) -> Path:
        """The path of a file of a take that was written just now; files of others make room for it."""
        folder = self._folder / name
        with self._lock:
            if name in self._takes:
                self._takes[name].files = sum(path.stat().st_size for path in folder.iterdir())
            whole = sum(known.files for known in self._takes.values())
            for other, known in self._takes.items():
                if whole > self._files_most and other != name and known.files:
                    rmtree(self._folder / other, ignore_errors=True)
                    whole, known.files = whole - known.files, 0
        return folder / file
