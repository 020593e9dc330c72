"""What was said: a take keeps a result, and gives its pictures, its sound and its files."""

import io
import threading
import zipfile
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path
from secrets import token_urlsafe
from typing import Any

import cv2
import numpy as np
import scipy.io.wavfile

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.export.curves import write_curves
from dnnvss.studio.speaking.command import command_line
from dnnvss.studio.speaking.saying import Saying
from dnnvss.style import write_keys
from dnnvss.synthesis.outputs import write_spoken
from dnnvss.synthesis.speak import Spoken

QUALITY = 88
"""Of the pictures as JPEG."""
MOST_PICTURES = 64
"""Pictures in an answer."""
_PEAKS = 100
"""Points a second of the drawn waveform."""


@dataclass(frozen=True)
class Take:
    """One thing that was said.

    Args:
        saying: what was asked for.
        spoken: what came of it.
        id: under which it is found again; nobody can guess it.
    """

    saying: Saying
    spoken: Spoken
    id: str = field(default_factory=lambda: token_urlsafe(9))

    @property
    def frames(self) -> int:
        """Pictures in all."""
        return len(self.spoken.shown)

    @cached_property
    def sound(self) -> bytes | None:
        """The sound as 16-bit WAV; None where nothing is heard."""
        heard = self.spoken.plan.sound
        if heard is None:
            return None
        file = io.BytesIO()
        scipy.io.wavfile.write(file, heard.rate, np.round(np.clip(heard.samples, -1, 1) * 32767).astype(np.int16))
        return file.getvalue()

    def pictures(self, first: int, count: int, view: str | None = None) -> bytes:
        """Pictures as JPEG one after the other, each behind its length in four bytes, the lowest first.

        Args:
            first: counted from 0.
            count: how many.
            view: what is seen; what was asked for with the take where None.

        Raises:
            DnnvssError: there are no such pictures, or faces of this kind have no such view.
        """
        if not (0 <= first < self.frames and 1 <= count <= MOST_PICTURES):
            raise DnnvssError(f"there are pictures 0 to {self.frames - 1}, at most {MOST_PICTURES} at a time")
        parts = []
        for picture in self.spoken.frames(slice(first, first + count), (view,) if view else None):
            _, data = cv2.imencode(".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR),
                                   [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
            parts += [len(data).to_bytes(4, "little"), data.tobytes()]
        return b"".join(parts)

    def described(self) -> dict[str, Any]:
        """All that a page shows of it beside pictures and sound, in plain containers."""
        spoken, plan = self.spoken, self.spoken.plan
        start = plan.alignment.start
        tiers = {t.name: [[round(s.start - start, 4), round(s.end - start, 4), s.label] for s in t]
                 for t in plan.alignment.tiers}
        width, height = spoken.stage.pictures.size
        gauges = list(spoken.run.face.gauges)
        curves = {name: {"unit": _unit(spoken, name), "values": np.round(track, 4).tolist(), "gauge": name in gauges}
                  for name, track in spoken.curves().items()}
        return {"id": self.id, "run": self.saying.run, "text": plan.text, "frames": self.frames,
                "rate": float(spoken.stage.clock.rate), "seconds": self.frames / float(spoken.stage.clock.rate),
                "width": width, "height": height, "tiers": tiers, "alignment": plan.alignment.to_json(),
                "curves": curves, "risks": [s.to_json() for s in spoken.risks], "remarks": list(spoken.remarks),
                "pronunciation": [dict(row) for row in plan.pronunciation], "engine": plan.engine,
                "peaks": self._peaks(), "files": sorted(self.makers), "command": command_line(self.saying, self.spoken)}

    def _peaks(self) -> list[float]:
        """The loudest sample of every hundredth of a second."""
        heard = self.spoken.plan.sound
        if heard is None or not len(heard.samples):
            return []
        step = max(1, heard.rate // _PEAKS)
        padded = np.pad(np.abs(heard.samples), (0, -len(heard.samples) % step))
        return np.round(padded.reshape(-1, step).max(axis=1).astype(float), 3).tolist()

    @property
    def makers(self) -> dict[str, Callable[[Path], Any]]:
        """The files that can be taken away, by name, and what writes each."""
        names = list(self.spoken.run.face.gauges) or list(self.spoken.run.face.names[:3])
        made: dict[str, Callable[[Path], Any]] = {
            "speech.mp4": lambda path: write_spoken(self.spoken, path),
            "curves.csv": lambda path: write_curves(path, self.spoken.curves(), self.spoken.stage.clock),
            "measured_keys.csv": lambda path: write_keys(path, self.spoken.keys(names, (0.5,))),
            "session.json": self._session,
            "all.zip": self._zipped,
        }
        if keys := self.spoken.request.keys:
            made["keys.csv"] = lambda path: write_keys(path, keys)
        if words := self.saying.pronunciations:
            lines = [f"{word} {phones}" for word, phones in words.items()]
            made["words.txt"] = lambda path: files.write_text(path, "\n".join([*lines, ""]))
        beside = dict.fromkeys(("speech.TextGrid", "speech.npz", "speech.json", "speech.png"), made["speech.mp4"])
        heard = {"speech.wav": made["speech.mp4"]} if self.spoken.plan.sound else {}
        return {**made, **beside, **heard}

    def file(self, name: str, folder: Path) -> Path:
        """A file to take away, written where it is not there yet.

        Args:
            name: one of :attr:`makers`.
            folder: of this take.

        Raises:
            DnnvssError: there is no such file.
        """
        if name not in self.makers:
            raise DnnvssError(f"there is no file {name[:40]!r}", remedy=f"Take one of {', '.join(sorted(self.makers))}")
        path = folder / name
        if not path.is_file():
            folder.mkdir(exist_ok=True)
            self.makers[name](folder / "speech.mp4" if name.startswith("speech.") else path)
        return path

    def _session(self, path: Path) -> None:
        files.write_json(path, {"saying": asdict(self.saying), "command": command_line(self.saying, self.spoken)})

    def _zipped(self, path: Path) -> None:
        with files.replacing(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
            for name in sorted(set(self.makers) - {path.name}):
                archive.write(self.file(name, path.parent), name)


def _unit(spoken: Spoken, name: str) -> str:
    gauges = spoken.run.face.gauges
    return gauges[name].unit if name in gauges else ""


class Shelf:
    """The last takes, by id; older ones are forgotten.

    Args:
        most: takes that are kept.
    """

    def __init__(self, most: int = 300) -> None:
        self._takes: OrderedDict[str, Take] = OrderedDict()
        self._most, self._lock = most, threading.Lock()

    def __len__(self) -> int:
        return len(self._takes)

    def put(self, take: Take) -> list[Take]:
        """Keep a take; return those that are forgotten for it."""
        with self._lock:
            self._takes[take.id] = take
            return [self._takes.popitem(last=False)[1] for _ in range(len(self._takes) - self._most)]

    def get(self, name: str) -> Take:
        """The take of an id.

        Raises:
            DnnvssError: it is not there any more.
        """
        with self._lock:
            if name not in self._takes:
                raise DnnvssError("this take is not kept any more", remedy="Say it again")
            self._takes.move_to_end(name)
            return self._takes[name]
