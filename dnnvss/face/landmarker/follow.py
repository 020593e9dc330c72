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


def talker(tracks: list[Track], frames: int, loudness: np.ndarray | None) -> tuple[int, str]:
    """Which face talks, and what there is to say about the choice.

    Of faces that are there for a third of the time and more it is the one whose lips move when the sound is loud;
    without sound the one that is there longest.

    Args:
        tracks: see :func:`follow`.
        frames: of the video.
        loudness: of the sound (F,), None where there is none.
    """
    long = [k for k, track in enumerate(tracks) if 3 * len(track.points) >= frames]
    others = f"{len(tracks)} faces are seen" if len(tracks) > 1 else ""
    if len(long) < 2 or loudness is None:
        return 0, f"{others}: the one that is there longest is taken" if others else ""
    moves = [_with_sound(tracks[k], frames, loudness) for k in long]
    best = int(np.argmax(moves))
    told = ", ".join(f"{move:.2f}" for move in moves)
    return long[best], f"{others}: the one whose lips move with the sound is taken (correlations {told})"


def _with_sound(track: Track, frames: int, loudness: np.ndarray) -> float:
    """Correlation between how fast lips move and how loud it is; 0 where one of them does not change."""
    known = np.array(sorted(track.opening))
    opening = np.interp(np.arange(frames), known, [track.opening[k] for k in known])
    speed = np.convolve(np.abs(np.gradient(opening)), np.ones(5) / 5, "same")
    loud = np.convolve(loudness[:frames], np.ones(5) / 5, "same")
    return float(np.corrcoef(speed, loud)[0, 1]) if speed.std() > 0 and loud.std() > 0 else 0.0


def as_arrays(track: Track | None, frames: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (F, 146, 2) float32, NaN where the face is not seen, and valid (F,)."""
    points = np.full((frames, len(ROWS), 2), np.nan, np.float32)
    for frame, found in track.points.items() if track else ():
        points[frame] = found
    return points, np.array(np.isfinite(points).all(axis=(1, 2)))
