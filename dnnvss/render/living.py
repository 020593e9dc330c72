"""A talker's face that lives: eyes and head learnt from the recordings, and drawn over the neutral picture."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from dnnvss.corpus import Corpus, Utterance
from dnnvss.face.aam import ActiveAppearanceModel, ClipCode
from dnnvss.face.base import Face
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.face.pose import to_image, to_reference
from dnnvss.life import (
    EyeModel,
    EyeRegion,
    Life,
    Moves,
    Tracks,
    blink_threshold,
    shut_share,
    speech_contexts,
)
from dnnvss.media import read_video
from dnnvss.render.finer import FinerPicture, finer_places, finer_times
from dnnvss.render.footage import talker_model
from dnnvss.render.neutral import Neutral
from dnnvss.render.patch import bounds
from dnnvss.timing import FrameClock, fill_invalid

_MOST = 160
"""Clips that are looked at, evenly spaced."""
_MODELLED, _A_CLIP = 60, 20
"""Clips that the part model of the eyes is fitted to, and frames of each."""
_OPEN_PERCENTILE, _OPEN = 80, 0.85
"""The percentile of the opening in a clip that counts as open, and the share of it from which eyes are."""
_USUAL = 90
"""The percentile of open eyes' distance from the clip's usual ones up to which they are told as a difference."""
_HEAD, _NECK = 1.1, 0.7
"""How far the head reaches, in distances of its farthest landmark, and over how much more the picture comes to rest."""
_BORDER = 12.0
"""Pixels at the picture's border over which it comes to rest."""
_TOGETHER = 16
"""Pictures whose eyes are made together: their modes pass through the cache once for all of them."""


_FILE = "life-2.npz"
"""Beside an encoding; the number is another where what is learnt is."""


def kept_life(corpus: Corpus, encoded: EncodedCorpus) -> Path | None:
    """The file of the talker's life, learnt where it is not kept yet beside the encoding; None where there is none.

    Args:
        corpus: the prepared corpus.
        encoded: its encoding.
    """
    path = encoded.folder / _FILE
    if path.is_file():
        return path
    life = learn_life(corpus, encoded)
    return life.save(path) if life else None


def living_picture(face: Face, ground: Path, life: Life, scale: float = 1.0) -> "LivingPicture":
    """What draws a life over the pictures of a face.

    Args:
        face: an active appearance model.
        ground: the file of what it is drawn into.
        life: of the talker.
        scale: size of the pictures over their usual size.

    Raises:
        DnnvssError: the face has no picture, or the file is damaged.
    """
    return LivingPicture(life, talker_model(face), Neutral.load(ground), scale)


@dataclass(frozen=True)
class _Recorded:
    """A clip under the model: its utterance, code, how far the eyes are open (F,), and which frames count (F,)."""

    utterance: Utterance
    code: ClipCode
    opening: np.ndarray
    valid: np.ndarray

    @property
    def open(self) -> np.ndarray:
        """(F,) bool, frames with open eyes."""
        return self.valid & (self.opening >= _OPEN)


def learn_life(corpus: Corpus, encoded: EncodedCorpus) -> Life | None:
    """How the talker's eyes and head move in the train split; None where no landmarks run round the eyes.

    Args:
        corpus: the prepared corpus.
        encoded: its encoding by an active appearance model.
    """
    model = encoded.face
    if not isinstance(model, ActiveAppearanceModel) or not model.layout.eyes:
        return None
    ids = [i for i in encoded.splits["train"] if i not in encoded.dropped]
    clips = [clip for i in ids[:: -(-len(ids) // _MOST)] if (clip := _recorded(model, corpus, encoded, i))]
    if not clips:
        return None
    region = EyeRegion.around(_usual_rings(model, corpus, clips))
    eyes = EyeModel.fit(region, np.concatenate(_examples(model, region, corpus, clips)))
    rate = float(clips[0].utterance.rate)
    same = [clip for clip in clips if float(clip.utterance.rate) == rate]
    coded = [eyes.code(_looks(model, region, corpus, c)) for c in same]
    edges = np.cumsum([0, *map(len, coded)])
    tracks = Tracks(edges, *_told(coded, same), np.concatenate([c.opening for c in same]),
                    np.concatenate([head_track(c.code.pose, model) for c in same]),
                    np.concatenate([_contexts(c.utterance, len(c.opening)) for c in same]), rate)
    return Life(eyes, tracks)


def _recorded(model: ActiveAppearanceModel, corpus: Corpus, encoded: EncodedCorpus, name: str) -> _Recorded | None:
    """A clip, None where its eyes were never seen open."""
    utterance, code = corpus.utterances[name], encoded.clip(name)
    assert isinstance(code, ClipCode)
    points, found = corpus.landmarks(utterance)
    valid = found & code.valid
    return _Recorded(utterance, code, eye_opening(model, points, valid), valid) if valid.sum() > 1 else None


def eye_opening(model: ActiveAppearanceModel, points: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """How far the eyes are open (F,), 1 for the clip's open ones, from landmarks (F, L, 2); gaps are bridged."""
    share = np.mean([np.ptp(points[:, r, 1], axis=1) / np.maximum(np.ptp(points[:, r, 0], axis=1), 1e-6)
                     for r in model.layout.eyes], axis=0)
    share = fill_invalid(share[:, None], valid)[:, 0]
    return share / max(float(np.percentile(share[valid], _OPEN_PERCENTILE)), 1e-6)


def head_track(pose: np.ndarray, model: ActiveAppearanceModel) -> np.ndarray:
    """How the head lies (F, 4) against the clip's mean pose, from poses (F, 4): see :class:`dnnvss.life.Tracks`."""
    turn, centre = pose[:, 0] + 1j * pose[:, 1], pose.mean(axis=0)
    against = turn / complex(centre[0], centre[1]) - 1
    shift = (pose[:, 2:] - centre[2:]) / max(float(np.hypot(*centre[:2])), 1e-6)
    return np.column_stack([against.real, against.imag, shift])


def _usual_rings(model: ActiveAppearanceModel, corpus: Corpus, clips: Sequence[_Recorded]) -> list[np.ndarray]:
    """The points (n, 2) round each open eye in the reference frame."""
    shapes = [to_reference(corpus.landmarks(c.utterance)[0].astype(float), c.code.pose, model.reference.pivot)[c.open]
              for c in clips if c.open.any()]
    middle = np.median(np.concatenate(shapes), axis=0)
    return [middle[rows] for rows in model.layout.eyes]


def _looks(model: ActiveAppearanceModel, region: EyeRegion, corpus: Corpus, clip: _Recorded) -> np.ndarray:
    """How the eyes look (F, H, W_, 3) beside the light of their clip.

    Frames that were not measured look as their neighbours.
    """
    images = read_video(corpus.path(clip.utterance, "video"))
    at = to_image(region.points[None], clip.code.pose, model.reference.pivot)
    seen = np.stack([region.read(image, place) for image, place in zip(images, at, strict=True)])
    known = np.flatnonzero(clip.valid)
    nearest = known[np.abs(known - np.arange(len(at))[:, None]).argmin(axis=1)]
    return seen[nearest] - region.light(np.median(seen[clip.open if clip.open.any() else clip.valid], axis=0))


def _examples(model: ActiveAppearanceModel, region: EyeRegion, corpus: Corpus, clips: Sequence[_Recorded]
              ) -> list[np.ndarray]:
    """Looks that the part model is fitted to: of each clip the most shut frames, and others evenly spaced."""
    found = []
    for clip in clips[:: -(-len(clips) // _MODELLED)]:
        known = np.flatnonzero(clip.valid)
        shut = known[np.argsort(clip.opening[known], kind="stable")][: _A_CLIP // 2]
        spaced = known[np.linspace(0, len(known) - 1, _A_CLIP // 2).astype(int)]
        found.append(_looks(model, region, corpus, clip)[np.union1d(shut, spaced)])
    return found


def _told(coded: Sequence[np.ndarray], clips: Sequence[_Recorded]) -> tuple[np.ndarray, np.ndarray]:
    """Eyes (F, K) and how far they are told as they look (F,), from the coefficients of clips: see :class:`Tracks`.

    A difference from open eyes is told as far as it is small; a large one laid over other open eyes would leave an iris
    on a lid, and a brow beside a brow.
    """
    stills = [np.median(c[clip.open if clip.open.any() else clip.valid], axis=0)
              for c, clip in zip(coded, clips, strict=True)]
    away = [np.linalg.norm(c - still, axis=1) for c, still in zip(coded, stills, strict=True)]
    known = np.concatenate([own[clip.open] for own, clip in zip(away, clips, strict=True)])
    usual = max(float(np.percentile(known, _USUAL)), 1e-6) if len(known) else 1e-6
    far = np.clip(np.concatenate(away) / usual - 1, 0, 1)
    opening = np.concatenate([clip.opening for clip in clips])
    whole = np.maximum(shut_share(opening, blink_threshold(opening)), far * far * (3 - 2 * far))
    still = np.repeat(stills, [len(c) for c in coded], axis=0)
    return np.concatenate(coded) - (1 - whole)[:, None] * still, whole


def _contexts(utterance: Utterance, frames: int) -> np.ndarray:
    return speech_contexts(utterance.alignment, utterance.text, FrameClock(utterance.rate), frames)


class LivingPicture:
    """Draws movements of eyes and head over pictures of the neutral frame.

    What the eyes' part model says is added, fading out at its region's rim, and as far as it tells how the eyes look,
    the neutral frame's own detail there is taken away but for its light. Then the picture is moved with the head:
    wholly within the face, less and less beside it, not at all at the picture's border.

    Args:
        life: of the talker.
        model: whose frame the life is in.
        neutral: the frame that is drawn into.
        scale: size of the pictures over the neutral frame's.
    """

    def __init__(self, life: Life, model: ActiveAppearanceModel, neutral: Neutral, scale: float = 1.0) -> None:
        height, width = neutral.image.shape[:2]
        self._scale, self._size = scale, (max(1, round(width * scale)), max(1, round(height * scale)))
        self._pivot = neutral.pose[2:] * scale
        self._reach = scale * float(np.hypot(*neutral.pose[:2]))
        self._place_eyes(life, model, neutral)
        self._place_head(neutral.points * scale)

    def _place_eyes(self, life: Life, model: ActiveAppearanceModel, neutral: Neutral) -> None:
        """Lay the modes of the eyes into the neutral picture, once."""
        region, pivot = life.model.region, model.reference.pivot
        seen = to_image(region.points, neutral.pose, pivot)
        own = region.read(neutral.image, seen)
        without = region.weight[..., None] * (region.light(own) - own)
        modes = [without, *life.model.modes.reshape(-1, *region.weight.shape, 3)]
        left, top, right, bottom = bounds((seen + 0.5) * self._scale, self._size)
        x, y = np.meshgrid(np.arange(left, right), np.arange(top, bottom))
        pixels = (np.stack([x, y], axis=-1).reshape(-1, 2) + 0.5) / self._scale - 0.5
        at = (to_reference(pixels, neutral.pose, pivot) - region.origin) / region.step
        across, down = np.moveaxis(at.reshape(*x.shape, 2).astype(np.float32), -1, 0)
        self._box = (slice(top, bottom), slice(left, right))
        self._modes = np.stack([cv2.remap(m, across, down, cv2.INTER_CUBIC, borderMode=cv2.BORDER_CONSTANT)
                                for m in modes]).reshape(len(modes), -1)

    def _place_head(self, points: np.ndarray) -> None:
        """Where pixels move with the head, and their places, moments about the pivot and shares (5, h, w) there.

        All three are counted in pixels of the finer picture that is read.
        """
        x, y = np.arange(self._size[0]), np.arange(self._size[1])[:, None]
        far = float(np.linalg.norm(points - self._pivot, axis=1).max())
        ramp = np.hypot(x - self._pivot[0], y - self._pivot[1])
        ramp = np.clip((_HEAD + _NECK - ramp / max(far, 1e-6)) / _NECK, 0, 1)
        edge = np.minimum(np.minimum(x, x[::-1]), np.minimum(y, y[::-1]))
        weight = ramp**2 * (3 - 2 * ramp) * np.clip(edge / (_BORDER * self._scale), 0, 1)
        rows, columns = (np.flatnonzero(weight.any(axis=axis)) for axis in (1, 0))
        self._turns = (slice(rows.min(initial=0), rows.max(initial=-1) + 1),
                       slice(columns.min(initial=0), columns.max(initial=-1) + 1))
        weight, y, x = weight[self._turns], y[self._turns[0]], x[self._turns[1]]
        self._times = finer_times(self._size)
        self._ways = np.empty((5, *weight.shape), np.float32)
        self._ways[0], self._ways[1] = finer_places(x, self._times), finer_places(y, self._times)
        self._ways[4] = self._times * weight
        self._ways[2], self._ways[3] = self._ways[4] * (x - self._pivot[0]), self._ways[4] * (y - self._pivot[1])

    def over(self, pictures: Iterator[np.ndarray], moves: Moves, moving: tuple[slice, slice] | None = None
             ) -> Iterator[np.ndarray]:
        """Yield the pictures, uint8 RGB (H, W_, 3), with the movements of a row each.

        Args:
            pictures: what is drawn over.
            moves: of eyes and head.
            moving: rows and columns in which the pictures differ; all of them where None.
        """
        finer: FinerPicture | None = None
        for picture, eyes, head in zip(pictures, self._eyes(moves.eyes), moves.head, strict=True):
            drawn = picture.copy()
            drawn[self._box] = cv2.add(drawn[self._box], eyes, dtype=cv2.CV_8U)
            if finer is None:
                finer = FinerPicture.of(drawn, self._times)
            else:
                finer.take(drawn, _around(self._box, moving))
            yield self._turned(drawn, finer, head)

    def _eyes(self, eyes: np.ndarray) -> Iterator[np.ndarray]:
        """Yield what is added to each picture where the eyes are, (h, w, 3) float32, for rows (F, 1 + K)."""
        rows, columns = self._box
        for start in range(0, len(eyes), _TOGETHER):
            added = eyes[start : start + _TOGETHER].astype(np.float32) @ self._modes
            yield from added.reshape(len(added), rows.stop - rows.start, columns.stop - columns.start, 3)

    def _turned(self, picture: np.ndarray, finer: "FinerPicture", head: np.ndarray) -> np.ndarray:
        """A picture of one's own, moved with the head: each pixel is read where the movement, as far as it goes there,
        had it."""
        back = 1 / complex(1 + head[0], head[1])
        shift = back * complex(*head[2:]) * self._reach
        turn = back - 1
        shares = np.array([[1, 0, turn.real, -turn.imag, -shift.real],
                           [0, 1, turn.imag, turn.real, -shift.imag]], np.float32)
        across, down = np.tensordot(shares, self._ways, axes=1)
        if across.size:
            picture[self._turns] = finer.read(across, down)
        return picture


def _around(box: tuple[slice, slice], moving: tuple[slice, slice] | None) -> tuple[slice, slice] | None:
    """Rows and columns that hold both; None where all of them are moving."""
    if moving is None:
        return None
    rows, columns = (slice(min(a.start, b.start), max(a.stop, b.stop)) for a, b in zip(box, moving, strict=True))
    return rows, columns
