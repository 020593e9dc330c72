"""From what each frame suggests to one sequence of dynamic visemes with its times: a semi-Markov model."""

from dataclasses import dataclass

import numpy as np

from dnnvss.settings import check_settings, setting
from dnnvss.visemes.grammar import Grammar


@dataclass(frozen=True)
class DecodingSettings:
    """What counts how much.

    Args:
        frames: weight of the log posteriors of units, summed over frames; neighbouring frames say the same thing, which
            a weight below 1 allows for.
        prior: how much of the units' log share is taken from these posteriors, 0 to 1.
        cuts: weight of the log odds of a cut.
        durations: weight of the log probabilities of durations.
        follow: weight of the bigram.

    Raises:
        DnnvssError: a negative weight.
    """

    frames: float = setting(0.3, least=0)
    prior: float = setting(0.5, least=0)
    cuts: float = setting(1.0, least=0)
    durations: float = setting(1.0, least=0)
    follow: float = setting(1.0, least=0)

    def __post_init__(self) -> None:
        check_settings(self, "visemes.predictor.decoding")


@dataclass(frozen=True)
class Evidence:
    """What the frames of an utterance suggest.

    Args:
        units: (T, U), log posterior of each unit in each frame.
        cuts: (T,), log odds that a gesture begins with the frame; the first is not looked at.
    """

    units: np.ndarray
    cuts: np.ndarray


def viterbi(evidence: Evidence, grammar: Grammar, settings: DecodingSettings) -> tuple[np.ndarray, np.ndarray]:
    """Return the best sequence: its frame edges (G + 1,) from 0 to T, and its units (G,).

    It maximises the sum, over gestures, of ``frames * (log p(u | x_t) - prior log p(u))`` over their frames,
    ``cuts * log odds`` of a cut where they begin, ``durations * log p(length | u)`` and ``follow * log p(u | unit
    before)``. Time grows as T (U^2 + L U).

    **Source**: Murphy, "Hidden semi-Markov models", 2002, section 3.
    """
    lattice = _Lattice(evidence, grammar, settings, np.max)
    return lattice.path(lambda scores: int(scores.argmax()))


def sample(evidence: Evidence, grammar: Grammar, settings: DecodingSettings, count: int,
           seed: int = 0) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return ``count`` sequences as :func:`viterbi` does, drawn with the probability that the same score gives them."""
    lattice = _Lattice(evidence, grammar, settings, _log_sum)
    random = np.random.default_rng(seed)

    def drawn(scores: np.ndarray) -> int:
        return int((scores + random.gumbel(size=len(scores))).argmax())

    return [lattice.path(drawn) for _ in range(count)]


class _Lattice:
    """Scores of everything up to each frame, by maximum or by sum, and a walk back through them."""

    def __init__(self, evidence: Evidence, grammar: Grammar, settings: DecodingSettings,
                 join: "np.ufunc | object") -> None:
        scaled = settings.frames * (evidence.units - settings.prior * grammar.share)
        frames, units = scaled.shape
        self.total = np.concatenate([np.zeros((1, units)), np.cumsum(scaled, axis=0)])
        self.follow, self.last = settings.follow * grammar.follow, settings.follow * grammar.last
        self.length = settings.durations * grammar.duration
        self.cuts = settings.cuts * evidence.cuts
        self.enter = np.full((frames, units), -np.inf)  # a gesture of the unit begins with the frame; before its frames
        self.leave = np.full((frames + 1, units), -np.inf)  # ... ends before the frame
        self.enter[0] = settings.follow * grammar.first
        for t in range(1, frames + 1):
            self.leave[t] = self.total[t] + join(self._begun(t), axis=0)  # type: ignore[operator]
            if t < frames:
                self.enter[t] = self.cuts[t] + join(self.leave[t][:, None] + self.follow, axis=0)  # type: ignore[operator]

    def _begun(self, end: int) -> np.ndarray:
        """Return (d, U): the scores of gestures that end before a frame, less ``total[end]``, by length from 1."""
        start = max(0, end - len(self.length))
        return (self.enter[start:end] - self.total[start:end])[::-1] + self.length[: end - start]

    def path(self, choose: object) -> tuple[np.ndarray, np.ndarray]:
        """Return edges and units of one sequence; ``choose`` picks one of the scores of all ways that lead on."""
        end = len(self.enter)
        unit = choose(self.leave[end] + self.last)  # type: ignore[operator]
        edges, units = [end], []
        while True:
            end -= 1 + choose(self._begun(end)[:, unit])  # type: ignore[operator]
            edges.append(end)
            units.append(unit)
            if end == 0:
                return np.array(edges[::-1]), np.array(units[::-1])
            unit = choose(self.leave[end] + self.follow[:, unit])  # type: ignore[operator]


def _log_sum(scores: np.ndarray, axis: int) -> np.ndarray:
    highest = scores.max(axis=axis)
    return highest + np.log(np.exp(scores - highest).sum(axis=axis))
