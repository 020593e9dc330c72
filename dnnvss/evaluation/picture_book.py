"""A picture book of dynamic visemes: a strip of each unit's mean gesture, and all of a page moving at once."""

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.base import Face
from dnnvss.media import write_video
from dnnvss.media.pictures import write_picture
from dnnvss.render.pictures import still
from dnnvss.runs.run import Run
from dnnvss.visemes import REST, Visemes

_RATE, _SLOWER, _TIMES, _PAUSE = 25, 2.0, 3, 0.2
_ACROSS, _DOWN = 8, 5  # units on a page of the video
_WIDTH = 112  # pixels of a face in the video


def gesture(visemes: Visemes, unit: int, count: int) -> np.ndarray:
    """Return the mean gesture of a unit at ``count`` evenly spaced times from its first sample to its last, (n, D)."""
    mean = visemes.means[unit]
    at = np.linspace(0, len(mean) - 1, count)
    return np.stack([np.interp(at, np.arange(len(mean)), column) for column in mean.T], axis=1)


def draw_units(path: Path, visemes: Visemes, face: Face, pictures: int = 4, across: int = 6) -> Path:
    """Write an image with a strip of each unit, the most frequent first after rest, and return the path.

    A strip's caption is the unit's number, how many training gestures it has, and their mean duration.
    """
    strips = [_strip(visemes, unit, face, pictures) for unit in range(len(visemes))]
    strips += [np.full_like(strips[0], 255)] * (-len(strips) % across)
    rows = [np.concatenate(strips[i : i + across], axis=1) for i in range(0, len(strips), across)]
    write_picture(path, np.concatenate(rows))
    return path


def _strip(visemes: Visemes, unit: int, face: Face, pictures: int) -> np.ndarray:
    row = np.concatenate([_small(still(face, p)) for p in gesture(visemes, unit, pictures)], axis=1)
    name = "rest" if unit == REST else str(unit)
    caption = f"{name}: {visemes.counts[unit]} x {1000 * visemes.seconds[unit]:.0f} ms"
    bordered = cv2.copyMakeBorder(row, 18, 4, 4, 8, cv2.BORDER_CONSTANT, value=(255, 255, 255))
    return _written(bordered, caption)


def page_frames(visemes: Visemes, units: list[int], face: Face) -> Iterator[np.ndarray]:
    """Yield the pictures of one page: every unit's mean gesture at half speed, repeated."""
    counts = {u: max(2, round(_SLOWER * _RATE * float(visemes.seconds[u]))) for u in units}
    drawn = {u: [_written(_small(still(face, p)), str(u)) for p in gesture(visemes, u, counts[u])] for u in units}
    blank = np.full_like(drawn[units[0]][0], 255)
    pause, longest = round(_PAUSE * _RATE), max(counts.values())
    for _ in range(_TIMES):
        for t in range(longest + pause):
            cells = [drawn[u][min(t, counts[u] - 1)] for u in units]
            cells += [blank] * (_ACROSS * _DOWN - len(cells))
            rows = [np.concatenate(cells[r * _ACROSS : (r + 1) * _ACROSS], axis=1) for r in range(_DOWN)]
            yield np.concatenate(rows)


def _small(picture: np.ndarray) -> np.ndarray:
    height = round(picture.shape[0] * _WIDTH / picture.shape[1])
    return cv2.resize(picture, (_WIDTH, height), interpolation=cv2.INTER_AREA)


def _written(picture: np.ndarray, text: str) -> np.ndarray:
    return cv2.putText(picture, text, (4, 13), cv2.FONT_HERSHEY_SIMPLEX, 0.42, (0, 0, 0), 1, cv2.LINE_AA)


def draw_book(run: Run, out: Path) -> list[Path]:
    """Write image and video of a run's units into a folder and return their paths.

    Raises:
        DnnvssError: the labels of the run have no dynamic visemes.
    """
    if run.units is None:
        raise DnnvssError("has no dynamic visemes", file=run.folder, remedy="Train one with labels=ph_dv")
    visemes, face = run.units.visemes, run.face
    page = _ACROSS * _DOWN
    pages = [list(range(first, min(first + page, len(visemes)))) for first in range(0, len(visemes), page)]
    frames = (picture for units in pages for picture in page_frames(visemes, units, face))
    return [draw_units(out / "units.png", visemes, face), write_video(out / "units.mp4", frames, _RATE)]
