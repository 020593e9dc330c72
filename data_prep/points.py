"""Landmarks of recordings that bring none: found in their pictures by the nets of the landmarker."""

from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.landmarker import Landmarker, as_arrays, find_task, follow, mesh_groups, talker
from dnnvss.formats import Landmarks, write_npz
from dnnvss.media import SPEECH_RATE, read_audio, video_frames

FOUND = "points"
"""The stage, and the folder of its files."""

VERSION = 1
"""Of what the stage leaves behind."""

SEEN = 0.5
"""Share of the frames that must show the talker's face."""

TURNED = 0.3
"""Distance of the outer corners of the eyes, in heights of the face, below which a face is turned away."""


def find_points(name: str, out: Path, video: Path, sound: Path | None, rate: str, task: Path) -> dict[str, Any]:
    """What is to be said of a recording's landmarks, after writing them to ``out/.stages/points/<id>.npz``.

    Args:
        name: the utterance id.
        out: the prepared corpus.
        video: the recording.
        sound: 16 kHz, from the start of the first picture; None where there is none.
        rate: pictures a second.
        task: the file of the nets.

    Raises:
        DnnvssError: no face, or none for half of the time.
    """
    tracks, frames = follow(_landmarker(task), video_frames(video))
    if not tracks:
        raise DnnvssError("shows no face", file=video, utterance=name,
                          remedy="Give a recording of a face seen from the front, or its landmarks")
    chosen, note = talker(tracks, frames, None if sound is None else loudness(sound, Fraction(rate), frames),
                          float(Fraction(rate)))
    points, valid = as_arrays(tracks[chosen], frames)
    if valid.mean() < SEEN:
        raise DnnvssError(f"its face is seen in {valid.sum()} of {frames} frames", file=video, utterance=name,
                          remedy="Cut the recording to where the face is seen from the front, or give its landmarks")
    write_npz(out / ".stages" / FOUND / f"{name}.npz", Landmarks(points, valid))
    return {"notes": [n for n in (note, _turned(points[valid])) if n]}


def nets(named: str | Path | None) -> tuple[Path | None, DnnvssError | None]:
    """The file of the nets, or why there is none.

    Args:
        named: the file that the user names, None for that of a package.
    """
    try:
        return find_task(named), None
    except DnnvssError as error:
        return None, error


@lru_cache(maxsize=1)
def _landmarker(task: Path) -> Landmarker:
    cv2.setNumThreads(1)  # the stage has a process a core
    return Landmarker(task)


def loudness(sound: Path, rate: Fraction, frames: int) -> np.ndarray:
    """Root mean square of a sound in every frame (F,)."""
    samples = read_audio(sound, SPEECH_RATE)
    edges = [round(k * SPEECH_RATE / rate) for k in range(frames + 1)]
    power = np.concatenate([[0.0], np.cumsum(np.square(samples, dtype=np.float64))])
    at = power[np.minimum(edges, len(samples))]
    return np.sqrt(np.diff(at) / np.maximum(np.diff(edges), 1))


def _turned(points: np.ndarray) -> str:
    """A note where the face is turned away in a tenth of the frames and more; points (F, 146, 2)."""
    groups = mesh_groups()
    right, left = points[:, groups["right_eye"][0]], points[:, groups["left_eye"][0] + 8]
    oval = points[:, slice(*groups["face_oval"])]
    wide = np.linalg.norm(left - right, axis=1)
    tall = np.linalg.norm(oval[:, 18] - oval[:, 0], axis=1)
    narrow = wide < TURNED * tall
    return f"the face is turned away in {narrow.sum()} frames" if narrow.mean() > 0.1 else ""
