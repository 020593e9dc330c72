"""Recorded pieces played again: the examples of each phone from the most similar contexts, blended and smoothed."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss.curves import STATIC_DELTA_DELTA2, derivatives, smoothing_spline
from dnnvss.features import phones_of
from dnnvss.phones import PHONES
from dnnvss.settings import check_settings, setting
from dnnvss.systems.base import Example, Prediction, VisualModel, pooled
from dnnvss.systems.codebook_units import Inventory, neighbours, phone_distances, similarities, stand_ins


@dataclass(frozen=True)
class Choice:
    """What one phone of a sentence was made of.

    Args:
        phone: as wanted.
        used: the phone that was searched for: another one where the corpus has no example of ``phone``.
        entries: indices of the phones of the corpus, best first.
        weights: their shares, which sum to 1.
        utterances: where they come from.
    """

    phone: str
    used: str
    entries: tuple[int, ...]
    weights: tuple[float, ...]
    utterances: tuple[str, ...]

    def described(self) -> dict[str, Any]:
        """Return the choice as plain containers."""
        shares = dict.fromkeys(self.utterances, 0.0)
        for utterance, weight in zip(self.utterances, self.weights, strict=True):
            shares[utterance] += weight
        return {"phone": self.phone, "used": self.used, "from": {u: round(w, 3) for u, w in shares.items()}}


@dataclass(frozen=True)
class CodebookSettings:
    """What a codebook averages and how smooth it is."""

    examples: int = setting(3, least=1, doc="examples of a phone that are averaged (n)")
    context: int = setting(1, least=0, doc="phones to each side that are compared (C)")
    gamma: float = setting(1.0, least=0, doc="spread of similarities; distances are in units of the median distance")
    cutoff: float | None = setting(None, above=0, doc="Hz at which the smoothing spline halves an oscillation")
    own: bool = setting(True, doc="whether a sentence that is in the corpus may use its own entry")

    def __post_init__(self) -> None:
        check_settings(self, "model")


class Codebook(VisualModel):
    """Trajectories of the ``examples`` best examples of each phone, warped to its duration, averaged and joined.

    An example's score is ``sum over i from 1 to C of (S_left_i + S_right_i) / (i + 1)``, with the similarity ``S`` of
    the i-th neighbours; among equal scores the example of the nearest duration comes first. Shares in the average are
    proportional to the scores. A phone that the corpus has not takes the examples of the nearest phone by articulation;
    :meth:`choices` reports it.

    **Source**: Theobald et al. 2003, sections 4 and 5.

    Args:
        table: the feature table of the labels; its columns are not used.
        clock: the trajectory clock.
        settings: see :class:`CodebookSettings`.
    """

    system = "codebook"
    reads = frozenset({"phones"})
    looks_up = frozenset({"phones"})
    Settings = CodebookSettings
    settings: CodebookSettings

    def fit(self, train: Sequence[Example], val: Sequence[Example], folder: Path) -> None:
        """Keep the training trajectories and measure how alike phones look; ``val`` and ``folder`` are not needed.

        Raises:
            DnnvssError: no phone was measured throughout.
        """
        corpus = Inventory.of(train)
        variance = np.maximum(pooled(train).var(0, dtype=np.float64), 1e-12)
        self._take(corpus, phone_distances(corpus), variance)

    def predict(self, example: Example) -> Prediction:
        """Return the joined trajectory and its derivatives; the variance is a hundredth of the training frames'.

        Mean streams are derivatives of one another, so parameter generation returns the trajectory as it stands.
        """
        static = self.smoothed(self.joined(example, self.choices(example)))
        mean = self.streams(static)
        return Prediction(mean, np.broadcast_to(0.01 * self.variance_, mean.shape))

    def choices(self, example: Example) -> list[Choice]:
        """Return the selection report: what each phone that owns a frame is made of."""
        phones = phones_of(example.codes)
        codes, frames = phones.code, phones.frames
        wanted = neighbours(codes, np.zeros(len(codes), dtype=np.int64), self.settings.context)
        own = -1 if self.settings.own or example.id not in self.corpus_.ids else self.corpus_.ids.index(example.id)
        return [self._choice(codes[p], wanted[p], frames[p], own) for p in np.flatnonzero(frames)]

    def report(self, example: Example) -> dict[str, Any]:
        """Return which sentences each phone came from, and their shares."""
        return {"selection": [c.described() for c in self.choices(example)]}

    def entries(self, code: int) -> np.ndarray:
        """Return all examples (n,) of a phone, or of the nearest phone by articulation where it has none."""
        return self._entries[int(self._stands[code])]

    def joined(self, example: Example, choices: Sequence[Choice]) -> np.ndarray:
        """Return the static trajectory (T, D) of the choices, warped, averaged and joined, without smoothing."""
        frames = phones_of(example.codes).frames
        frames = frames[frames > 0]
        most = max(len(choice.entries) for choice in choices)
        entries = np.array([[*c.entries, *[c.entries[0]] * (most - len(c.entries))] for c in choices])
        weights = np.array([[*c.weights, *[0.0] * (most - len(c.weights))] for c in choices])
        phone = np.repeat(np.arange(len(frames)), frames)
        elapsed = np.arange(len(phone)) - np.repeat(np.cumsum(frames) - frames, frames)
        return self.warped(entries[phone], elapsed, frames[phone], weights[phone])

    def warped(self, entries: np.ndarray, elapsed: np.ndarray, frames: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Return the weighted mean (T, D) of entries (T, n) at frame ``elapsed`` of ``frames`` (T,) of their phone."""
        corpus = self.corpus_
        share = ((elapsed + 0.5) / frames)[:, None]
        times = corpus.first[entries] + corpus.frames[entries] * share - 0.5
        out = np.zeros((len(entries), corpus.static.shape[1]))
        for k in range(entries.shape[1]):  # one at a time: bounds memory on long text
            owner = corpus.owner[entries[:, k]]
            out += weights[:, k, None] * corpus.at(times[:, k], owner)
        return out

    def smoothed(self, static: np.ndarray) -> np.ndarray:
        """The smoothing spline near a trajectory (T, D); without a cutoff, the trajectory itself."""
        cutoff = self.settings.cutoff
        return static if cutoff is None else smoothing_spline(static, self.clock, cutoff)

    def streams(self, static: np.ndarray) -> np.ndarray:
        """A trajectory (T, D) with the derivatives that the targets have, (T, W, D)."""
        return derivatives(static, STATIC_DELTA_DELTA2.first(len(self.variance_)))

    def state(self) -> dict[str, Any]:
        """Return the corpus, the distances between phones and the variance of the streams."""
        return {"corpus": self.corpus_.state(), "distances": self.distances_,
                "variance": self.variance_}

    def load_state(self, state: dict[str, Any]) -> None:
        """Take over the corpus."""
        self._take(Inventory.from_state(state["corpus"]), state["distances"], state["variance"])

    def _take(self, corpus: Inventory, distances: np.ndarray, variance: np.ndarray) -> None:
        """Take over what was learnt, and index what follows from it."""
        self.corpus_, self.distances_, self.variance_ = corpus, distances, variance
        known = np.unique(corpus.code[corpus.usable])
        self._stands = stand_ins(known)
        self._similar = similarities(distances, self.settings.gamma)
        self._contexts = corpus.contexts(self.settings.context)
        self._entries = {int(code): np.flatnonzero(corpus.usable & (corpus.code == code)) for code in known}

    def candidates(self, code: int, context: np.ndarray, frames: int, own: int,
                   count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the entries (n,) of the best ``count`` examples of a phone, best first, and their scores (n,).

        Args:
            code: of the phone.
            context: codes (2 C,) of its neighbours.
            frames: wanted duration.
            own: an utterance of the corpus that is left out, or -1; it serves where nothing else has the phone.
            count: how many at most.
        """
        entries = self.entries(code)
        others = entries[self.corpus_.owner[entries] != own]
        entries = others if len(others) else entries
        near = np.tile(np.arange(1, self.settings.context + 1), 2)
        scores = (self._similar[context, self._contexts[entries]] / (near + 1)).sum(1)
        apart = np.abs(self.corpus_.frames[entries] - frames)
        best = np.lexsort((apart, -scores.round(12)))[:count]
        return entries[best], scores[best]

    def _choice(self, code: int, context: np.ndarray, frames: int, own: int) -> Choice:
        entries, scores = self.candidates(code, context, frames, own, self.settings.examples)
        total = scores.sum()
        weights = scores / total if total > 0 else np.full(len(scores), 1 / len(scores))
        origin = tuple(self.corpus_.ids[u] for u in self.corpus_.owner[entries])
        return Choice(PHONES[code], PHONES[self._stands[code]], tuple(entries.tolist()), tuple(weights.tolist()),
                      origin)
