"""What was said: a take keeps a result, and gives its pictures, its sound and its files."""

import io
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import scipy.io.wavfile

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.export.curves import write_curves
from dnnvss.export.take import write_take
from dnnvss.studio.speaking.command import command_line, export_lines, found_times, measured_names, rig_files
from dnnvss.studio.speaking.saying import Saying
from dnnvss.style import write_keys
from dnnvss.synthesis.outputs import write_spoken
from dnnvss.synthesis.rig import RigRequest, spoken_take
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
    id: str

    @property
    def frames(self) -> int:
        """Pictures in all."""
        return len(self.spoken.shown)

    @cached_property
    def size(self) -> int:
        """About how many bytes it holds."""
        spoken, heard = self.spoken, self.spoken.plan.sound
        arrays = [spoken.movement, spoken.shown, *spoken.example.codes.arrays.values()]
        arrays += [heard.samples, heard.heard.samples] if heard is not None else []
        return sum(int(getattr(array, "nbytes", 0)) for array in arrays)

    @property
    def sound(self) -> bytes | None:
        """The sound as 16-bit WAV; None where nothing is heard."""
        heard = self.spoken.plan.sound
        if heard is None:
            return None
        file = io.BytesIO()
        scipy.io.wavfile.write(file, heard.rate, np.round(np.clip(heard.samples, -1, 1) * 32767).astype(np.int16))
        return file.getvalue()

    def sound_or_error(self) -> bytes:
        """The sound.

        Raises:
            DnnvssError: nothing is heard.
        """
        if (sound := self.sound) is None:
            raise DnnvssError("nothing is heard in this take", remedy="Say it with an engine or a recording")
        return sound

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
                "pronunciation": [dict(row) for row in plan.pronunciation] or _spoken_as(tiers), "engine": plan.engine,
                "peaks": self._peaks(), "files": sorted(self.makers), "command": command_line(self.saying, self.spoken),
                "commands": export_lines(self.saying, self.spoken, self.makers)}

    def _peaks(self) -> list[float]:
        heard = self.spoken.plan.sound
        return [] if heard is None else peaks(heard.samples, heard.rate)

    @property
    def makers(self) -> dict[str, Callable[[Path], Any]]:
        """The files that can be taken away, by name, and what writes each."""
        made: dict[str, Callable[[Path], Any]] = {
            "speech.mp4": lambda path: write_spoken(self.spoken, path),
            "curves.csv": lambda path: write_curves(path, self.spoken.curves(), self.spoken.stage.clock),
            "measured_keys.csv": lambda path: write_keys(path, self.spoken.keys(measured_names(self.spoken), (0.5,))),
            "session.json": self._session,
            "all.zip": self._zipped,
        }
        if keys := self.spoken.request.keys:
            made["keys.csv"] = lambda path: write_keys(path, keys)
        if words := self.saying.pronunciations:
            lines = [f"{word} {phones}" for word, phones in words.items()]
            made["words.txt"] = lambda path: files.write_text(path, "\n".join([*lines, ""]))
        made |= {name: partial(self._rig, curves) for name, curves in rig_files(self.spoken.run).items()}
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
        saying = self.saying
        if found_times(saying, self.spoken):
            saying = replace(saying, alignment=self.spoken.plan.alignment.to_json())
        files.write_json(path, {"saying": asdict(saying), "command": command_line(self.saying, self.spoken),
                                "commands": export_lines(self.saying, self.spoken, self.makers)})

    def _rig(self, curves: str, path: Path) -> None:
        write_take(path, spoken_take(self.spoken, RigRequest(curves)).take)

    def _zipped(self, path: Path) -> None:
        with files.replacing(path) as temporary, zipfile.ZipFile(temporary, "w") as archive:
            for name in sorted(set(self.makers) - {path.name}):
                archive.write(self.file(name, path.parent), name)


def peaks(samples: np.ndarray, rate: int) -> list[float]:
    """The loudest sample of every hundredth of a second, however many samples that is (220.5 at 22050 a second)."""
    if not len(samples):
        return []
    step = max(1.0, rate / _PEAKS)
    starts = (np.arange(-(-len(samples) // step)) * step).astype(int)
    return np.round(np.maximum.reduceat(np.abs(samples), starts).astype(float), 3).tolist()


def _spoken_as(tiers: Mapping[str, Sequence[Sequence[Any]]]) -> list[dict[str, str]]:
    """The phones of each word as phone times that were given have them, in the rows of a pronunciation report."""
    rows = []
    for start, end, word in tiers.get("words", ()):
        if word:
            phones = [label for first, last, label in tiers.get("phones", ()) if start <= (first + last) / 2 < end]
            rows.append({"spoken": word, "phones": " ".join(phones), "source": "times"})
    return rows


def _unit(spoken: Spoken, name: str) -> str:
    gauges = spoken.run.face.gauges
    return gauges[name].unit if name in gauges else ""
