"""GRID as landmarks without pictures: a folder that ``data_prep corpus=folder`` takes and ``face=points`` learns from.

``python benchmarks/grid_points.py RAW OUT`` writes ``OUT/ID.npz``, ``ID.wav``, ``ID.txt`` and ``landmarks.json`` of a
GRID talker's videos, landmarks and word times. Then:

    python -m data_prep corpus=folder corpus.raw=OUT corpus.name=grid_points corpus.importer.variant=en_gb \\
        'corpus.importer.lexicon={a: EY}'
    python train.py corpus=folder corpus.name=grid_points aam=grid visemes=grid face=points labels=ph
"""

import argparse
import shutil
from pathlib import Path

from tqdm import tqdm

from data_prep.grid import SOUND_DELAY, words_of
from data_prep.media import laid
from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.media import SPEECH_RATE, timed_audio, video_info, write_wav

RATE = 25
"""Frames a second of GRID."""


def main() -> None:
    """Write the folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("raw", type=Path, help="GRID as it was distributed, with landmarks")
    parser.add_argument("out", type=Path, help="the folder to write")
    parser.add_argument("--count", type=int, default=0, help="no more clips than this; 0 takes all")
    options = parser.parse_args()
    videos = sorted((options.raw / "video").glob("*.mp4"))
    for video in tqdm(videos[: options.count or None]):
        write_clip(options.raw, video, options.out)
    marks = files.read_json(options.raw / "landmarks.json")
    size = video_info(videos[0]).size
    files.write_json(options.out / "landmarks.json", {**marks, "rate": RATE, "size": list(size)})
    if (options.raw / "splits").is_dir() and not options.count:
        shutil.copytree(options.raw / "splits", options.out / "splits", dirs_exist_ok=True)


def write_clip(raw: Path, video: Path, out: Path) -> None:
    """Write landmarks, words, and the sound on the time of the pictures."""
    name = video.stem
    landmarks = raw / "landmarks" / f"{name}.npz"
    count = len(read_arrays(landmarks)["points"])
    with files.replacing(out / landmarks.name) as temporary:
        shutil.copyfile(landmarks, temporary)
    files.write_text(out / f"{name}.txt", " ".join(words_of(name) or ()) + "\n")
    samples, starts = timed_audio(video, SPEECH_RATE)
    sound = laid(samples, SOUND_DELAY[video.suffix] - starts, round(count / RATE * SPEECH_RATE))
    write_wav(out / f"{name}.wav", sound, SPEECH_RATE)


if __name__ == "__main__":
    main()
