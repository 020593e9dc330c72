"""Fragments of recorded movement of many lengths, joined: sentences, words, syllables and diphones."""

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss.curves import STATIC_DELTA_DELTA2, derivatives, smoothing_spline
from dnnvss.features import phones_of
from dnnvss.phones import PHONES
from dnnvss.settings import check_settings, setting
from dnnvss.systems.base import Example, Prediction, VisualModel, pooled
from dnnvss.systems.cheapest import cheapest_path
from dnnvss.systems.codebook_units import OUTSIDE, neighbours, phone_distances, similarities
from dnnvss.systems.examples import speech_frames
from dnnvss.systems.fragment_joins import WEIGHTINGS, blended, overlaps, resampled, warped
from dnnvss.systems.fragment_units import UNITS, FragmentCorpus, Unit

_MOST_STRETCHED, _HARDLY = 1.5, 0.1
"""Largest stretch, and the share of its deviation that a coefficient must move in a sentence to tell it."""
_MARGIN = 2
"""Frames beyond a piece's overlap that its interpolant goes through too."""


@dataclass(frozen=True)
class FragmentSettings:
    """How fragments are chosen and joined."""

    units: tuple[str, ...] = setting(
        UNITS[:4], choices=UNITS, doc="what a fragment may be; any: every run of phones"
    )
    timing: float = setting(
        1.0, least=0, doc="weight of how much a fragment's phones must be stretched"
    )
    context: float = setting(
        1.0, least=0, doc="weight of how its neighbours differ from those wanted"
    )
    boundary: float = setting(
        0.0, least=0, doc="weight of how pieces differ where they meet: boundary conditions"
    )
    candidates: int = setting(
        30, least=1, doc="places of a unit that the search for boundaries weighs"
    )
    examples: int = setting(
        1, least=1, doc="places of each unit that are averaged; 1 plays a single recording"
    )
    overlap: float = setting(
        0.9, above=0, below=1, doc="length of a blend, as a share of the shortest phone near it"
    )
    weighting: str = setting("cosine", choices=WEIGHTINGS, doc="how one piece fades into the next")
    cutoff: float | None = setting(
        None, above=0, doc="Hz of a smoothing spline over the joins; null for none"
    )
    stretch: bool = setting(
        False, doc="give averages the talker's movement again, as validation sentences tell it"
    )
    own: bool = setting(
        True, doc="whether a sentence that is in the corpus may use its own movement"
    )

    def __post_init__(self) -> None:
        check_settings(self, "model")


@dataclass(frozen=True)
class Fragment:
    """A unit and the places that it is made of.

    Args:
        unit: of the sentence.
        places: its first phone in the corpus, the best place first.
        sentences: where these are from.
    """

    unit: Unit
    places: tuple[int, ...]
    sentences: tuple[str, ...]

    @property
    def best(self) -> "Fragment":
        """The same of its best place alone."""
        return replace(self, places=self.places[:1], sentences=self.sentences[:1])

    def described(self, codes: np.ndarray) -> dict[str, Any]:
        """The fragment of a sentence of phones (S,) as plain containers."""
        phones = [PHONES[c] for c in codes[self.unit.first : self.unit.last + 1]]
        told: dict[str, Any] = {
            "unit": self.unit.kind,
            "phones": "-".join(phones),
            "from": list(self.sentences),
        }
        if self.unit.stands:
            told["backed_off_to"] = "-".join(PHONES[c] for c in self.unit.stands)
        return told


class Fragments(VisualModel):
    """The longest recorded fragments that say a sentence, warped to its phones and blended at their joins.

    From the start on, the longest unit of the corpus with the wanted phones is taken, and the next begins with its last
    phone: pieces meet in the middle of a phone. Of several places the one whose phones are stretched least (mean
    squared logarithm) and whose neighbours look most alike is taken; with ``boundary`` the places of all units are
    chosen together, by dynamic programming, so that pieces agree where they meet. A diphone that the corpus has not is
    played by the nearest one by articulation, which :meth:`report` says.

    **Source**: Edge et al. 2004, section 5; boundary conditions are asked for in its conclusions, the back-off, the
    costs and the average of several places are ours.

    Args:
        table: the feature table of the labels; its columns are not used.
        clock: the trajectory clock.
        settings: see :class:`FragmentSettings`.
    """

    system = "fragments"
    reads = frozenset({"phones", "words"})
    looks_up = frozenset({"phones"})
    Settings = FragmentSettings
    settings: FragmentSettings
    _held: tuple[Fragment, ...] = ()

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Keep the training trajectories and measure how alike phones look; ``val`` tells the stretch.

        Raises:
            DnnvssError: no phone was measured throughout, or no two neighbouring ones.
        """
        corpus = FragmentCorpus.of(train)
        variance = np.maximum(pooled(train).var(0, dtype=np.float64), 1e-12)
        still = np.zeros(variance.shape[1]), np.ones(variance.shape[1])
        self._take(corpus, phone_distances(corpus.recorded), variance, *still)
        if self.settings.stretch and val:
            self._take(corpus, self.distances_, variance, *self._stretch_of(val))

    def _stretch_of(self, val: Sequence[Example]) -> tuple[np.ndarray, np.ndarray]:
        """The mean (D,) of what is said of validation sentences, and by how much (D,) it moves less.

        So stretched, its variance over the speech of a sentence is on average the talker's. The
        stretch lies between 1 and :data:`_MOST_STRETCHED`; sentences in which the talker hardly
        moved do not tell it.
        """
        said = [self.predict(e).mean[:, 0] for e in val]
        least = (_HARDLY**2) * self.variance_[0]
        ratios = []
        for e, x in zip(val, said, strict=True):
            targets, valid = e.measured
            kept = valid & speech_frames(e.alignment, self.clock)
            if kept.sum() > 1:
                true = targets[kept, 0].astype(float).var(axis=0)
                ratios.append(
                    np.where(true > least, x[kept].var(axis=0) / np.maximum(true, 1e-12), np.nan)
                )
        each = np.reshape(ratios, (len(ratios), len(least)))
        known = np.isfinite(each)
        share = np.where(known, each, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
        share = np.where(known.any(axis=0), share, 1.0)
        stretch = np.clip(1 / np.sqrt(np.maximum(share, 1e-12)), 1.0, _MOST_STRETCHED)
        return np.concatenate(said).mean(axis=0), stretch

    def predict(self, example: Example) -> Prediction:
        """The joined trajectory and its derivatives; the variance is a hundredth of the training frames'."""
        static = self.joined(example, self.fragments(example))
        if self.settings.cutoff is not None:
            static = smoothing_spline(static, self.clock, self.settings.cutoff)
        static = (static - self.centre_) * self.stretch_ + self.centre_
        mean = derivatives(static, STATIC_DELTA_DELTA2.first(len(self.variance_)))
        return Prediction(mean, np.broadcast_to(0.01 * self.variance_, mean.shape))

    def fragments(self, example: Example) -> list[Fragment]:
        """What each unit of a sentence is made of."""
        if self._held:
            return list(self._held)
        codes, frames = spoken_phones(example)
        recorded = self.corpus_.recorded
        own = (
            -1
            if self.settings.own or example.id not in recorded.ids
            else recorded.ids.index(example.id)
        )
        units = self.corpus_.units(codes, self.settings.units, own)
        rows = [self._candidates(unit, codes, frames) for unit in units]
        chosen = self._path(rows, units) if self.settings.boundary else [0] * len(rows)
        out = []
        for unit, (places, costs), k in zip(units, rows, chosen, strict=True):
            others = np.delete(np.arange(len(places)), k)[: self.settings.examples - 1]
            best = [int(places[i]) for i in (k, *others[np.isfinite(costs[others])])]
            out.append(
                Fragment(unit, tuple(best), tuple(recorded.ids[recorded.owner[p]] for p in best))
            )
        return out

    def playing(self, fragments: Sequence[Fragment]) -> "Fragments":
        """The same system, which plays these fragments whatever is asked for, as they were recorded."""
        made = copy(self)
        made._held, made.stretch_ = tuple(fragments), np.ones_like(self.stretch_)
        return made

    def report(self, example: Example) -> dict[str, Any]:
        """The unit, the phones and the sentences of each fragment, and what was backed off to."""
        codes, _ = spoken_phones(example)
        return {"fragments": [fragment.described(codes) for fragment in self.fragments(example)]}

    def joined(self, example: Example, fragments: Sequence[Fragment]) -> np.ndarray:
        """The blended trajectory (T, D) of fragments."""
        _, frames = spoken_phones(example)
        edges = np.append(0, np.cumsum(frames)).astype(float)
        middles = (edges[:-1] + edges[1:]) / 2
        joints = np.array([f.unit.last for f in fragments[:-1]], dtype=int)
        halves = overlaps(edges, joints, self.settings.overlap)
        pieces = []
        for k, fragment in enumerate(fragments):
            low = middles[fragment.unit.first] - halves[k - 1] if k else edges[0]
            high = middles[fragment.unit.last] + halves[k] if k < len(fragments) - 1 else edges[-1]
            start, stop = max(int(np.floor(low)), 0), min(int(np.ceil(high)), int(edges[-1]))
            wanted = np.arange(start, stop) + 0.5
            made = [self._played(place, fragment.unit, edges, wanted) for place in fragment.places]
            pieces.append((start, np.mean(made, axis=0)))
        return blended(pieces, middles[joints], halves, int(edges[-1]), self.settings.weighting)

    def _played(self, place: int, unit: Unit, edges: np.ndarray, wanted: np.ndarray) -> np.ndarray:
        """A recorded place at the times of a unit of the sentence (n, D)."""
        recorded, count = self.corpus_.recorded, unit.last - unit.first + 1
        first = recorded.first[place : place + count]
        source = np.append(first, first[-1] + recorded.frames[place + count - 1]).astype(float)
        target = edges[unit.first : unit.last + 2]
        owner = recorded.owner[place]
        low, high = recorded.bounds[owner], recorded.bounds[owner + 1]
        back = np.clip(warped(wanted, target, source) - 0.5, low, high - 1)
        taken = np.arange(max(low, int(back[0]) - _MARGIN), min(high, int(back[-1]) + _MARGIN + 2))
        return resampled(recorded.static[taken].astype(float), back - taken[0])

    def _candidates(
        self, unit: Unit, codes: np.ndarray, frames: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The best places (n,) of a unit and their costs (n,), the best first."""
        recorded, count = self.corpus_.recorded, unit.last - unit.first + 1
        inside = unit.at[:, None] + np.arange(count)
        ratios = np.log(recorded.frames[inside] / frames[unit.first : unit.last + 1])
        wanted = [
            codes[i] if 0 <= i < len(codes) else OUTSIDE for i in (unit.first - 1, unit.last + 1)
        ]
        before, after = self._sides[unit.at, 0], self._sides[unit.at + count - 1, 1]
        alike = (self._similar[wanted[0], before] + self._similar[wanted[1], after]) / 2
        costs = self.settings.timing * (ratios**2).mean(axis=1) + self.settings.context * (
            1 - alike
        )
        best = np.argsort(costs, kind="stable")[
            : max(self.settings.candidates, self.settings.examples)
        ]
        return unit.at[best], costs[best]

    def _path(
        self, rows: Sequence[tuple[np.ndarray, np.ndarray]], units: Sequence[Unit]
    ) -> list[int]:
        """The places of the least sum of costs and of differences where pieces meet, one of each row."""
        def joins() -> Iterator[np.ndarray]:
            for (one, two), left in zip(pairwise(rows), units[:-1], strict=True):
                ends, starts = self._middles(one[0] + left.last - left.first), self._middles(two[0])
                yield self.settings.boundary * ((ends[:, None] - starts) ** 2).mean(axis=-1)

        return cheapest_path([costs for _, costs in rows], joins())

    def _middles(self, phones: np.ndarray) -> np.ndarray:
        """What the recordings show in the middle of phones (n,), in standard deviations (n, D)."""
        recorded = self.corpus_.recorded
        seen = recorded.at(
            recorded.first[phones] + recorded.frames[phones] / 2 - 0.5, recorded.owner[phones]
        )
        return seen / np.sqrt(self.variance_[0])

    def state(self) -> dict[str, Any]:
        """The corpus, the distances between phones, the variance of the streams, and the stretch."""
        return {
            "corpus": self.corpus_.state(),
            "distances": self.distances_,
            "variance": self.variance_,
            "centre": self.centre_,
            "stretch": self.stretch_,
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over what another instance had learnt."""
        arrays = (state[name] for name in ("distances", "variance", "centre", "stretch"))
        self._take(FragmentCorpus.from_state(state["corpus"]), *arrays)

    def _take(
        self,
        corpus: FragmentCorpus,
        distances: np.ndarray,
        variance: np.ndarray,
        centre: np.ndarray,
        stretch: np.ndarray,
    ) -> None:
        self.corpus_, self.distances_, self.variance_ = corpus, distances, variance
        self.centre_, self.stretch_ = centre, stretch
        self._similar = similarities(distances, 1.0)
        self._sides = neighbours(corpus.recorded.code, corpus.recorded.owner, 1)


def spoken_phones(example: Example, every: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Codes (S,) and frames (S,) of the phones that own a frame, or of every phone."""
    phones = phones_of(example.codes)
    kept = phones.frames >= (0 if every else 1)
    return phones.code[kept], phones.frames[kept]
