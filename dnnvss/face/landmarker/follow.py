"""The points of every face in a video, from frame to frame."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from dnnvss.face.landmarker.layout import LEFT_CORNER, LOWER_LIP, RIGHT_CORNER, ROWS, UPPER_LIP
from dnnvss.face.landmarker.nets import WIDER, Landmarker, Region

SURE = 0.5
"""Certainty below which a face is lost."""

EVERY = 25
"""Frames after which other faces are looked for."""

MOST = 4
"""Faces that are followed at once."""


@dataclass
class Track:
    """One face of a video.

    Args:
        region: where it was seen last.
        live: whether it was there in the last frame.
        points: frame to points (146, 2) in pixels.
        opening: frame to the distance of the inner lips, in distances between the outer corners of the eyes.
    """

    region: Region
    live: bool = True
    points: dict[int, np.ndarray] = field(default_factory=dict)
    opening: dict[int, float] = field(default_factory=dict)

    def look(self, landmarker: Landmarker, frame: int, picture: np.ndarray) -> None:
        """Find the face in the next picture, near where it was."""
        mesh, certainty = landmarker.mesh(picture, self.region)
        self.live = certainty >= SURE
        if self.live:
            eyes = mesh[[RIGHT_CORNER, LEFT_CORNER]]
            self.region = Region.around(mesh, eyes, WIDER)
            self.points[frame] = mesh[ROWS]
            wide = max(float(np.linalg.norm(eyes[1] - eyes[0])), 1e-3)
            self.opening[frame] = float(np.linalg.norm(mesh[LOWER_LIP] - mesh[UPPER_LIP])) / wide

    def near(self, region: Region) -> bool:
        """Whether a face that was found is this one."""
        away = np.subtract(self.region.centre, region.centre)
        return float(np.hypot(*away)) < max(self.region.side, region.side) / 4


def follow(landmarker: Landmarker, pictures: Iterable[np.ndarray]) -> tuple[list[Track], int]:
    """The faces of a video, those that were seen longest first, and the number of its frames.

    A face is looked for where it was in the frame before; the detector is asked where none is left, and now and then
    for others.

    Args:
        landmarker: the nets.
        pictures: uint8 RGB (H, W_, 3) each; they are read once, one at a time.
    """
    tracks: list[Track] = []
    frame = -1
    for frame, picture in enumerate(pictures):
        for track in tracks:
            if track.live:
                track.look(landmarker, frame, picture)
        _part(tracks)
        if frame % EVERY == 0 or not any(track.live for track in tracks):
            _search(landmarker, tracks, frame, picture)
    return sorted(tracks, key=lambda track: -len(track.points)), frame + 1


def _part(tracks: list[Track]) -> None:
    """End tracks that have run into an older one."""
    for k, track in enumerate(tracks):
        if track.live and any(other.live and other.near(track.region) for other in tracks[:k]):
            track.live = False


def _search(landmarker: Landmarker, tracks: list[Track], frame: int, picture: np.ndarray) -> None:
    for region in landmarker.detect(picture)[:MOST]:
        if any(track.live and track.near(region) for track in tracks):
            continue
        known = next((track for track in tracks if track.near(region)), None)
        track = known or Track(region)
        track.region = region
        for _ in range(2):  # the detector's box is rough: the second look is through a square of the mesh's own
            track.look(landmarker, frame, picture)
        if track.live and known is None and len(tracks) < MOST:
            tracks.append(track)


SYLLABLE = 0.6
"""Seconds over whose mean lips and sound are compared: that somebody talks at all is the same for all who do."""

_LAGS = (-0.04, 0.08)  # seconds by which lips may be late


def talker(tracks: list[Track], frames: int, loudness: np.ndarray | None, rate: float = 25.0) -> tuple[int, str]:
    """Which face talks, and what there is to say about the choice.

    Of faces that are there for a third of the time and more it is the one whose lips open and close with the sound;
    without sound the one that is there longest.

    Args:
        tracks: see :func:`follow`.
        frames: of the video.
        loudness: root mean square of the sound (F,), None where there is none.
        rate: frames a second.
    """
    long = [k for k, track in enumerate(tracks) if 3 * len(track.points) >= frames]
    others = f"{len(tracks)} faces are seen" if len(tracks) > 1 else ""
    if len(long) < 2 or loudness is None:
        return 0, f"{others}: the one that is there longest is taken" if others else ""
    moves = [_with_sound(tracks[k], frames, loudness, rate) for k in long]
    best = int(np.argmax(moves))
    told = ", ".join(f"{move:.2f}" for move in moves)
    return long[best], f"{others}: the one whose lips move with the sound is taken (correlations {told})"


def _with_sound(track: Track, frames: int, loudness: np.ndarray, rate: float) -> float:
    """Correlation between how open the lips are and how loud it is, each about its mean over a syllable or two.

    The square root of the loudness was the best of five forms; ``benchmarks/who_talks.py`` says how often it is right.
    Zero where lips or sound do not change.
    """
    known = np.array(sorted(track.opening))
    opening = np.interp(np.arange(frames), known, [track.opening[k] for k in known])
    reach = max(1, round(SYLLABLE * rate / 2))
    lips, loud = _about_mean(opening, reach), _about_mean(np.sqrt(loudness[:frames]), reach)
    first, last = (round(lag * rate) for lag in _LAGS)
    return max(_correlation(lips[max(lag, 0):frames + min(lag, 0)], loud[max(-lag, 0):frames - max(lag, 0)])
               for lag in range(first, last + 1))


def _about_mean(values: np.ndarray, reach: int) -> np.ndarray:
    """Values (F,) less their mean over so many frames on either side, those at the ends repeated."""
    total = np.concatenate([[0.0], np.cumsum(np.pad(values, reach, mode="edge"))])
    width = 2 * reach + 1
    return values - (total[width:] - total[:-width]) / width


def _correlation(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.corrcoef(one, other)[0, 1]) if one.std() > 1e-9 and other.std() > 1e-9 else 0.0


def as_arrays(track: Track | None, frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (F, 146, 2) float32, NaN where the face is not seen, and valid (F,)."""
    points = np.full((frames, len(ROWS), 2), np.nan, np.float32)
    for frame, found in track.points.items() if track else ():
        points[frame] = found
    return points, np.array(np.isfinite(points).all(axis=(1, 2)))
