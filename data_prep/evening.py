"""Recordings brought to one size and one clock: what already is so is copied, all else is written anew."""

import shutil
from collections.abc import Iterable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from data_prep.media import CLIPPED, heard_in, laid
from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.media import SOUND_RATE, timed_audio, video_frames, write_video
from dnnvss.timing.rates import even_frames

QUALITY = 12
"""Constant rate factor of x264 of what is written anew: hardly a loss."""

AMISS = 0.5
"""Seconds by which sound may end before or after the pictures until that is noted."""

Place = tuple[float, float, float, float]
"""Scale across and down, and shift across and down, from pixels of a recording to those of the corpus."""


def square_size(size: tuple[int, int], pixel: Fraction) -> tuple[int, int]:
    """Width and height of a picture when its pixels are made square: the height stays."""
    width, height = size
    return (width, height) if pixel == 1 else (2 * max(1, round(width * pixel / 2)), height)


def placed(size: tuple[int, int], pixel: Fraction, target: tuple[int, int]) -> Place:
    """Where a picture stands in the corpus's: as large as fits, in the middle, its face neither wide nor narrow.

    Args:
        size: width and height in pixels.
        pixel: width of one over its height.
        target: width and height of the corpus's pictures, whose pixels are square.
    """
    wide = size[0] * float(pixel)
    scale = min(target[0] / wide, target[1] / size[1])
    if target == square_size(size, pixel):
        return target[0] / size[0], 1.0, 0.0, 0.0
    width, height = round(wide * scale), round(size[1] * scale)
    return width / size[0], height / size[1], (target[0] - width) // 2, (target[1] - height) // 2


def moved(points: np.ndarray, place: Place) -> np.ndarray:
    """Points (..., 2) of a recording in pixels of the corpus; whole numbers are the middles of pixels."""
    across, down, left, top = place
    scale = np.array([across, down], points.dtype)
    return (points + np.float32(0.5)) * scale - np.float32(0.5) + np.array([left, top], points.dtype)


def evened(name: str, out: Path, video: Path, size: tuple[int, int], pixel: str, plain: bool, target: tuple[int, int],
           rate: str, starts: float, sound: Path | None = None) -> dict[str, Any]:
    """Path, frames and place of a recording in ``out/video``, at the corpus's size and rate.

    Which frame of the recording is shown when is kept in ``out/.stages/video/<id>.npz``.

    Args:
        name: the utterance id.
        out: the prepared corpus.
        video: the recording.
        size, pixel, plain, starts: what :func:`data_prep.media.media` found.
        target: width and height of the corpus's pictures.
        rate: frames a second of the corpus.
        sound: a file beside a video that has no sound.
    """
    times = read_arrays(out / ".stages" / "media" / f"{name}.npz", "Delete .stages and prepare again")["times"]
    index, taken = even_frames(times, Fraction(rate))
    (width, height), (wide, high) = size, target  # lists, where they come from JSON
    place = placed((width, height), Fraction(pixel), (wide, high))
    untouched = len(index) == len(times) and bool((index == np.arange(len(times))).all())
    if plain and untouched and tuple(size) == tuple(target):
        path = out / "video" / f"{name}{video.suffix.lower()}"
        with files.replacing(path) as temporary:
            shutil.copyfile(video, temporary)
    else:
        path = out / "video" / f"{name}.mp4"
        samples = laid(timed_audio(heard_in(video, sound), SOUND_RATE)[0], -starts,
                       round(len(index) / Fraction(rate) * SOUND_RATE), SOUND_RATE)
        write_video(path, _shown(video_frames(video), index, place, (wide, high)), rate, samples, SOUND_RATE, QUALITY)
    files.write_arrays(out / ".stages" / "video" / f"{name}.npz", index=index, taken=taken)
    return {"video": str(path.relative_to(out)), "frames": len(index), "rate": rate, "size": list(target),
            "place": list(place), "untouched": untouched, "gaps": int((~taken).sum())}


def _shown(frames: Iterable[np.ndarray], index: np.ndarray, place: Place, target: tuple[int, int]
           ) -> Iterator[np.ndarray]:
    """The frames of ``index`` (N,), which never falls, one after the other in the corpus's size."""
    often = np.bincount(index)
    for image, count in zip(frames, often, strict=False):
        if count:
            picture = _fitted(image, place, target)
            yield from (picture for _ in range(count))


def _fitted(image: np.ndarray, place: Place, target: tuple[int, int]) -> np.ndarray:
    """A picture (H, W_, 3) at its place in one of the corpus's size, black around it."""
    height, width = image.shape[:2]
    size = round(width * place[0]), round(height * place[1])
    smaller = size[0] * size[1] < width * height
    small = image if size == (width, height) else cv2.resize(
        image, size, interpolation=cv2.INTER_AREA if smaller else cv2.INTER_CUBIC)
    left, top = int(place[2]), int(place[3])
    if size == target:
        return small
    picture = np.zeros((target[1], target[0], 3), np.uint8)
    picture[top:top + size[1], left:left + size[0]] = small
    return picture


def told(known: dict[str, Any], seen: dict[str, Any]) -> list[str]:
    """What is to be said of a recording that was brought to the corpus's size and clock.

    Args:
        known: what :func:`data_prep.media.media` found of it.
        seen: what :func:`evened` made of it.
    """
    notes = []
    if tuple(known["size"]) != tuple(seen["size"]):
        shape = "" if known["pixel"] == "1" else f" with pixels of {known['pixel'].replace('/', ':')}"
        notes.append("brought from {} x {}{} to {} x {} pixels".format(*known["size"], shape, *seen["size"]))
    if known.get("spare"):
        notes.append(f"it has a sound of its own: {known['spare']} is not used")
    if known.get("tracks", 1) > 1:
        notes.append(f"has {known['tracks']} tracks of sound: the first one that is not silent is heard")
    if known.get("clipped", 0) > CLIPPED:
        notes.append(f"its sound is clipped: {known['clipped']:.0%} of it is at full scale")
    if known.get("lacks", 0) > AMISS:
        notes.append(f"breaks off: of the {known['lasts'] + known['lacks']:.1f} s that it says it lasts, "
                     f"{known['lasts']:.1f} s are there")
    if known["ends"] > AMISS:
        notes.append(f"its sound goes on for {known['ends']:.1f} s after its last picture (left out)")
    if known["ends"] < -AMISS:
        notes.append(f"its sound ends {-known['ends']:.1f} s before its last picture (silence)")
    if not seen["untouched"]:
        notes.append(f"brought to a constant {float(Fraction(seen['rate'])):.6g} frames a second from "
                     f"{float(Fraction(known['rate'])):.6g} by its time stamps ({known['frames']} frames are "
                     f"{seen['frames']})")
    return notes
