"""Dynamic visemes: units learnt from the gestures of a talker, and the tier that they make of a trajectory."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from dnnvss.archives import Held, check_arrays
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Face
from dnnvss.settings import check_settings, read_settings, setting
from dnnvss.timing import Alignment, FrameClock, Tier
from dnnvss.visemes.clusters import METHODS, Method, partition
from dnnvss.visemes.gestures import Gestures, GestureSettings, cut, reference_speed, silence_mask

REST = 0
"""The number of the unit of rest; the others are numbered from 1, the most frequent first."""
TIER = "visemes"
_HELD = {"view": Held(("D", "M")), "scale": Held(("D",)), "centres": Held(("V", "R", "D")),
         "means": Held(("U", "R", "D")), "seconds": Held(("U",)), "counts": Held(("U",), "iu")}
_ARRAYS = tuple(_HELD)


@dataclass(frozen=True)
class VisemeSettings:
    """How units are learnt.

    Args:
        units: number of dynamic visemes, rest included.
        method: ``kmeans`` or ``dtw``.
        length: samples R that a gesture is brought to.
        whitening: coefficients are divided by this power of their standard deviation: 0 leaves them in their own units,
            1 lets all count the same.
        least: gestures that a unit needs.
        starts: the best of so many starts is kept.
        seed: of the starts.
        gestures: how trajectories are cut.

    Raises:
        DnnvssError: an unknown method, or a number out of its range.
    """

    units: int = setting(160, least=2)
    method: str = setting("kmeans", choices=METHODS)
    length: int = setting(8, least=2)
    whitening: float = setting(0.5)
    least: int = setting(10, least=1)
    starts: int = setting(3, least=1)
    seed: int = setting(0, least=0)
    gestures: GestureSettings = setting(GestureSettings())

    def __post_init__(self) -> None:
        check_settings(self, "visemes")

    @classmethod
    def from_config(cls, config: Mapping[str, Any]) -> "VisemeSettings":
        """The settings in plain containers; a key ``name`` has no effect.

        Raises:
            DnnvssError: a key or value that is not known.
        """
        return read_settings(cls, {key: value for key, value in config.items() if key != "name"}, "visemes")


@dataclass(frozen=True)
class Movement:
    """What units are learnt from.

    Args:
        trajectory: of an utterance, (T, D).
        silence: its silences, (T,) bool.
        span: where it begins and ends, in seconds; 0 and the end of the last frame where left out.
        valid: (T,) bool, the frames that were measured; all where left out. Nothing is learnt from others.
    """

    trajectory: np.ndarray
    silence: np.ndarray
    span: tuple[float, float] | None = None
    valid: np.ndarray | None = None

    @property
    def known(self) -> np.ndarray:
        """The measured frames (T,)."""
        return np.ones(len(self.trajectory), bool) if self.valid is None else self.valid


def aligned_clip(trajectory: np.ndarray, alignment: Alignment, clock: FrameClock) -> Movement:
    """Return the clip of a trajectory (T, D) whose silences an alignment tells."""
    return Movement(trajectory, silence_mask(alignment, clock), (alignment.start, alignment.end))


@dataclass(frozen=True)
class Visemes:
    """Units learnt from a talker. Build with :func:`learn`.

    Args:
        settings: how they were learnt; ``settings.units`` is the number asked for, ``len()`` what became of it.
        rate: frames a second of the trajectories, as text.
        reference: reference speed, see :func:`~dnnvss.visemes.gestures.reference_speed`.
        view: (D, M), what is looked at when trajectories are cut, see :func:`learn`.
        scale: (D,) by which coefficients are multiplied before gestures are compared.
        centres: (U - 1, R, D) scaled centres of the units 1 to U - 1.
        means: (U, R, D) mean gesture of every unit in coefficient units, rest first.
        seconds: (U,) mean duration of every unit.
        counts: (U,) how many gestures each unit was learnt from.
    """

    settings: VisemeSettings
    rate: str
    reference: float
    view: np.ndarray
    scale: np.ndarray
    centres: np.ndarray
    means: np.ndarray
    seconds: np.ndarray
    counts: np.ndarray

    def __len__(self) -> int:
        """The number of units U, rest included."""
        return len(self.means)

    def gestures(self, clip: Movement) -> Gestures:
        """Return the gestures of a clip."""
        seen = clip.trajectory @ self.view
        return cut(seen, clip.silence, FrameClock(self.rate), self.settings.gestures, self.reference)

    def classify(self, clip: Movement, gestures: Gestures) -> np.ndarray:
        """Return the unit (G,) of each gesture of a clip."""
        units = np.full(len(gestures), REST)
        if (moving := ~gestures.rest).any():
            scaled = shapes(clip.trajectory, gestures.edges, self.settings.length)[moving] * self.scale
            units[moving] = 1 + METHODS[self.settings.method]().distances(scaled, self.centres).argmin(axis=1)
        return units

    def tier(self, clip: Movement) -> Tier:
        """Return the tier ``visemes`` of a clip; labels are unit numbers, and it spans what the clip spans.

        Neighbouring rests are one. Edges are in seconds and not rounded to frames.
        """
        gestures = self.gestures(clip)
        return viseme_tier(gestures.edges, self.classify(clip, gestures), FrameClock(self.rate), clip.span)

    def describe(self) -> dict[str, Any]:
        """Return plain containers and arrays for a checkpoint."""
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        return {"settings": asdict(self.settings), "rate": self.rate, "reference": self.reference, **arrays}

    @classmethod
    def from_description(cls, description: Mapping[str, Any]) -> "Visemes":
        """Return the units that :meth:`describe` described.

        Raises:
            DnnvssError: an array is absent or of another shape.
        """
        arrays = {name: np.asarray(description[name]) for name in _ARRAYS if name in description}
        check_arrays(arrays, _HELD, None, "Train the run anew")
        check_arrays(arrays, {"centres": Held((len(arrays["means"]) - 1, ...))}, None, "Train the run anew")
        settings = VisemeSettings.from_config(description["settings"])
        return cls(settings, str(description["rate"]), float(description["reference"]), **arrays)


def learn(clips: Sequence[Movement], clock: FrameClock, settings: VisemeSettings | None = None,
          view: np.ndarray | None = None) -> Visemes:
    """Return the dynamic visemes of a talker.

    Gestures are cut from every clip, brought to one length by linear interpolation, scaled and clustered. Those that
    rest have a unit of their own and take no part in the clustering.

    Args:
        clips: of the training utterances.
        clock: of their trajectories.
        settings: see :class:`VisemeSettings`.
        view: (D, M); gestures are cut by the speed of ``trajectory @ view``. With
            :func:`point_view` that is the speed of the face's points in its unit. The coefficients
            themselves where left out.

    Raises:
        DnnvssError: nothing moves outside silence, or there are too few gestures.

    **Source**: Thangthai 2016, section 3; distance and algorithm are not stated there and are ours.
    """
    settings = settings or VisemeSettings()
    if not clips:
        raise DnnvssError("no clip to learn visemes from", remedy="Give at least one training utterance")
    view = np.eye(clips[0].trajectory.shape[1]) if view is None else view
    reference = reference_speed((c.trajectory @ view for c in clips), (c.silence | ~c.known for c in clips), clock,
                                settings.gestures)
    scale = _scale(clips, settings.whitening)
    pieces = [_pieces(c, cut(c.trajectory @ view, c.silence, clock, settings.gestures, reference), settings.length)
              for c in clips]
    found, rest, frames = (np.concatenate(part) for part in zip(*pieces, strict=True))
    del pieces
    moving = found[~rest]
    moving *= scale
    method: Method = METHODS[settings.method]()
    result = partition(moving, settings.units - 1, method, settings.least, settings.starts, settings.seed)
    order = np.argsort(-np.bincount(result.members), kind="stable")
    units = np.full(len(found), REST)
    units[~rest] = 1 + np.argsort(order)[result.members]
    means, seconds, counts = _summary(found, frames / float(clock.rate), units, len(order) + 1)
    return Visemes(settings, str(clock), reference, view, scale, result.centres[order], means, seconds, counts)


def gesture_view(face: Face, settings: GestureSettings) -> np.ndarray | None:
    """Return what :func:`learn` is to look at by the settings: the points of the face, or the coefficients (None).

    Raises:
        DnnvssError: leading coefficients are asked for where points are looked at, or the face has no points.
    """
    if settings.looks == "coefficients":
        return None
    if settings.coefficients:
        raise DnnvssError(f"visemes: gestures.coefficients={settings.coefficients} with gestures.looks=points",
                          remedy="Set visemes.gestures.looks=coefficients, or coefficients to 0")
    if not face.jacobian().shape[1]:
        raise DnnvssError(f"a face of the kind {face.kind} has no points to look at",
                          remedy="Set visemes.gestures.looks=coefficients")
    return point_view(face)


def point_view(face: Face) -> np.ndarray:
    """Return the view (D, 2 P) in which coefficients are the points of the face, in its unit.

    Texture is left out: teeth and tongue come and go while the lips stand still, and blur where the mouth turns.
    """
    return face.jacobian().reshape(len(face.names), -1)


def _measured(known: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Which pieces (G,) of a movement hold no frame that was not measured."""
    total = np.concatenate([[0], np.cumsum(~known)])
    return total[np.ceil(edges[1:]).astype(int)] == total[np.floor(edges[:-1]).astype(int)]


def _pieces(clip: Movement, gestures: Gestures, length: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shapes (G, R, D), rest (G,) and frames (G,) of the gestures of a clip that hold measured frames alone."""
    measured = _measured(clip.known, gestures.edges)
    return (shapes(clip.trajectory, gestures.edges, length)[measured], gestures.rest[measured],
            np.diff(gestures.edges)[measured])


def _scale(clips: Sequence[Movement], whitening: float) -> np.ndarray:
    deviation = np.concatenate([c.trajectory[c.known] for c in clips]).std(axis=0)
    return np.where(deviation > 0, deviation, 1.0) ** -whitening


def _summary(found: np.ndarray, seconds: np.ndarray, units: np.ndarray, count: int) -> tuple[np.ndarray, ...]:
    """Return the mean gesture, the mean duration and the number of gestures of each unit; zeros where there is none."""
    counts = np.bincount(units, minlength=count)
    total = np.zeros((count, *found.shape[1:]))
    np.add.at(total, units, found)
    divisor = np.maximum(counts, 1)
    return total / divisor[:, None, None], np.bincount(units, seconds, minlength=count) / divisor, counts


def shapes(trajectory: np.ndarray, edges: np.ndarray, length: int) -> np.ndarray:
    """Return each piece of a trajectory (T, D) at ``length`` evenly spaced times, (G, R, D).

    Piece ``g`` runs from frame edge ``edges[g]`` to ``edges[g + 1]``; sample ``r`` lies in the middle of its ``r``-th
    part. Between frame centres the values are interpolated linearly.
    """
    parts = (np.arange(length) + 0.5) / length
    places = edges[:-1, None] + np.diff(edges)[:, None] * parts - 0.5
    places = np.clip(places, 0, len(trajectory) - 1)
    before = np.floor(places).astype(int)
    share = (places - before)[..., None]
    return trajectory[before] * (1 - share) + trajectory[np.minimum(before + 1, len(trajectory) - 1)] * share


def viseme_tier(edges: np.ndarray, units: np.ndarray, clock: FrameClock,
                span: tuple[float, float] | None = None) -> Tier:
    """Return the tier ``visemes`` of units (G,) between frame edges (G + 1,), neighbouring rests joined.

    Args:
        edges: in frames, 0 first.
        units: their numbers.
        clock: of the frames.
        span: where the tier begins and ends in seconds, which need not be edges of frames.

    Raises:
        DnnvssError: there is no gesture.
    """
    if not len(units):
        raise DnnvssError("a trajectory without gestures has no visemes", remedy="Give at least one frame")
    first = np.flatnonzero(np.concatenate([[True], (units[1:] != units[:-1]) | (units[1:] != REST)]))
    times = clock.times(np.append(edges[:-1][first], edges[-1])) + (span[0] if span else 0.0)
    if span:
        times[-1] = span[1]
    return Tier(TIER, zip(times[:-1].tolist(), times[1:].tolist(), [str(u) for u in units[first]], strict=True))
