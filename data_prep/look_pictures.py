"""Pictures of a first look: faces with their points, and words over the sound."""

import base64
import html
from collections.abc import Mapping
from fractions import Fraction
from itertools import islice

import cv2
import numpy as np

from data_prep.sample import Sample
from dnnvss import files
from dnnvss.media import SPEECH_RATE, read_audio, video_frames
from dnnvss.phones import SILENCES
from dnnvss.timing import Alignment

_SIDE, _ROOM = 260, 0.12  # pixels of a picture, and room around the points in their widths
_LINE, _DOT = (94, 234, 212), (255, 214, 10)
_WIDE, _HIGH, _TOP = 1000, 132, 22
_GAP = 2.8


def faces(sample: Sample, name: str, groups: Mapping[str, tuple[int, int]]) -> list[tuple[str, str, bool]]:
    """Pictures of a recording as JPEG in a ``data:`` address, what to say of each, and whether it is doubted."""
    made = sample.made[name]
    count, rate = made["frames"], float(Fraction(made["rate"]))
    bad = sample.bad.get(name, np.zeros(count, bool))
    shown = [count // 6, count // 2, (5 * count) // 6, *np.flatnonzero(bad)[:1].tolist()]
    marks = sample.run.shop.arrays("landmarks", name) if name in sample.bad else None
    found = []
    video = video_frames(files.inside(sample.run.shop.out, made["video"]))
    for frame, picture in enumerate(islice(video, max(shown) + 1)):
        if frame in shown:
            points = marks["points"][frame] if marks is not None and marks["valid"][frame] else None
            drawn = _drawn(picture, points[:, :2], groups) if points is not None else _small(picture)
            what = "" if points is not None or marks is None else ", no face found"
            found.append((_address(drawn), f"{frame / rate:.2f} s{what}{', left out' if bad[frame] else ''}",
                          bool(bad[frame])))
    return found


def _drawn(picture: np.ndarray, points: np.ndarray, groups: Mapping[str, tuple[int, int]]) -> np.ndarray:
    """The face in a picture, its points joined in groups."""
    low, high = points.min(axis=0), points.max(axis=0)
    half = max(float((high - low).max()) * (0.5 + _ROOM), 8.0)
    scale = _SIDE / (2 * half)
    shift = np.array([_SIDE / 2, _SIDE / 2]) - scale * (low + high) / 2
    view = cv2.warpAffine(picture, np.array([[scale, 0, shift[0]], [0, scale, shift[1]]]), (_SIDE, _SIDE),
                          flags=cv2.INTER_AREA if scale < 1 else cv2.INTER_CUBIC)
    at = np.round((points * scale + shift) * 16).astype(np.int32)
    for first, end in groups.values():
        for a, b in _strokes(points[first:end]):
            cv2.line(view, at[first + a].tolist(), at[first + b].tolist(), _LINE, 1, cv2.LINE_AA, 4)
    for point in at:
        cv2.circle(view, (int(point[0]), int(point[1])), 18, _DOT, -1, cv2.LINE_AA, 4)
    return view


def _strokes(points: np.ndarray) -> list[tuple[int, int]]:
    """Neighbours of a group (N, 2) that a line joins, the last with the first where they are near.

    A step of more than :data:`_GAP` usual ones leads to another line.
    """
    steps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    usual = float(np.median(steps[:-1])) if len(points) > 1 else 0.0
    return [(k, (k + 1) % len(points)) for k in np.flatnonzero(steps <= _GAP * usual).tolist() if len(points) > 1]


def _small(picture: np.ndarray) -> np.ndarray:
    scale = _SIDE / picture.shape[0]
    return cv2.resize(picture, (max(1, round(picture.shape[1] * scale)), _SIDE), interpolation=cv2.INTER_AREA)


def _address(picture: np.ndarray) -> str:
    _, coded = cv2.imencode(".jpg", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, 82])
    return "data:image/jpeg;base64," + base64.b64encode(coded.tobytes()).decode()


def wave(sample: Sample, name: str) -> str:
    """The sound of a recording as SVG: words where they are said, frames that are left out below."""
    made = sample.made[name]
    sound = read_audio(files.inside(sample.run.shop.out, made["audio"])) if made.get("audio") else np.zeros(0)
    seconds = float(made["frames"] / Fraction(made["rate"]))
    parts = [_envelope(sound, seconds)]
    if name in sample.timed:
        parts += _words(Alignment.from_json(sample.timed[name]["alignment"]), seconds)
    for first, end in _runs(sample.bad.get(name, np.zeros(0, bool))):
        x, wide = _WIDE * first / made["frames"], max(_WIDE * (end - first) / made["frames"], 2)
        parts.append(f'<rect x="{x:.1f}" y="{_HIGH - 8}" width="{wide:.1f}" height="8" fill="var(--bad)"/>')
    return (f'<svg viewBox="0 0 {_WIDE} {_HIGH}" role="img" aria-label="words over the sound of {html.escape(name)}">'
            f'{"".join(parts)}</svg>')


def _envelope(sound: np.ndarray, seconds: float) -> str:
    """The loudest samples of every column, as one shape about the middle."""
    length = max(1, round(seconds * SPEECH_RATE))
    edges = np.linspace(0, length, _WIDE // 2 + 1).astype(int)
    padded = np.abs(np.pad(sound[:length], (0, max(0, length - len(sound)))))
    peaks = np.maximum.reduceat(padded, edges[:-1])
    middle, reach = _TOP + (_HIGH - _TOP - 12) / 2, (_HIGH - _TOP - 16) / 2
    tall = reach * peaks / max(float(peaks.max()), 1e-3)
    up = [f"{2 * k},{middle - t:.1f}" for k, t in enumerate(tall)]
    down = [f"{2 * k},{middle + t:.1f}" for k, t in reversed(list(enumerate(tall)))]
    return f'<polygon points="{" ".join(up + down)}" fill="var(--accent)" opacity=".75"/>'


def _words(alignment: Alignment, seconds: float) -> list[str]:
    """Words and their edges; silence is shaded."""
    parts = []
    for phone in alignment["phones"]:
        if phone.label in SILENCES:
            x, wide = _WIDE * phone.start / seconds, _WIDE * (phone.end - phone.start) / seconds
            parts.append(f'<rect x="{x:.1f}" y="{_TOP}" width="{wide:.1f}" height="{_HIGH - _TOP - 12}" '
                         'fill="var(--wash)" opacity=".6"/>')
    for word in alignment["words"]:
        if word.label:
            x, end = _WIDE * word.start / seconds, _WIDE * word.end / seconds
            parts += [f'<line class="axis" x1="{at:.1f}" x2="{at:.1f}" y1="{_TOP}" y2="{_HIGH - 12}"/>'
                      for at in (x, end)]
            parts.append(f'<text x="{(x + end) / 2:.1f}" y="14" text-anchor="middle">{html.escape(word.label)}</text>')
    return parts


def _runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """The half-open runs of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(int)))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
