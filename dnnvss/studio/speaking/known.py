"""The takes that the service knows: what was asked for, and which worker keeps what came of it."""

import json
import threading
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from shutil import rmtree
from typing import Any

from dnnvss.errors import DnnvssError
from dnnvss.studio.speaking.latest import Latest
from dnnvss.studio.speaking.saying import Saying


@dataclass
class Known:
    """A take.

    Args:
        saying: what was asked for; the same gives the same again.
        worker: that keeps what came of it, if it is still there.
        files: bytes of the files that were made of it.
    """

    saying: Saying
    worker: int
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
        self._folder, self._files_most = folder, files_most
        self._takes, self._files = Latest[Known](most, bytes_most), threading.Lock()

    def __len__(self) -> int:
        return len(self._takes)

    def put(self, name: str, saying: Saying, worker: int) -> None:
        """Know a take."""
        for old in self._takes.put(name, Known(saying, worker), len(json.dumps(asdict(saying)))):
            rmtree(self._folder / old, ignore_errors=True)

    def get(self, name: str) -> Known:
        """The take of an id.

        Raises:
            DnnvssError: it is not there any more.
        """
        if (known := self._takes.get(name)) is None:
            raise DnnvssError("this take is not kept any more", remedy="Say it again")
        return known

    def file(self, name: str, file: str) -> Path:
        """The path of a file of a take that was written just now; files of others make room for it."""
        folder, takes = self._folder / name, self._takes.items()
        with self._files:
            for own, known in takes:
                if own == name:
                    known.files = sum(path.stat().st_size for path in folder.iterdir())
            whole = sum(known.files for _, known in takes)
            for other, known in takes:
                if whole > self._files_most and other != name and known.files:
                    rmtree(self._folder / other, ignore_errors=True)
                    whole, known.files = whole - known.files, 0
        return folder / file
