"""Landmarks of a recording: read, counted, and written without ghosts."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from data_prep.evening import Place, moved
from data_prep.stages import FOLDER, Workshop
from dnnvss.archives import read_arrays
from dnnvss.corpus import checkup
from dnnvss.errors import DnnvssError
from dnnvss.formats import Landmarks, read_landmarks, read_npz, read_pts_sequence, write_npz
from dnnvss.timing import fill_invalid


def read_raw(name: str, out: Path, landmarks: tuple[Path, ...], scale: float, frames: int,
             size: tuple[int, int], dimensions: int = 2, shown: Path | None = None,
             place: Place = (1.0, 1.0, 0.0, 0.0), rows: tuple[int, ...] | None = None) -> dict[str, Any]:
    """The counts of a recording's landmarks, after writing them to ``out/.stages/landmarks/<id>.npz``.

    They are brought to the corpus's clock and size as the pictures are.

    Args:
        name: the utterance id.
        out: the prepared corpus.
        landmarks: one file, one folder of ``.pts``, or the ``.pts`` files.
        scale: what stored coordinates are divided by to give pixels (millimetres).
        frames: the number of pictures.
        size: width and height of the recording in pixels; zeros where they are not known.
        dimensions: coordinates of a point.
        shown: which frame of the recording is shown when (:func:`data_prep.evening.evened`); None where all are.
        place: where its pictures stand in those of the corpus.
        rows: the points of a frame that are kept, in their new order; all of them where None.

    Raises:
        DnnvssError: landmarks that cannot be read, of another number of frames, without a valid frame, NaN where
            they are marked as valid, or in most frames outside the picture.
    """
    read = read_all(landmarks, scale, dimensions, frames)
    found, given = _lengthened(read, frames), len(read.points)
    file = landmarks[0] if len(landmarks) == 1 else landmarks[0].parent
    count = len(found.points)
    if count != frames:
        raise DnnvssError(f"holds landmarks of {count} frames, the video has {frames}", file=file, utterance=name,
                          remedy="Track this very video, one row a frame")
    found, shares = in_pixels(found, size) if dimensions == 2 else (found, False)
    if rows is not None and max(rows) < found.points.shape[1]:
        found = replace(found, points=found.points[:, list(rows)])
    wrong = found.valid & ~np.isfinite(found.points).all(axis=(1, 2))
    if wrong.any():
        raise DnnvssError(f"landmarks of frame {np.flatnonzero(wrong)[0]} are NaN or infinite, though marked valid",
                          file=file, utterance=name, remedy="Mark frames without landmarks as not valid")
    flat = ((np.ptp(found.points, axis=1) == 0).all(axis=1) if found.points.shape[1] > 1 and dimensions > 1
            else np.zeros(count, bool))
    found = replace(found, valid=found.valid & ~flat)  # what some trackers write where they see no face
    held = checkup.held(found.points) if dimensions > 1 and shown is not None else np.zeros(count, bool)
    found = replace(found, valid=found.valid & ~held)  # others write the last face again
    if not found.valid.any():
        raise DnnvssError("no frame has landmarks", file=file, utterance=name, remedy="Track the video again")
    valid = found.points[found.valid]
    if dimensions == 2 and min(size) > 0 and checkup.outside(valid, size).mean() > 0.5:
        (left, top), (right, bottom) = valid.min(axis=(0, 1)), valid.max(axis=(0, 1))
        raise DnnvssError(f"landmarks reach over x {left:.0f} to {right:.0f} and y {top:.0f} to {bottom:.0f}, the "
                          f"video is {size[0]} x {size[1]} pixels", file=file, utterance=name,
                          remedy="Track this very video, or set scale in landmarks.json (pixels = stored / scale)")
    points, valid = found.points, found.valid
    if shown is not None:
        kept = read_arrays(shown, "Delete .stages and prepare again")
        points, valid = points[kept["index"]], valid[kept["index"]] & kept["taken"]
    if dimensions == 2 and tuple(place) != (1.0, 1.0, 0.0, 0.0):
        points = moved(points, place)
    write_npz(out / ".stages" / "landmarks" / f"{name}.npz", Landmarks(points, valid))
    return {"points": points.shape[1], "lost": int((~valid).sum()), "rows": given, "faces": read.faces,
            **({"shares": True} if shares else {}), **({"held": int(held.sum())} if held.any() else {})}


_SHARE, _LEAST = 2.0, 32
"""Largest coordinate, in widths and heights of a picture, that is taken for a share of it; least size of the picture:
a face within two pixels is none."""


def in_pixels(found: Landmarks, size: tuple[int, int]) -> tuple[Landmarks, bool]:
    """Landmarks that are shares of the picture, as some trackers write them, in pixels; and whether they were."""
    known = found.points[found.valid]
    known = known[np.isfinite(known)]
    if min(size) < _LEAST or not len(known) or np.abs(known).max() > _SHARE or np.ptp(known) == 0:
        return found, False
    return replace(found, points=found.points * np.asarray(size, np.float32)), True


_CUT = 2
"""Rows by which landmarks may be shorter or longer than the video: OpenCV does not give trackers the last pictures,
or gives the last one again."""


def _lengthened(found: Landmarks, frames: int) -> Landmarks:
    """Landmarks with frames at their end that are not valid, or without the last ones, where one or two are amiss."""
    lacking = frames - len(found.points)
    if not lacking or abs(lacking) > _CUT or frames <= _CUT:
        return found
    if lacking < 0:
        return Landmarks(found.points[:frames], found.valid[:frames], faces=found.faces)
    points = np.concatenate([found.points, np.full((lacking, *found.points.shape[1:]), np.nan, np.float32)])
    return Landmarks(points, np.concatenate([found.valid, np.zeros(lacking, bool)]), faces=found.faces)


def read_all(landmarks: tuple[Path, ...], scale: float, dimensions: int, frames: int | None = None) -> Landmarks:
    """The landmarks of a recording in pixels (millimetres).

    Args:
        landmarks: one file, one folder of ``.pts``, or the ``.pts`` files.
        scale: what stored coordinates are divided by.
        dimensions: coordinates of a point.
        frames: of the video, where it is known.

    Raises:
        DnnvssError: they cannot be read.
    """
    if len(landmarks) > 1:
        found = read_pts_sequence(landmarks, landmarks[0].parent)
    elif landmarks[0].suffix.lower() == ".npz":
        return read_npz(landmarks[0], scale, dimensions, frames)
    else:
        found = read_landmarks(landmarks[0], dimensions)
    return replace(found, points=found.points / np.float32(scale))


def write_clean(name: str, out: Path, marks: Path, bad: str) -> dict[str, Any]:
    """Return the path of the landmarks written to ``out/landmarks``: pixels, bad frames interpolated and not valid.

    Args:
        name: the utterance id.
        out: the prepared corpus.
        marks: what :func:`read_raw` wrote.
        bad: a character for each frame, ``1`` where it is not to be trusted.
    """
    arrays = read_arrays(marks, "Prepare the corpus again")
    valid = arrays["valid"] & (np.frombuffer(bad.encode(), np.uint8) == ord("0"))
    clean = Landmarks(fill_invalid(arrays["points"], valid), valid)
    path = write_npz(out / "landmarks" / f"{name}.npz", clean)
    return {"landmarks": str(path.relative_to(out)), "valid": "".join("01"[int(v)] for v in valid)}


def slices(shop: Workshop, landmarks: Mapping[str, tuple[Path, ...]],
           clips: Mapping[str, Mapping[str, tuple[int, int]]], dimensions: int) -> dict[str, tuple[Path, ...] | str]:
    """The files of landmarks of clips that were cut out of recordings by clip, or why there are none.

    Args:
        shop: where to work.
        landmarks: of all pictures of each recording.
        clips: the first picture of each clip of a recording, and the one behind its last.
        dimensions: coordinates of a point.
    """
    tasks = {name: {"landmarks": paths, "clips": {n: list(c) for n, c in clips[name].items()},
                    "dimensions": dimensions} for name, paths in landmarks.items()}
    made = shop.run(SLICED, _sliced, tasks) if tasks else {}
    return {n: result.get("dropped") or (shop.out / FOLDER / SLICED / name / f"{n}.npz",)
            for name, result in made.items() for n in clips[name]}


SLICED = "sliced landmarks"


def _sliced(name: str, out: Path, landmarks: tuple[Path, ...], clips: dict[str, list[int]],
            dimensions: int) -> dict[str, Any]:
    """Write the landmarks of each clip of a recording, as they are stored."""
    found = read_all(landmarks, 1.0, dimensions)
    last = max((end for _, end in clips.values()), default=0)
    if last > len(found.points) + _CUT:
        raise DnnvssError(f"holds landmarks of {len(found.points)} frames, the video has {last} and more",
                          file=landmarks[0], utterance=name, remedy="Track this very video, one row a frame")
    for clip, (first, end) in clips.items():
        part = Landmarks(found.points[first:end], found.valid[first:end], faces=found.faces)
        write_npz(out / FOLDER / SLICED / name / f"{clip}.npz", _lengthened(part, end - first))
    return {"clips": len(clips)}
