"""Landmarks that the nets for everybody find, and that the talker's own search finds from them, beside given ones.

    python benchmarks/landmarks.py RAW [--split val] [--clips 40] [--refine 60] [--own 200] [--learn-from 60]

RAW is a folder as that of GRID (``video/*.mp4``, ``landmarks/*.npz`` with ``landmarks.json`` in the mesh's 146 points,
``splits/train.txt`` and ``val.txt``). Clips of a split are measured: distance of lip points as found, and
after a constant offset of each point; correlation of the aperture; jitter (the third difference over time, as the
standard deviation of white noise that would have it); pictures a second of one core, decoding included. With
``--refine`` so many frames of training clips are chosen, labelled by the nets alone, and learnt as a search model,
which tracks the same clips; with ``--own`` it learns once more from so many of its own frames.
"""

import argparse
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import cv2
import numpy as np

from dnnvss.face.aam.search.bootstrap import Labelled, gather, retrain
from dnnvss.face.aam.search.choose import choose_frames
from dnnvss.face.aam.search.fit import fit_search
from dnnvss.face.aam.search.model import SearchModel
from dnnvss.face.aam.tracking import track_video
from dnnvss.face.landmarker import Landmarker, as_arrays, find_task, follow
from dnnvss.formats import read_marks, read_npz
from dnnvss.media import video_frames

COLUMNS = ("points by", "lips px", "offset taken out", "aperture", "jitter px", "valid", "pictures/s")

Track = Callable[[Path], tuple[np.ndarray, np.ndarray]]


def found(landmarker: Landmarker, video: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points (F, 146, 2) and valid (F,) of a clip by the nets."""
    tracks, frames = follow(landmarker, video_frames(video))
    return as_arrays(tracks[0] if tracks else None, frames)


def measured(raw: Path, clips: list[str], track: Track) -> list[str]:
    """One row of the table."""
    marks = read_marks(raw / "landmarks.json")
    lips = slice(marks.groups["lips_outer"][0], marks.groups["lips_inner"][1])
    upper, lower = (marks.groups["lips_inner"][0] + k for k in (5, 15))
    gaps, pairs, jitter, frames, spent = [], [], [], 0, 0.0
    for clip in clips:
        given = read_npz(raw / "landmarks" / f"{clip}.npz", marks.scale)
        start = time.process_time()
        points, valid = track(raw / "video" / f"{clip}.mp4")
        spent += time.process_time() - start
        frames += len(points)
        both = valid & given.valid
        gaps.append((points - given.points)[both][:, lips])
        pairs.append(np.stack([p[both][:, lower, 1] - p[both][:, upper, 1] for p in (points, given.points)]))
        jitter.append(np.abs(np.diff(points[both][:, lips], n=3, axis=0)).mean() * np.sqrt(np.pi / 2 / 20))
    gap, pair = np.concatenate(gaps), np.concatenate(pairs, axis=1)
    numbers = [np.linalg.norm(gap, axis=-1).mean(), np.linalg.norm(gap - gap.mean(axis=0), axis=-1).mean(),
               np.corrcoef(pair)[0, 1], np.mean(jitter), len(gap) / frames]
    return [*(f"{n:.3f}" for n in numbers), f"{frames / spent:.0f}"]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("raw", type=Path)
    parser.add_argument("--split", default="val")
    parser.add_argument("--clips", type=int, default=40)
    parser.add_argument("--refine", type=int, default=0)
    parser.add_argument("--own", type=int, default=0)
    parser.add_argument("--learn-from", type=int, default=60, help="training clips in which frames are chosen")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    landmarker = Landmarker(find_task())
    clips = (options.raw / "splits" / f"{options.split}.txt").read_text().split()[: options.clips]
    print("  ".join(COLUMNS))

    def row(name: str, track: Track) -> None:
        print(name, *measured(options.raw, clips, track), sep="  ", flush=True)

    row("nets", lambda video: found(landmarker, video))
    if options.refine:
        train = (options.raw / "splits" / "train.txt").read_text().split()
        several = train[:: max(1, len(train) // options.learn_from)]
        videos = [options.raw / "video" / f"{name}.mp4" for name in several]
        labelled = chosen(landmarker, videos, options.refine)
        model = fit_search(labelled.images, labelled.points)
        row("search", lambda video: searched(model, video))
        if options.own:
            tracks = [(partial(video_frames, video), track_video(model, video)) for video in videos]
            again = retrain(model, labelled, gather(model, tracks, options.own))
            row("search again", lambda video: searched(again, video))


def chosen(landmarker: Landmarker, videos: list[Path], count: int) -> Labelled:
    """Frames worth labelling, with the points that the nets find in them when they follow the clip."""
    images, points = [], []
    picked = choose_frames(videos, count)
    for video in dict.fromkeys(choice.video for choice in picked):
        tracked, valid = found(landmarker, video)
        frames = list(video_frames(video))
        for frame in (choice.frame for choice in picked if choice.video == video):
            if valid[frame]:
                images.append(frames[frame])
                points.append(tracked[frame])
    return Labelled(images, np.stack(points))


def searched(model: SearchModel, video: Path) -> tuple[np.ndarray, np.ndarray]:
    """Points and valid of a clip by the search model."""
    track = track_video(model, video)
    return np.asarray(track.points), np.asarray(track.valid)


if __name__ == "__main__":
    main()
