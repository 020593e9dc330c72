"""Small recordings as phones, cameras and editors write them, made frame by frame."""

import struct
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import av
import numpy as np

from data_prep.demo import prepare_demo
from dnnvss import files
from dnnvss.corpus import Corpus
from dnnvss.formats import write_alignment, write_npz
from dnnvss.formats.openface import Landmarks
from dnnvss.media import read_audio, read_video, write_video

UPRIGHT, QUARTER, HALF, BACK = ((1, 0, 0, 1), (0, 1, -1, 0), (-1, 0, 0, -1), (0, -1, 1, 0))
"""Display matrices (a, b, c, d): shown as stored, turned by 90, 180 and 270 degrees clockwise."""
MIRRORED = (-1, 0, 0, 1)


def pictures(count: int, size: tuple[int, int] = (64, 48)) -> list[np.ndarray]:
    """Pictures whose grey value tells their number, with a white square in the corner top left."""
    found = []
    for k in range(count):
        image = np.full((size[1], size[0], 3), 20 + 8 * k, np.uint8)
        image[:12, :16] = 255
        found.append(image)
    return found


def number_of(image: np.ndarray) -> int:
    """Which of :func:`pictures` a picture is, from its middle."""
    height, width = image.shape[:2]
    grey = image[height // 2 - 2 : height // 2 + 2, width // 2 - 2 : width // 2 + 2].mean()
    return round((float(grey) - 20) / 8)


def film(path: Path, images: Sequence[np.ndarray], ticks: Sequence[int], base: int, *, codec: str = "libx264",
         pixel: Fraction | None = None, sounds: Sequence[Sequence[tuple[float, np.ndarray]]] = (), rate: int = 16000,
         matrix: tuple[int, ...] = UPRIGHT, options: dict[str, str] | None = None, sound_codec: str = "pcm_s16le",
         told: Fraction | int = 25) -> Path:
    """Write a recording whose pictures stand at ``ticks / base`` seconds.

    Args:
        pixel: shape of a pixel.
        sounds: of each track, blocks (C, n) with the seconds at which they begin.
        rate: samples a second.
        matrix: how players turn the pictures (mov and mp4).
        told: rate that the file tells.
    """
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream(codec, rate=told, options=options or {"crf": "1"}
                                           if codec == "libx264" else {})
        stream.height, stream.width = images[0].shape[:2]
        stream.pix_fmt = "yuv422p10le" if codec == "prores_ks" else "yuv420p"
        stream.codec_context.time_base = stream.time_base = Fraction(1, base)
        if codec != "libx264":
            stream.codec_context.bit_rate = 4_000_000
        if pixel is not None:
            stream.codec_context.sample_aspect_ratio = pixel
        tracks = []
        for blocks in sounds:
            layout = "mono" if len(blocks[0][1]) == 1 else "stereo"
            tracks.append(container.add_stream(sound_codec, rate=rate, layout=layout))
        for image, tick in zip(images, ticks, strict=True):
            frame = av.VideoFrame.from_ndarray(image, format="rgb24")
            frame.pts, frame.time_base = tick, Fraction(1, base)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
        for track, blocks in zip(tracks, sounds, strict=True):
            _sound(container, track, blocks, rate)
    if matrix != UPRIGHT:
        _turn(path, matrix)
    return path


def _sound(container: Any, track: Any, blocks: Sequence[tuple[float, np.ndarray]], rate: int) -> None:
    for start, block in blocks:
        for k in range(0, block.shape[1], 1024):
            part = np.ascontiguousarray(np.clip(block[:, k : k + 1024], -1, 1).astype(np.float32))
            frame = av.AudioFrame.from_ndarray(part, format="fltp", layout="mono" if len(part) == 1 else "stereo")
            frame.sample_rate, frame.time_base = rate, Fraction(1, rate)
            frame.pts = round(start * rate) + k
            container.mux(track.encode(frame))
    container.mux(track.encode(None))


def _turn(path: Path, matrix: tuple[int, ...]) -> None:
    """Write a display matrix into the header of the first track."""
    data = bytearray(path.read_bytes())
    a, b, c, d = (v * 65536 for v in matrix)
    at = data.index(b"tkhd") + 44
    data[at : at + 36] = struct.pack(">9i", a, b, 0, c, d, 0, 0, 0, 1 << 30)
    path.write_bytes(bytes(data))


def trim(path: Path, ticks: int) -> None:
    """Let the edit list of the first track begin some ticks of its media later, as phones trim."""
    data = bytearray(path.read_bytes())
    at = data.index(b"elst") + 16
    data[at : at + 4] = struct.pack(">i", struct.unpack(">i", data[at : at + 4])[0] + ticks)
    path.write_bytes(bytes(data))


def tone(seconds: float, rate: int = 16000, pitch: float = 200.0, level: float = 0.3) -> np.ndarray:
    """A tone (1, n)."""
    return level * np.sin(2 * np.pi * pitch * np.arange(round(seconds * rate)) / rate)[None].astype(np.float32)


def talker_folder(home: Path, sentences: int, size: int) -> Path:
    """Recordings of the built-in talker as a user has them: video with sound, words, landmarks, phone times.

    Args:
        home: gets the prepared corpus ``demo`` and the recordings ``raw``.
        sentences: how many.
        size: width and height in pixels.
    """
    corpus = prepare_demo(home / "demo", sentences=sentences, size=size, jobs=1)
    raw = home / "raw"
    for u in corpus.utterances.values():
        sound = read_audio(corpus.path(u, "audio"))
        write_video(raw / f"{u.id}.mp4", read_video(corpus.path(u, "video")), u.rate, sound, 16000)
        files.write_text(raw / f"{u.id}.txt", u.text)
        points, valid = corpus.landmarks(u)
        write_npz(raw / f"{u.id}.npz", Landmarks(points, valid))
        write_alignment(raw / f"{u.id}.TextGrid", u.alignment)
    files.write_json(raw / "landmarks.json", {"groups": corpus.info.landmark_groups})
    return raw


class Said(NamedTuple):
    """A sentence of a lecture: its text, start and end of its words in seconds."""

    text: str
    start: float
    end: float


def lecture(demo: Path, out: Path, *, gap: float = 0.3, count: int = 100) -> list[Said]:
    """Write the sentences of a prepared corpus as one recording with landmarks into a folder, and return them.

    Args:
        demo: the corpus.
        out: the folder; gets ``lecture.mp4``, ``lecture.npz`` and ``landmarks.json``.
        gap: seconds of silence that are added after each sentence.
        count: sentences at most.
    """
    corpus = Corpus.open(demo)
    images, points, audio = list[np.ndarray](), list[np.ndarray](), list[np.ndarray]()
    said, at = list[Said](), 0.0
    for u in list(corpus.utterances.values())[:count]:
        still = round(gap * float(u.rate))
        shown = read_video(corpus.path(u, "video"))
        marks = corpus.landmarks(u)[0]
        images += [*shown, *[shown[-1]] * still]
        points += [*marks, *[marks[-1]] * still]
        seconds = (len(shown) + still) / float(u.rate)
        heard = read_audio(corpus.path(u, "audio"))[: round(seconds * 16000)]
        audio.append(np.pad(heard, (0, round(seconds * 16000) - len(heard))))
        spoken = [s for s in u.alignment["words"] if s.label]
        said.append(Said(u.text, at + spoken[0].start, at + spoken[-1].end))
        at += seconds
    write_video(out / "lecture.mp4", images, u.rate, np.concatenate(audio))
    write_npz(out / "lecture.npz", Landmarks(np.array(points), np.ones(len(points), bool)))
    files.write_json(out / "landmarks.json", {"groups": {k: list(v) for k, v in corpus.info.landmark_groups.items()}})
    return said


def subtitles(said: Sequence[tuple[str, float, float]]) -> str:
    """Sentences as the text of an ``.srt`` file."""

    def stamp(t: float) -> str:
        whole = round(t * 1000)
        return f"00:{whole // 60000:02d}:{whole // 1000 % 60:02d},{whole % 1000:03d}"

    return "\n".join(f"{k}\n{stamp(a)} --> {stamp(b)}\n{text}\n" for k, (text, a, b) in enumerate(said, 1))
