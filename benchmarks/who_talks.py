"""How often the face whose sound it is is chosen, of two that both talk.

    python benchmarks/who_talks.py TALKER_A TALKER_B [...]

Each argument is a folder of clips of one talker, all shot alike. For each pair of talkers the sound of the one and both
faces are given to the choice that the preparation of a corpus makes, clip by clip and four clips in a row.
"""

import argparse
from fractions import Fraction
from itertools import permutations
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
import numpy as np

from data_prep.points import loudness
from dnnvss.face.landmarker import Landmarker, Region, Track, find_task, follow, talker
from dnnvss.media import SPEECH_RATE, read_audio, video_frames, video_info, write_wav
from dnnvss.media.folders import find_videos

CLIPS = 8
"""Of each talker."""

Clip = tuple[np.ndarray, np.ndarray]


def heard_and_seen(landmarker: Landmarker, video: Path) -> Clip:
    """How open the lips are and how loud it is in each frame (F,)."""
    tracks, frames = follow(landmarker, video_frames(video))
    with TemporaryDirectory() as folder:
        sound = write_wav(Path(folder) / "sound.wav", read_audio(video, SPEECH_RATE), SPEECH_RATE)
        loud = loudness(sound, Fraction(video_info(video).rate), frames)
    known = sorted(tracks[0].opening)
    return np.interp(np.arange(frames), known, [tracks[0].opening[k] for k in known]), loud


def right(own: list[Clip], other: list[Clip]) -> bool:
    """Whether the face of ``own`` is chosen, with its sound, beside the face of ``other``."""
    lips, loud = (np.concatenate(parts) for parts in zip(*own, strict=True))
    others = np.concatenate([clip[0] for clip in other])
    frames = min(len(lips), len(others))
    tracks = []
    for opening in (lips, others):
        track = Track(Region((0.0, 0.0), 1.0, 0.0), opening=dict(enumerate(opening[:frames].tolist())))
        track.points = dict.fromkeys(range(frames), np.zeros((1, 2)))
        tracks.append(track)
    return talker(tracks, frames, loud[:frames])[0] == 0


def main() -> None:
    """Print both shares."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("talkers", type=Path, nargs="+", metavar="TALKER")
    talkers = parser.parse_args().talkers
    cv2.setNumThreads(1)
    landmarker = Landmarker(find_task())
    clips = [[heard_and_seen(landmarker, video) for video in find_videos(folder)[:CLIPS]]
             for folder in talkers]
    for together in (1, 4):
        chosen = [right(a[k:k + together], b[k:k + together]) for a, b in permutations(clips, 2)
                  for k in range(0, min(len(a), len(b)) - together + 1, together)]
        print(f"{together} clips in a row: {np.mean(chosen):.3f} of {len(chosen)}")


if __name__ == "__main__":
    main()
