"""The built-in talker as a motion-capture session: 66 markers on the face and 7 on a jig, in space, at 120 Hz.

What the cameras see has the faults of a real capture, and the truth of each take is kept: the markers of the face
without head motion, noise, gaps and swaps, and where these are.

**Source**: Edge et al. 2004, section 4, for the number of markers, the rate and the kinds of faults.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from dnnvss.corpus.talker.durations import speak
from dnnvss.corpus.talker.geometry import CENTRE, LANDMARK_GROUPS, landmark_track, moved, on_sheet
from dnnvss.corpus.talker.hours import SPOKEN_FORMS
from dnnvss.corpus.talker.motion import Motion, perform
from dnnvss.corpus.talker.targets import Articulators
from dnnvss.timing import Alignment, FrameClock, Tier

RATE = 120
"""Frames a second."""
_MM = 0.9
"""Millimetres of a unit of the design sheet."""
_LEVEL = 200.0
"""Line of the sheet that lies at height 0."""
_OUTER = (0, 2, 4, 5, 6, 8, 10, 12, 14, 15, 16, 18)
_JAW = tuple(range(3, 12))
_SKIN: dict[str, list[tuple[float, float]]] = {
    "chin": [(0, 240), (-15, 243), (15, 243), (-8, 249), (8, 249)],
    "cheek": [
        (s * x, y)
        for s in (-1, 1)
        for x, y in [
            (38, 226),
            (52, 212),
            (44, 196),
            (60, 190),
            (30, 190),
            (48, 176),
            (64, 168),
            (34, 170),
        ]
    ],
    "nose": [
        (-15, 182),
        (-7.5, 187),
        (0, 189),
        (7.5, 187),
        (15, 182),
        (0, 133),
        (0, 146),
        (0, 159),
        (0, 173),
    ],
    "brow": [
        (s * 35 + x, y)
        for s in (-1, 1)
        for x, y in [(-22, 116.5), (-12, 109.5), (0, 107.5), (11, 109.5), (18, 113.5)]
    ],
    "forehead": [(-40, 90), (-20, 82), (0, 78), (20, 82), (40, 90)],
}
_JIG = np.array(
    [
        (-95, 60, 10),
        (-60, 125, 30),
        (-20, 150, 60),
        (20, 152, 35),
        (60, 128, 62),
        (95, 65, 15),
        (0, 120, 95),
    ],
    dtype=float,
)
"""Millimetres right, up and towards the cameras of the middle of the face."""
FACE_MARKERS = (
    *(f"lips{i + 1:02d}" for i in range(len(_OUTER))),
    *(f"jaw{i + 1:02d}" for i in range(len(_JAW))),
    *(f"{group}{i + 1:02d}" for group, points in _SKIN.items() for i in range(len(points))),
)
JIG_MARKERS = tuple(f"jig{i + 1}" for i in range(len(_JIG)))
MARKERS = (*FACE_MARKERS, *JIG_MARKERS)
"""Names of the 73 markers."""
assert len(FACE_MARKERS) == 66 and len(JIG_MARKERS) == 7


@dataclass(frozen=True)
class Faults:
    """What the cameras do to a take.

    Args:
        noise: standard deviation of each coordinate, mm.
        missing: share of all samples of markers that are missing.
        longest: seconds of the longest gap.
        swaps: pairs of neighbouring markers that change names for a while, a take.
        flickers: samples that are somewhere else for one frame, a take.
    """

    noise: float = 0.1
    missing: float = 0.1
    longest: float = 0.2
    swaps: int = 3
    flickers: int = 6


@dataclass(frozen=True)
class CapturedTake:
    """A take of the session.

    Args:
        text: the words as written.
        alignment: tiers ``phones``, ``words`` and ``gestures``; it ends with a frame.
        truth: (F, 66, 3) mm, the markers of the face in the frame of the head.
        seen: (F, 73, 3) mm, as the cameras give them; NaN where a marker is missing.
        swaps: (n, 4), two markers, and the first and the end of the frames in which their names are changed.
        flickers: (n, 2), a frame and the marker that is elsewhere in it.
    """

    text: str
    alignment: Alignment
    truth: np.ndarray
    seen: np.ndarray
    swaps: np.ndarray
    flickers: np.ndarray


@dataclass(frozen=True)
class Performance:
    """A sentence of the session before the cameras see it.

    Args:
        alignment: ends with a frame.
        motion: of the articulators.
    """

    alignment: Alignment
    motion: Motion

    @cached_property
    def markers(self) -> np.ndarray:
        """The markers of the face (F, 66, 3) in mm, in the frame of the head."""
        return face_markers(
            self.motion.at(FrameClock(RATE).centres(FrameClock(RATE).edge(self.alignment.end)))
        )


def perform_words(text: str, random: np.random.Generator) -> Performance:
    """A sentence of the grammar, spoken and moved."""
    alignment = speak(text, random, SPOKEN_FORMS)
    end = FrameClock(RATE).seconds(int(np.ceil(alignment.end * RATE - 1e-6)))
    alignment = Alignment(
        Tier(t.name, [*t.segments[:-1], t.segments[-1]._replace(end=end)]) for t in alignment.tiers
    )
    motion, gestures = perform(alignment, random)
    return Performance(alignment.with_tier(gestures), motion)


def capture(number: int, text: str, seed: int = 0, faults: Faults | None = None) -> CapturedTake:
    """A take of the session; the same for the same number, text, seed and faults."""
    random = np.random.default_rng([seed, number, 8])
    performed = perform_words(text, random)
    truth = performed.markers
    jig = np.repeat(_JIG[None], len(truth), axis=0)
    seen = _carried(np.concatenate([truth, jig], axis=1), random)
    return _spoilt(
        CapturedTake(
            text, performed.alignment, truth, seen, np.zeros((0, 4), int), np.zeros((0, 2), int)
        ),
        faults or Faults(),
        random,
    )


def face_markers(rows: np.ndarray) -> np.ndarray:
    """The markers of the face (F, 66, 3) in mm for articulators (F, 12): right, up and towards the cameras.

    Lips and skin lie where the talker's picture has them; depth is that of an ellipsoid with a nose, to which the lips
    add what protrudes, and from which the jaw falls back as it opens.
    """
    names = list(Articulators._fields)
    still = rows.copy()
    still[:, [names.index(n) for n in ("sway_x", "sway_y", "roll")]] = 0
    track = landmark_track(still)
    lips, jaw = (track[:, slice(*LANDMARK_GROUPS[group])] for group in ("lips_outer", "jaw"))
    skin = moved(on_sheet([p for points in _SKIN.values() for p in points]), still)
    flat = np.concatenate([lips[:, _OUTER], jaw[:, _JAW], skin], axis=1)
    x, y = (flat[..., 0] - CENTRE) * _MM, (_LEVEL - flat[..., 1]) * _MM
    depth = 75 * np.sqrt(np.clip(1 - (x / 95) ** 2 - ((y - 20) / 165) ** 2, 0, 1))
    depth += 20 * np.exp(-((x / 12) ** 2) - ((y - 15) / 18) ** 2)
    protruded, open_ = rows[:, [names.index("protrusion")]], rows[:, [names.index("jaw")]]
    near_lips = np.exp(-((x / 26) ** 2) - ((y + 11) / 14) ** 2)
    below = np.clip((-12 - y) / 40, 0, 1)
    return np.stack([x, y, depth + 6 * protruded * near_lips - 4 * open_ * below], axis=-1)


def _carried(points: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Points (F, M, 3) of a head that turns and moves before the cameras, in the axes of the room."""
    times = np.arange(len(points)) / RATE
    turn = np.deg2rad(random.normal(0, 6, 3) + _wander(times, 3.0, random))
    shift = np.array([40.0, 1200.0, -300.0]) + random.normal(0, 25, 3) + _wander(times, 8.0, random)
    return (
        np.einsum("fij,fmj->fmi", Rotation.from_rotvec(turn).as_matrix(), points) + shift[:, None]
    )


def _wander(times: np.ndarray, size: float, random: np.random.Generator) -> np.ndarray:
    """Three slow movements (F, 3), each of three sines of .1 to 1.2 Hz."""
    rates, phases = random.uniform(0.1, 1.2, (3, 3)), random.uniform(0, 2 * np.pi, (3, 3))
    sizes = size / np.sqrt(1.5) * random.uniform(0.5, 1.5, (3, 3)) / (1 + rates)
    return (sizes * np.sin(2 * np.pi * rates * times[:, None, None] + phases)).sum(axis=-1)


def _spoilt(take: CapturedTake, faults: Faults, random: np.random.Generator) -> CapturedTake:
    seen = take.seen + random.normal(0, faults.noise, take.seen.shape)
    flickers = _flickers(seen, faults.flickers, random)
    seen[_gaps(seen.shape[:2], faults, random)] = np.nan
    swaps = _swaps(seen, take.truth, faults.swaps, random)
    return CapturedTake(take.text, take.alignment, take.truth, seen, swaps, flickers)


def _flickers(seen: np.ndarray, count: int, random: np.random.Generator) -> np.ndarray:
    """Throw single samples of ``seen`` elsewhere, and tell which (count, 2)."""
    where = np.stack(
        [random.integers(2, len(seen) - 2, count), random.integers(0, len(FACE_MARKERS), count)],
        axis=1,
    )
    way = random.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    for (frame, marker), step in zip(where, way * random.uniform(8, 30, (count, 1)), strict=True):
        seen[frame, marker] += step
    return where


def _gaps(shape: tuple[int, int], faults: Faults, random: np.random.Generator) -> np.ndarray:
    """Which samples (F, M) are missing: gaps of 25 ms to the longest, drawn until the share is reached."""
    missing = np.zeros(shape, bool)
    longest = max(int(faults.longest * RATE), 3)
    while missing.mean() < faults.missing:
        marker, length = int(random.integers(shape[1])), int(random.integers(3, longest + 1))
        start = int(random.integers(0, max(shape[0] - length, 1)))
        around = slice(max(start - 6, 0), start + length + 6)
        if not missing[around, marker].any():  # two gaps side by side would be a longer one
            missing[start : start + length, marker] = True
    return missing


def _swaps(
    seen: np.ndarray, truth: np.ndarray, count: int, random: np.random.Generator
) -> np.ndarray:
    """Exchange markers of ``seen`` that are neighbours, for 80 to 400 ms, and tell which and when (count, 4)."""
    rest = truth.mean(axis=0)
    far = np.linalg.norm(rest[:, None] - rest, axis=-1) + np.diag(np.full(len(rest), np.inf))
    busy: set[int] = set()
    rows: list[tuple[int, int, int, int]] = []
    while len(rows) < count:
        one = int(random.integers(len(rest)))
        two = int(np.argsort(far[one])[int(random.integers(2))])
        length = int(random.integers(10, 49))
        start = int(random.integers(2, len(seen) - length - 2))
        if busy & {one, two}:
            continue
        busy |= {one, two}
        part = seen[start : start + length]
        part[:, [one, two]] = part[:, [two, one]]
        rows.append((one, two, start, start + length))
    return np.array(rows, int).reshape(-1, 4)
