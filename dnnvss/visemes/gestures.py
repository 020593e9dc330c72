"""Visible speech cut into gestures: where the mouth turns, and where it rests."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.phones import SILENCES
from dnnvss.settings import check_settings, setting
from dnnvss.timing import Alignment, FrameClock

RULES = ("speed", "acceleration")
LOOKS = ("points", "coefficients")


@dataclass(frozen=True)
class GestureSettings:
    """How trajectories are cut.

    Args:
        rule: ``speed`` cuts at minima of speed; ``acceleration`` where the acceleration changes sign.
        looks: at what: ``points`` of the face in pixels, or ``coefficients`` of the model, as the paper does.
        coefficients: how many of the leading coefficients are looked at; 0 for all.
        smoothing: standard deviation in seconds of the Gaussian that the trajectory is smoothed with.
        prominence: how clear a cut must be: for ``speed`` the depth of the minimum in nats (0.4: the speed falls by a
            third), for ``acceleration`` the change of velocity between two cuts, as a share of the reference speed.
        shortest: seconds; of two cuts that are closer the less clear one is given up.
        rest: a silence is rest where the speed is below this share of the reference speed.
        still: a rest that is entered or left smoothly begins and ends where the speed is below this share.
        rest_shortest: seconds; a shorter stillness is no rest.

    Raises:
        DnnvssError: an unknown rule or a negative number.
    """

    rule: str = setting("speed", choices=RULES)
    looks: str = setting("points", choices=LOOKS)
    coefficients: int = setting(0, least=0)
    smoothing: float = setting(0.01, least=0)
    prominence: float = setting(0.4, least=0)
    shortest: float = setting(0.06, least=0)
    rest: float = setting(0.35, least=0)
    still: float = setting(0.05, least=0)
    rest_shortest: float = setting(0.1, least=0)

    def __post_init__(self) -> None:
        check_settings(self, "visemes.gestures")


@dataclass(frozen=True)
class Gestures:
    """Contiguous pieces of a trajectory.

    Args:
        edges: (G + 1,) in frames of the trajectory, not rounded; edge ``e`` lies at time ``e / rate``. First 0, last T.
        rest: (G,) bool, the pieces in which the mouth rests.
    """

    edges: np.ndarray
    rest: np.ndarray

    def __len__(self) -> int:
        return len(self.rest)


def silence_mask(alignment: Alignment, clock: FrameClock) -> np.ndarray:
    """Return the frames (T,) bool that the tier ``phones`` gives to silence."""
    tier = alignment["phones"]
    return np.array([label in SILENCES for label in tier.labels])[tier.frame_index(clock)]


def reference_speed(trajectories: Iterable[np.ndarray], silences: Iterable[np.ndarray], clock: FrameClock,
                    settings: GestureSettings) -> float:
    """Return the RMS speed (coefficient units a second) outside silence, by which the settings measure speed.

    Args:
        trajectories: each (T, D).
        silences: each (T,) bool.

    Raises:
        DnnvssError: nothing but silence, or nothing moves.
    """
    moving = [_speed(y, clock, settings)[~quiet] for y, quiet in zip(trajectories, silences, strict=True)]
    speeds = np.concatenate(moving) if moving else np.zeros(0)
    reference = float(np.sqrt((speeds**2).mean())) if len(speeds) else 0.0
    if not reference > 0:
        raise DnnvssError("no movement outside silence to learn visemes from", remedy="Check alignments and parameters")
    return reference


def cut(trajectory: np.ndarray, silence: np.ndarray, clock: FrameClock, settings: GestureSettings,
        reference: float) -> Gestures:
    """Return the gestures of a trajectory.

    With rule ``speed`` cuts lie at the minima of ``|y'|``, placed between frames by a parabola. With ``acceleration``
    they lie where ``y''`` changes sign: for one coefficient the extremes of its velocity, for more the extremes of
    ``|y'|``, since there the acceleration along the path changes sign. Silences in which the mouth is nearly still are
    rest.

    Args:
        trajectory: (T, D).
        silence: (T,) bool; where all is True, rest is found by low speed alone.
        clock: of the trajectory.
        settings: see :class:`GestureSettings`.
        reference: from :func:`reference_speed`.

    **Source**: Thangthai 2016, section 3: cuts where "AAM acceleration coefficients change sign which identifies
    instances where visible articulators change direction". The first half of it is ``acceleration``, the second
    ``speed``.
    """
    frames = len(trajectory)
    if trajectory.ndim != 2 or not frames or silence.shape != (frames,) or not np.isfinite(trajectory).all():
        raise DnnvssError(f"a trajectory of shape {trajectory.shape} with silence {silence.shape} is not frames by "
                          "finite coefficients", remedy="Encode the video again")
    speed = _speed(trajectory, clock, settings)
    rate = float(clock.rate)
    runs = _rests(speed / reference, silence, settings, rate)
    places, clearness = _candidates(trajectory, speed, clock, settings, reference)
    still, inside = np.zeros(frames, dtype=bool), np.zeros(frames + 1, dtype=bool)  # frames, and edges with their ends
    for begin, end in runs:
        still[begin:end] = inside[begin : end + 1] = True
    free = ~inside[np.clip(places.round().astype(int), 0, frames)]
    places = np.concatenate([places[free], [float(e) for run in runs for e in run]])
    clearness = np.concatenate([clearness[free], np.full(2 * len(runs), np.inf)])
    edges = _thinned(places, clearness, frames, settings.shortest * rate)
    return Gestures(edges, _mostly(still, edges))


def _speed(trajectory: np.ndarray, clock: FrameClock, settings: GestureSettings) -> np.ndarray:
    return np.sqrt((_velocity(trajectory, clock, settings) ** 2).sum(axis=1))


def _velocity(trajectory: np.ndarray, clock: FrameClock, settings: GestureSettings) -> np.ndarray:
    """Return the velocity (T, K) of the smoothed leading coefficients, in units a second."""
    kept = trajectory[:, : settings.coefficients or None].astype(float)
    if len(kept) < 2:
        return np.zeros_like(kept)
    from scipy.ndimage import gaussian_filter1d  # slow to import, and synthesis needs none of it

    sigma = settings.smoothing * float(clock.rate)
    smooth = gaussian_filter1d(kept, sigma, axis=0, mode="nearest") if sigma > 0 else kept
    return np.gradient(smooth, axis=0) * float(clock.rate)


def _candidates(trajectory: np.ndarray, speed: np.ndarray, clock: FrameClock, settings: GestureSettings,
                reference: float) -> tuple[np.ndarray, np.ndarray]:
    """Return possible cuts in frames (edges, not rounded) and how clear each is."""
    if settings.rule == "speed":
        return _minima(np.log(speed + 1e-3 * reference), settings.prominence)
    velocity = _velocity(trajectory, clock, settings)
    signal = (velocity[:, 0] if velocity.shape[1] == 1 else speed) / reference
    low, high = _minima(signal, settings.prominence), _minima(-signal, settings.prominence)
    return np.concatenate([low[0], high[0]]), np.concatenate([low[1], high[1]])


def _minima(signal: np.ndarray, prominence: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the minima of a signal (T,), refined by a parabola, as frame edges, and their prominences."""
    from scipy.signal import find_peaks, peak_prominences  # slow to import, and synthesis needs none of it

    peaks, _ = find_peaks(-signal)
    depth = peak_prominences(-signal, peaks)[0] if len(peaks) else np.zeros(0)
    peaks, depth = peaks[depth >= prominence], depth[depth >= prominence]
    before, at, after = signal[peaks - 1], signal[peaks], signal[peaks + 1]
    bend = before - 2 * at + after
    shift = np.where(bend > 0, (before - after) / np.where(bend > 0, 2 * bend, 1), 0)
    return peaks + 0.5 + np.clip(shift, -0.5, 0.5), depth


def _rests(speed: np.ndarray, silence: np.ndarray, settings: GestureSettings, rate: float) -> list[tuple[int, int]]:
    """Return the rests as half-open runs of frames; ``speed`` is relative to the reference."""
    found = []
    for begin, end in _runs(silence & (speed < settings.rest)):
        first, last = begin, end - 1
        while begin > 0 and first < last and speed[first] > settings.still and speed[first + 1] < speed[first]:
            first += 1
        while end < len(speed) and last > first and speed[last] > settings.still and speed[last - 1] < speed[last]:
            last -= 1
        if last + 1 - first >= settings.rest_shortest * rate:
            found.append((first, last + 1))
    return found


def _runs(mask: np.ndarray) -> list[tuple[int, int]]:
    """Return the half-open runs of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _thinned(places: np.ndarray, clearness: np.ndarray, frames: int, shortest: float) -> np.ndarray:
    """Return edges from 0 to ``frames`` with no piece shorter than ``shortest``: the least clear cuts go first."""
    order = np.argsort(places, kind="stable")
    kept = [(float(places[i]), float(clearness[i])) for i in order if 0 < places[i] < frames]
    while kept:
        edges = np.array([0, *(place for place, _ in kept), frames])
        piece = int(np.diff(edges).argmin())
        if edges[piece + 1] - edges[piece] >= shortest:
            break
        borders = [i for i in (piece - 1, piece) if 0 <= i < len(kept)]
        del kept[min(borders, key=lambda i: kept[i][1])]
    return np.array([0.0, *(place for place, _ in kept), float(frames)])


def _mostly(mask: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return for each piece whether most of its frames are True."""
    total = np.concatenate([[0], np.cumsum(mask)])
    inside = np.diff(np.interp(edges, np.arange(len(total)), total))
    return inside > 0.5 * np.diff(edges)
