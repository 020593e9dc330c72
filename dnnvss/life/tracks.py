"""What was recorded of the talker's eyes and head, clip after clip, and the file that keeps it."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, read_declared
from dnnvss.errors import DnnvssError
from dnnvss.life.blinks import Blink, BlinkRates, blink_threshold, find_blinks
from dnnvss.life.contexts import CONTEXTS
from dnnvss.life.eyes import EyeModel, EyeRegion

_BEFORE, _AFTER = 2, 3
"""Frames beside a blink, at 25 a second, that belong to it: the lids are on their way."""
_REMEDY = "Train the run again"
_ARRAYS = {
    "edges": Held(("C",), "i"), "eyes": Held(("F", "K")), "whole": Held(("F",)), "opening": Held(("F",)),
    "head": Held(("F", 4)), "context": Held(("F",), "ui"), "rate": Held(), "origin": Held((2,)), "step": Held(),
    "eye": Held(), "weight": Held(("H", "W")), "modes": Held(("K", "N"))}


@dataclass(frozen=True)
class Tracks:
    """Recorded clips, one after the other.

    Args:
        edges: frame at which each clip begins, and the number of all frames (C + 1,).
        eyes: coefficients (F, K) of the eyes' part model, less those of the clip's open eyes as far as they are not
            ``whole``.
        whole: how far the eyes are told as they look (F,), from 0, as a difference from open eyes, to 1.
        opening: of the eyes (F,), 1 for the clip's open ones.
        head: (F, 4) how the head lies against the clip's mean: turn and scale as a complex number less 1 (real and
            imaginary part), and shift x, y in pixels of the reference frame.
        context: code (F,) of :data:`~dnnvss.life.contexts.CONTEXTS`.
        rate: frames a second.
    """

    edges: np.ndarray
    eyes: np.ndarray
    whole: np.ndarray
    opening: np.ndarray
    head: np.ndarray
    context: np.ndarray
    rate: float

    def __len__(self) -> int:
        """The number of clips."""
        return len(self.edges) - 1

    def __iter__(self) -> Iterator[slice]:
        """The frames of each clip."""
        return (slice(int(a), int(b)) for a, b in zip(self.edges[:-1], self.edges[1:], strict=True))

    @cached_property
    def blinks(self) -> list[list[Blink]]:
        """The blinks of each clip, whose frames are counted from the clip's first."""
        threshold = blink_threshold(self.opening)
        if threshold is None:
            return [[] for _ in self]
        return [find_blinks(self.opening[clip], threshold, self.rate) for clip in self]

    @cached_property
    def recorded(self) -> list[tuple[slice, int]]:
        """Every blink: the frames of its clip, and which of its blinks it is."""
        return [(clip, i) for clip, own in zip(self, self.blinks, strict=True) for i in range(len(own))]

    @cached_property
    def blinking(self) -> np.ndarray:
        """(F,) bool, frames with shut eyes and those beside them."""
        before, after = (max(1, round(n * self.rate / 25)) for n in (_BEFORE, _AFTER))
        shut = self.opening < (blink_threshold(self.opening) or 0.0)
        found = np.zeros(len(shut), bool)
        for clip in self:
            for frame in np.flatnonzero(shut[clip]):
                found[clip][max(frame - before, 0) : frame + after + 1] = True
        return found

    @cached_property
    def awake(self) -> np.ndarray:
        """How far eyes are told as they look, and coefficients (F, 1 + K), with blinks bridged by straight lines."""
        lids = np.column_stack([self.whole, self.eyes])
        for clip in self:
            bare = np.flatnonzero(~self.blinking[clip])
            if 0 < len(bare) < clip.stop - clip.start:
                at = np.flatnonzero(self.blinking[clip])
                behind = np.searchsorted(bare, at)
                before, after = bare[np.maximum(behind - 1, 0)], bare[np.minimum(behind, len(bare) - 1)]
                share = np.clip((at - before) / np.maximum(after - before, 1), 0, 1)[:, None]
                own = lids[clip]
                own[at] = own[before] + share * (own[after] - own[before])
        return lids


@dataclass(frozen=True)
class Life:
    """All that is known of how the talker lives beside speech: the part model of the eyes, and what was recorded."""

    model: EyeModel
    tracks: Tracks

    @cached_property
    def rates(self) -> BlinkRates:
        """How often the talker blinks where."""
        tracks = self.tracks
        clips = [(tracks.context[clip], blinks) for clip, blinks in zip(tracks, tracks.blinks, strict=True)]
        return BlinkRates.fit(clips, tracks.rate)

    def save(self, path: Path) -> Path:
        """Write all of it as ``.npz`` and return the path."""
        region, tracks = self.model.region, self.tracks
        return files.write_arrays(
            path, edges=tracks.edges, eyes=tracks.eyes.astype(np.float16),
            whole=tracks.whole.astype(np.float16), opening=tracks.opening.astype(np.float32),
            head=tracks.head.astype(np.float32), context=tracks.context.astype(np.uint8), rate=np.array(tracks.rate),
            origin=region.origin, step=np.array(region.step), eye=np.array(region.eye), weight=region.weight,
            modes=self.model.modes.astype(np.float16))

    @classmethod
    def load(cls, path: Path) -> "Life":
        """What :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing or damaged.
        """
        a = read_declared(path, _ARRAYS, _REMEDY)
        frames, edges = len(a["opening"]), a["edges"]
        whole = len(edges) > 1 and edges[0] == 0 and edges[-1] == frames and (np.diff(edges) > 0).all()
        if not whole or a["context"].max(initial=0) >= len(CONTEXTS) or a["modes"].shape[1] != 3 * a["weight"].size:
            raise DnnvssError("its clips, contexts or modes do not fit each other", file=path, remedy=_REMEDY)
        region = EyeRegion(a["origin"], float(a["step"]), float(a["eye"]), a["weight"])
        tracks = Tracks(edges, a["eyes"].astype(np.float32), a["whole"].astype(np.float32), a["opening"],
                        a["head"], a["context"].astype(int), float(a["rate"]))
        return cls(EyeModel(region, a["modes"].astype(np.float32)), tracks)
