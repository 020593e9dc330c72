"""The curves and pictures of a fit while it goes on, out of what it writes for TensorBoard; needs no torch."""

import struct
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from google.protobuf.message import DecodeError
from tensorboard.compat.proto.event_pb2 import Event

from dnnvss.errors import DnnvssError

LARGEST = 20_000_000
"""Bytes of an event; a longer one ends the reading of its file."""
POINTS = 5000
"""Points of a curve that are kept: the last ones."""
TAGS = 20
"""Curves of a fit that are kept: the first ones."""
PICTURES = 200
"""Pictures that are known: the last ones."""
_HEAD, _TAIL = 12, 4


@dataclass
class EventFile:
    """One file of events, read as far as it has been written whole.

    Args:
        path: of the file.
    """

    path: Path
    read: int = 0
    damaged: bool = False
    scalars: dict[str, dict[int, float]] = field(default_factory=dict)
    pictures: dict[int, tuple[int, int]] = field(default_factory=dict)
    last: float = 0.0

    def refresh(self) -> None:
        """Read what has been written since."""
        with self.path.open("rb") as file:
            for at, event in self._events(file):
                self.last = max(self.last, event.wall_time)
                for value in event.summary.value:
                    kind = value.WhichOneof("value")
                    if kind == "simple_value" and (value.tag in self.scalars or len(self.scalars) < TAGS):
                        _last(self.scalars.setdefault(value.tag, {}), event.step, value.simple_value, POINTS)
                    elif kind == "image":
                        _last(self.pictures, event.step, at, PICTURES)

    def picture(self, step: int) -> bytes:
        """The picture of a step as PNG.

        Raises:
            DnnvssError: there is none.
        """
        if step not in self.pictures:
            raise DnnvssError("there is no such picture", remedy="Load the page again")
        start, length = self.pictures[step]
        with self.path.open("rb") as file:
            file.seek(start)
            event = Event.FromString(file.read(length))
        return next(bytes(v.image.encoded_image_string) for v in event.summary.value if v.HasField("image"))

    def _events(self, file: Any) -> Iterator[tuple[tuple[int, int], Any]]:
        """Events from where the reading stopped, each with its place: length, sum of that, event, sum of that."""
        file.seek(self.read)
        while not self.damaged and len(head := file.read(_HEAD)) == _HEAD:
            length = struct.unpack("<Q", head[:8])[0]
            if length > LARGEST:
                self.damaged = True
                return
            data = file.read(length + _TAIL)
            if len(data) < length + _TAIL:
                return
            try:
                event = Event.FromString(data[:length])
            except DecodeError:
                self.damaged = True
                return
            place = self.read + _HEAD, length
            self.read += _HEAD + length + _TAIL
            yield place, event


def _last(held: dict[int, Any], step: int, value: Any, most: int) -> None:
    """Keep a value under its step, and of all values the last ones."""
    held[step] = value
    while len(held) > most:
        del held[next(iter(held))]


class FitCurves:
    """The events of all fits of a run.

    Args:
        folder: of the run.
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self._files, self._lock = folder, dict[Path, EventFile](), threading.Lock()

    def fits(self) -> list[dict[str, Any]]:
        """Each fit: its name, its curves as [epoch, value] by tag, the epochs of its pictures, when it wrote last."""
        with self._lock:
            self._refresh()
            return [self._fit(place) for place in sorted({path.parent for path in self._files})]

    def picture(self, fit: str, step: int) -> bytes:
        """The picture of a step of a fit, as PNG.

        Raises:
            DnnvssError: there is none.
        """
        with self._lock:
            for path, events in self._files.items():
                if self._title(path.parent) == fit and step in events.pictures:
                    return events.picture(step)
        raise DnnvssError("there is no such picture", remedy="Load the page again")

    def _refresh(self) -> None:
        """Read on; what was trained anew is read anew."""
        there = [path for pattern in ("", "*/", "*/*/")
                 for path in sorted(self.folder.glob(f"{pattern}tensorboard/events.out.tfevents.*"))
                 if path.resolve().is_relative_to(self.folder.resolve()) and path.is_file()]
        self._files = {path: self._files.get(path) or EventFile(path) for path in there}
        for events in self._files.values():
            events.refresh()

    def _title(self, place: Path) -> str:
        return place.parent.relative_to(self.folder).as_posix().strip(".") or "fit"

    def _fit(self, place: Path) -> dict[str, Any]:
        own = [events for path, events in sorted(self._files.items()) if path.parent == place]
        scalars: dict[str, dict[int, float]] = {}
        for events in own:
            for tag, values in events.scalars.items():
                scalars.setdefault(tag, {}).update(values)
        epochs = scalars.pop("epoch", {})
        curves = {tag: [[epochs.get(step, step), value] for step, value in sorted(values.items())
                        if value - value == 0] for tag, values in sorted(scalars.items())}
        pictures = sorted({step for events in own for step in events.pictures})
        return {"name": self._title(place), "curves": curves, "pictures": pictures,
                "last": max(events.last for events in own), "damaged": any(events.damaged for events in own)}
