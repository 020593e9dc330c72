"""Sentences cut out of one long recording, beside the same sentences as clips of their own.

    python benchmarks/long_recording.py GRID CORPUS WORK [--clips 900] [--texts txt srt] [--plain] [--face RUN]

Clips of GRID are joined to one file, pictures copied and sound laid in its place, with their landmarks (``--plain``:
without), and with one transcript in a single piece without a full stop, or with subtitles. It is prepared as
``corpus=folder`` prepares it. Printed are the sentences that are found whole, and how far their speech begins and ends
from where it does in a prepared corpus of the separate clips, which were aligned with their word times, and whose
sounds are laid on the recording by correlation; on which side GRID's own word times are where both differ; the minutes
that took; and the most memory that the command and its workers held together.

The sentences get the splits of that corpus, so that what is trained on both is judged by the same sentences:

    python train.py corpus=folder corpus.name=long corpus.out=WORK/txt aam=grid

Coefficients compare within one face only: with ``--face RUN``, a run on CORPUS, that training takes the face of RUN.

GRID is the folder of the recordings (``video``, ``align``, ``landmarks``), CORPUS the prepared corpus, WORK a folder to
work in; what is there already is gone on with.
"""

import argparse
import json
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import av
import numpy as np

from dnnvss import files
from dnnvss.corpus import SPLITS, Corpus
from dnnvss.face.encoding import FACE, encoding_folder
from dnnvss.formats import Cue, read_grid_align, write_srt
from dnnvss.media import SPEECH_RATE, opened, read_audio, timed_audio
from dnnvss.media.storing import stretch
from dnnvss.media.writing import SoundTrack
from dnnvss.runs.files import RunFiles
from dnnvss.runs.settings import RunSettings

RATE = 44100
CLOSE = 0.1
REACH = 0.2
"""Seconds: an edge that is as near is right; by which the sound of a clip may have been moved."""


class Sentence(NamedTuple):
    """A clip in the recording: its id, when it begins, its text and when its words are said."""

    id: str
    start: float
    text: str
    said: tuple[float, float]


def recorded(grid: Path, clips: Sequence[Path], folder: Path, plain: bool) -> list[Sentence]:
    """The sentences of one recording, which is written with its landmarks, or ``plain`` without, where it is not there.
    """
    plan = folder.parent / "sentences.json"
    if plan.is_file():
        kept = [Sentence(*row) for row in json.loads(plan.read_text())]
        if [s.id for s in kept] == [clip.stem for clip in clips] and plain != (folder / "lecture.npz").is_file():
            return kept
    made = joined(grid, clips, folder, plain)
    files.write_text(plan, json.dumps(made))
    return made


def joined(grid: Path, clips: Sequence[Path], folder: Path, plain: bool) -> list[Sentence]:
    """The sentences of one recording, after writing it with its landmarks, or ``plain`` without."""
    made: list[Sentence] = []
    sounds, points, valid = list[np.ndarray](), list[np.ndarray](), list[np.ndarray]()
    at = 0
    packets = []
    with av.open(str(folder / "lecture.mp4"), "w", format="mp4", options={"movflags": "faststart"}) as out:
        stream = None
        for clip in clips:
            with opened(clip) as source:
                video = source.streams.video[0]
                stream = stream or out.add_stream_from_template(video)
                assert video.time_base is not None and video.average_rate is not None
                base, step = Fraction(video.time_base), round(1 / video.average_rate / video.time_base)
                own = [packet for packet in source.demux(video) if packet.size]
            for packet in own:
                assert packet.pts is not None and packet.dts is not None
                packets.append((packet, packet.pts + at, packet.dts + at))
            heard, late = timed_audio(clip, RATE)
            heard = np.pad(heard, (max(round(late * RATE), 0), 0))
            count = round((at + len(own) * step) * base * RATE) - sum(map(len, sounds))
            sounds.append(np.pad(heard[:count], (0, max(count - len(heard), 0))))
            words = [s for s in read_grid_align(grid / "align" / f"{clip.stem}.align") if s.label]
            start = float(at * base)
            made.append(Sentence(clip.stem, start, " ".join(w.label for w in words),
                                 (start + words[0].start, start + words[-1].end)))
            if not plain:
                with np.load(grid / "landmarks" / f"{clip.stem}.npz") as marks:
                    points.append(marks["points"])
                    valid.append(marks["valid"])
            at += len(own) * step
        assert stream is not None
        track = SoundTrack(out, np.concatenate(sounds), RATE)
        for packet, pts, dts in packets:
            packet.pts, packet.dts, packet.stream = pts, dts, stream
            track.write_until(float(dts * base))
            out.mux(packet)
        track.finish()
    if not plain:
        files.write_arrays(folder / "lecture.npz", points=np.concatenate(points), valid=np.concatenate(valid))
        files.write_text(folder / "landmarks.json", (grid / "landmarks.json").read_text())
    return made


def prepared(folder: Path, out: Path, jobs: int) -> tuple[float, float]:
    """Minutes and MB that preparing a folder took."""
    command = [sys.executable, "-m", "data_prep", "corpus=folder", f"corpus.raw={folder}", f"corpus.out={out}",
               "corpus.name=long", "corpus.importer.variant=en_gb", "corpus.importer.sync=true",
               "+corpus.importer.lexicon.a=EY", '+corpus.importer.lexicon.white="W AY T"', f"jobs={jobs}"]
    began, most = time.monotonic(), 0.0
    with subprocess.Popen(command) as process:
        while process.poll() is None:
            most = max(most, memory(process.pid))
            time.sleep(0.5)
    if process.returncode:
        sys.exit(process.returncode)
    return (time.monotonic() - began) / 60, most


def memory(process: int) -> float:
    """MB that a process and those that it started hold, pages that they share counted once each by the kernel (PSS)."""
    total = 0.0
    try:
        for line in Path(f"/proc/{process}/smaps_rollup").read_text().splitlines():
            total += int(line.split()[1]) / 1024 if line.startswith("Pss:") else 0
        children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    except OSError:  # it has ended
        return total
    return total + sum(memory(int(child)) for child in children)


def compared(sentences: Sequence[Sentence], separate: Corpus, out: Path) -> dict[str, str]:
    """The utterance of each sentence, after printing how far its edges are from where they are in its own clip."""
    corpus = Corpus.open(out)
    found = []
    for u in corpus.utterances.values():
        clip = json.loads((out / ".stages" / "clips" / f"{u.id}.json").read_text())["result"]
        words = [s for s in u.alignment["words"] if s.label]
        start = clip["start"] + laid(read_audio(corpus.path(u, "audio")), out, clip["start"])
        found.append((start + words[0].start, start + words[-1].end, [w.label for w in words], u.id))
    starts = np.array([row[0] for row in found])
    off, same, missing = list[tuple[float, float]](), dict[str, str](), list[str]()
    apart = list[tuple[str, bool]]()
    known = [s for s in sentences if s.id in separate.utterances]
    for sentence in known:
        own = separate.utterances[sentence.id]
        words = [s for s in own.alignment["words"] if s.label]
        late = sentence.start + laid(read_audio(separate.path(own, "audio")), out, sentence.start)
        row = found[int(np.abs(starts - late - words[0].start).argmin())]
        if row[2] != [w.label for w in words]:
            missing.append(sentence.id)
            continue
        same[sentence.id] = row[3]
        ends = late + words[0].start, late + words[-1].end
        off.append((row[0] - ends[0], row[1] - ends[1]))
        apart += [(sentence.id, abs(here - said) < abs(there - said))
                  for here, there, said in zip(row[:2], ends, sentence.said, strict=True) if abs(here - there) >= CLOSE]
    edges = np.array(off)
    good = (np.abs(edges) < CLOSE).all(axis=1).sum()
    print(f"{len(found)} utterances; {len(same)} of {len(known)} sentences whole "
          f"({100 * len(same) / len(known):.1f} %), {good} within {1000 * CLOSE:.0f} ms "
          f"({100 * good / len(known):.1f} %); median "
          f"{1000 * np.median(edges[:, 0]):.0f} and {1000 * np.median(edges[:, 1]):.0f} ms, 95th percentile of the "
          f"amount {1000 * np.percentile(np.abs(edges), 95):.0f} ms")
    print("not whole:", " ".join(missing) or "none")
    print(f"further off: {' '.join(name for name, _ in apart) or 'none'}; of these {len(apart)} edges the given word "
          f"times are nearer to {sum(here for _, here in apart)} as cut, to the others as in the separate clips")
    return same


def split_alike(separate: Corpus, same: Mapping[str, str], out: Path) -> None:
    """Put the sentences into the splits in which they are in the corpus of the separate clips."""
    for split in SPLITS:
        names = [same[u.id] for u in separate.split(split) if u.id in same]
        files.write_text(out / "splits" / f"{split}.txt", "".join(f"{name}\n" for name in names))


def lay_face(run: Path, out: Path) -> None:
    """Put the face of a run where training on the cut recording, with the same settings of the face, looks for one."""
    corpus, settings = Corpus.open(out), RunSettings.load(run)
    splits = {name: [u.id for u in corpus.split(name)] for name in SPLITS}
    home = files.make_folder(encoding_folder(corpus, splits, settings.face_settings, out / "face"))
    shutil.copyfile(RunFiles(run).face, home / FACE)


def laid(sound: np.ndarray, out: Path, start: float) -> float:
    """By how many seconds the sound of a clip lies later in the recording than its clip begins there."""
    reach = round(REACH * SPEECH_RATE)
    wav = out / ".stages" / "recording" / "lecture.16.wav"
    there = stretch(wav, SPEECH_RATE, start, start + len(sound) / SPEECH_RATE)
    middle = sound[reach : len(there) - reach]
    match = np.fft.irfft(np.fft.rfft(there) * np.conj(np.fft.rfft(middle, len(there))))[: 2 * reach + 1]
    return (int(match.argmax()) - reach) / SPEECH_RATE


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("grid", type=Path)
    parser.add_argument("corpus", type=Path)
    parser.add_argument("work", type=Path)
    parser.add_argument("--clips", type=int, default=900)
    parser.add_argument("--texts", nargs="+", default=["txt", "srt"], choices=["txt", "srt"])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--plain", action="store_true", help="give no landmarks: they are found in the pictures")
    parser.add_argument("--face", type=Path, metavar="RUN", help="a run on CORPUS whose face is to be taken")
    given = parser.parse_args()
    raw = files.make_folder(given.work / "raw")
    clips = sorted((given.grid / "video").glob("*.mp4"))
    sentences = recorded(given.grid, clips[:: max(1, len(clips) // given.clips)][: given.clips], raw, given.plain)
    separate = Corpus.open(given.corpus)
    for kind in given.texts:
        for old in (raw / "lecture.txt", raw / "lecture.srt"):
            files.remove(old)
        if kind == "txt":
            files.write_text(raw / "lecture.txt", " ".join(s.text for s in sentences) + "\n")
        else:
            write_srt(raw / "lecture.srt", [Cue(*s.said, s.text) for s in sentences])
        minutes, most = prepared(raw, given.work / kind, given.jobs)
        print(f"{len(sentences)} sentences, {kind}: {minutes:.1f} minutes, {most:.0f} MB at most")
        split_alike(separate, compared(sentences, separate, given.work / kind), given.work / kind)
        if given.face is not None:
            lay_face(given.face, given.work / kind)


if __name__ == "__main__":
    main()
