"""Hidden Markov models of one talker's phones, learnt from a first alignment, that align anew and better.

An aligner for everybody has never heard the talker. Three states a phone, each a mixture of Gaussians over cepstra
every 5 ms, are learnt from its segmentation of the corpus (Viterbi training: segment, estimate, segment again).
Boundaries become consistent from clip to clip, which is what a model that learns faces from phones lives on.

**Source**: L. Rabiner, "A tutorial on hidden Markov models", Proc. IEEE 77(2), 1989, section VI (segmental k-means).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice, pairwise, product
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, read_declared
from dnnvss.phones import SHORT_PAUSE, SILENCE
from dnnvss.speech.align_features import HOP
from dnnvss.speech.align_onset import Run, limit_of, longest
from dnnvss.speech.align_tiers import Piece

STATES = 3
"""States of a phone."""

_FLOOR = 0.02
"""Least variance of a state, as a share of the variance of all frames."""

_PRIOR = 5.0
"""Frames that the prior variance counts for."""

_AGAIN = 3
"""Times that phones which last too long behind a silence are held shorter: their ends may move with their starts."""

_WAYS = 16
"""Largest number of combinations of pronunciations that are tried for a sentence."""

Phones = tuple[str, ...]

VERSION = 2
"""Of a voice in a file, and of how it is learnt."""


@dataclass(frozen=True)
class Voice:
    """The states of a talker's phones.

    Args:
        phones: the phones that are known; state ``s`` of phone ``p`` is row ``STATES * p + s``.
        mean, precision: (Q, K, 39) of each Gaussian.
        weight: (Q, K) log weight with the Gaussian's normalisation; -inf where a state has fewer than K.
        stay, go: (Q,) log probabilities of staying in a state and of leaving it.
        longest: (P,) seconds a phone lasts behind a silence at most, inf where nothing tells.
    """

    phones: Phones
    mean: np.ndarray
    precision: np.ndarray
    weight: np.ndarray
    stay: np.ndarray
    go: np.ndarray
    longest: np.ndarray

    def emissions(self, features: np.ndarray) -> np.ndarray:
        """Return the log likelihood (T, Q) float32 of every frame of features (T, 39) in every state."""
        count, mixtures, width = self.mean.shape
        precision, mean = (x.swapaxes(0, 1).reshape(-1, width) for x in (self.precision, self.mean))
        quadratic = (features**2) @ precision.T - 2 * features @ (precision * mean).T + (precision * mean**2).sum(-1)
        each = (self.weight.T.reshape(-1) - 0.5 * quadratic).reshape(len(features), mixtures, count)
        top = each.max(axis=1)
        each -= top[:, None]
        return np.asarray(top + np.log(np.exp(each, out=each).sum(axis=1)), np.float32)

    def write(self, path: Path) -> Path:
        """Write the voice as npz and return the path."""
        return files.write_arrays(path, phones=np.array(self.phones), mean=self.mean, precision=self.precision,
                                  weight=self.weight, stay=self.stay, go=self.go, longest=self.longest)

    @classmethod
    def read(cls, path: Path) -> "Voice":
        """Return the voice that :meth:`write` wrote."""
        declared = {"phones": Held(("P",), "U"), "mean": Held(("Q", "K", "C")), "precision": Held(("Q", "K", "C")),
                    "weight": Held(("Q", "K"), finite=False), "stay": Held(("Q",)), "go": Held(("Q",)),
                    "longest": Held(("P",), finite=False)}
        arrays = read_declared(path, declared, "Prepare the corpus again")
        return cls(tuple(str(p) for p in arrays.pop("phones")), **arrays)


def learn(features: Sequence[np.ndarray], states: Sequence[np.ndarray], phones: Phones, mixtures: int = 4) -> Voice:
    """Return the voice in which each frame belongs to a given state.

    Gaussians of a state are the cells of a k-means of its frames; silence has twice as many. A state with few frames
    has fewer Gaussians, and its variances lean on those of all frames.

    Args:
        features: (T, 39) of each clip.
        states: (T,) of each clip, rows as in :class:`Voice`.
        phones: the phones, silence among them.
        mixtures: Gaussians of a state.
    """
    frames, owner = np.concatenate(features), np.concatenate(states)
    variance = frames.var(axis=0).astype(float)
    count, width = STATES * len(phones), frames.shape[1]
    mean, precision = np.zeros((count, 2 * mixtures, width)), np.ones((count, 2 * mixtures, width))
    weight = np.full((count, 2 * mixtures), -np.inf)
    order = np.argsort(owner, kind="stable")
    starts = np.searchsorted(owner[order], np.arange(count + 1))
    for q in range(count):
        own = frames[order[starts[q] : starts[q + 1]]]
        cells = mixtures * (2 if phones[q // STATES] == SILENCE else 1)
        for k, cell in enumerate(_cells(own if len(own) else frames[:: max(1, len(frames) // 100)], cells, variance)):
            spread = np.maximum((cell.var(axis=0) * len(cell) + variance * _PRIOR) / (len(cell) + _PRIOR),
                                _FLOOR * variance)
            mean[q, k], precision[q, k] = cell.mean(axis=0), 1 / spread
            weight[q, k] = np.log(len(cell) / max(len(own), len(cell))) - 0.5 * np.log(2 * np.pi * spread).sum()
    visits = sum(np.bincount(s[np.concatenate([[True], s[1:] != s[:-1]])], minlength=count) for s in states)
    length = np.maximum(np.bincount(owner, minlength=count) / np.maximum(visits, 1), 1.05)
    limits = longest([_runs(s, phones) for s in states])
    single = partial(np.asarray, dtype=np.float32)
    return Voice(phones, single(mean), single(precision), single(weight), single(np.log(1 - 1 / length)),
                 single(np.log(1 / length)), np.array([limit_of(phone, limits) for phone in phones]))


def _runs(states: np.ndarray, phones: Phones) -> list[Run]:
    """The phones that states (T,) run through, in seconds."""
    begins = np.flatnonzero((np.diff(states // STATES) != 0) | (np.diff(states) < 0)) + 1
    edges = [0, *begins.tolist(), len(states)]
    return [(phones[states[a] // STATES], a * HOP, b * HOP) for a, b in pairwise(edges)]


def _cells(frames: np.ndarray, count: int, variance: np.ndarray) -> list[np.ndarray]:
    """Return the frames of each cell of a k-means, at least five frames each."""
    count = max(1, min(count, len(frames) // 40))
    scaled = frames / np.sqrt(variance).astype(np.float32)
    centres = scaled[np.random.default_rng(0).permutation(len(scaled))[:count]]
    cell = np.zeros(len(frames), int)
    for _ in range(8 if count > 1 else 0):
        cell = ((centres**2).sum(axis=1) - 2 * scaled @ centres.T).argmin(axis=1)
        centres = np.stack([scaled[cell == k].mean(axis=0) if (cell == k).any() else centres[k] for k in range(count)])
    kept = [frames[cell == k] for k in range(count) if (cell == k).sum() >= 5]
    return kept or [frames]


@dataclass(frozen=True)
class Chain:
    """The states of a sentence in a row, with pauses between words that may be left out.

    Args:
        pieces: phone and index of its word (-1 in silence), in turn.
        states: (N,) row of the voice.
        owner: (N,) index of the piece.
        jump: (N,) the state before a pause from which this state may be entered directly, or -1.
        first, last: (N,) frames between which the state is allowed.
    """

    pieces: tuple[tuple[str, int], ...]
    states: np.ndarray
    owner: np.ndarray
    jump: np.ndarray
    first: np.ndarray
    last: np.ndarray


def chain(words: Sequence[Phones], voice: Phones, bounds: Sequence[tuple[float, float]] | None = None,
          slack: float = 0.2) -> Chain:
    """Return the chain of a sentence: silence, the words with pauses between them, silence.

    Args:
        words: the phones of each word.
        voice: the phones of the voice.
        bounds: start and end of each word in seconds, where known.
        slack: seconds by which a word may leave its bounds.
    """
    pieces: list[tuple[str, int]] = [(SILENCE, -1)]
    for index, phones in enumerate(words):
        pieces += [(SHORT_PAUSE, -1)] * bool(index) + [(phone, index) for phone in phones]
    pieces.append((SILENCE, -1))
    rows = {phone: STATES * k for k, phone in enumerate(voice)} | {SHORT_PAUSE: STATES * voice.index(SILENCE)}
    states = np.concatenate([rows[phone] + np.arange(STATES) for phone, _ in pieces])
    owner = np.repeat(np.arange(len(pieces)), STATES)
    jump = np.full(len(states), -1)
    first, last = np.zeros(len(states), int), np.full(len(states), np.iinfo(np.int64).max)
    for k, (phone, word) in enumerate(pieces):
        if phone == SHORT_PAUSE:
            jump[STATES * (k + 1)] = STATES * k - 1
        if bounds is not None and word >= 0:
            first[owner == k] = int((bounds[word][0] - slack) / HOP)
            last[owner == k] = int((bounds[word][1] + slack) / HOP)
    return Chain(tuple(pieces), states, owner, jump, first, last)


def best_paths(
    voice: Voice, emissions: Sequence[np.ndarray], chains: Sequence[Chain]
) -> list[tuple[np.ndarray, float]]:
    """Return for each clip the best path through its chain, (T,) positions in the chain, and its log likelihood.

    The clips are worked on side by side: one step for all of them is a handful of array operations.

    Args:
        voice: stay and go of the states.
        emissions: (T, Q) of each clip.
        chains: the chain of each clip.
    """
    clips, frames, width = len(chains), max(map(len, emissions)), max(len(c.states) for c in chains)
    seen = np.zeros((frames, clips, width), np.float32)
    states, jump = np.zeros((clips, width), int), np.full((clips, width), -1)
    for b, (e, c) in enumerate(zip(emissions, chains, strict=True)):
        n, time = len(c.states), np.arange(len(e))[:, None]
        seen[: len(e), b, :n] = np.where((time < c.first) | (time > c.last), -1e4, e[:, c.states])
        states[b, :n], jump[b, :n] = c.states, c.jump
    stay, go = voice.stay[states], voice.go[states]
    entered = np.flatnonzero(jump >= 0)  # of all clips in one row, like the states that they are entered from
    source = (np.arange(clips)[:, None] * width + np.maximum(jump, 0)).ravel()[entered]
    score = np.full((clips, width), -1e30, np.float32)
    score[:, 0] = seen[0, :, 0]
    moves, scores = np.zeros((frames, clips, width), np.uint8), np.zeros((frames, clips), np.float32)
    ends, each = np.array([len(c.states) - 1 for c in chains]), np.arange(clips)
    leave, before = np.empty_like(score), np.full_like(score, -1e30)
    for t in range(frames):
        if t:
            np.add(score, go, out=leave)
            before[:, 1:] = leave[:, :-1]
            np.add(score, stay, out=score)
            np.greater(before, score, out=moves[t], casting="unsafe")
            np.maximum(score, before, out=score)
            over = leave.ravel()[source]
            better = over > score.ravel()[entered]
            score.ravel()[entered[better]] = over[better]
            moves[t].ravel()[entered[better]] = 2
            score += seen[t]
        scores[t] = score[each, ends]
    return [(_back(moves[: len(e), b], c), float(scores[len(e) - 1, b]))
            for b, (e, c) in enumerate(zip(emissions, chains, strict=True))]


def _back(moves: np.ndarray, line: Chain) -> np.ndarray:
    path, position = np.empty(len(moves), int), len(line.states) - 1
    for t in range(len(moves) - 1, -1, -1):
        path[t] = position
        position = (position, position - 1, line.jump[position])[moves[t, position]]
    return path


def segment(voice: Voice, features: Sequence[np.ndarray], sentences: Sequence[Sequence[Sequence[Phones]]],
            bounds: Sequence[Sequence[tuple[float, float]] | None], slack: float = 0.2,
            ) -> list[tuple[list[Piece], np.ndarray, np.ndarray]]:
    """Return for each clip its pieces, the state (T,) of each frame, and how well each frame fits (T,).

    The fit of a frame is the log likelihood of its state less that of the best state of all, so at most 0.

    Args:
        voice: the talker's phones.
        features: (T, 39) of each clip.
        sentences: the pronunciations of each word of each clip; the sound chooses among them.
        bounds: start and end of each word in seconds, where known.
        slack: seconds by which a word may leave its bounds.
    """
    emissions = [voice.emissions(f) for f in features]
    jobs = [(k, chain(way, voice.phones, bounds[k], slack))
            for k, words in enumerate(sentences) for way in islice(product(*words), _WAYS)]
    found = best_paths(voice, [emissions[k] for k, _ in jobs], [c for _, c in jobs])
    best: dict[int, tuple[float, Chain, np.ndarray]] = {}
    for (k, line), (path, score) in zip(jobs, found, strict=True):
        if k not in best or score > best[k][0]:
            best[k] = (score, line, path)
    paths = {k: (line, path) for k, (_, line, path) in best.items()}
    for _ in range(_AGAIN):
        tight = {k: c for k, (line, path) in paths.items() if (c := _held(line, path, voice)) is not None}
        again = best_paths(voice, [emissions[k] for k in tight], list(tight.values())) if tight else []
        paths |= {k: (c, path) for (k, c), (path, _) in zip(tight.items(), again, strict=True)}
    results = []
    for k, e in enumerate(emissions):
        line, path = paths[k]
        states = line.states[path]
        results.append((_pieces(line, path), states, e[np.arange(len(e)), states] - e.max(axis=1)))
    return results


def _held(line: Chain, path: np.ndarray, voice: Voice) -> Chain | None:
    """A chain in which no phone begins so early behind a silence as it did; None where none lasts too long."""
    owner = line.owner[path]
    edges = np.concatenate([[0], np.flatnonzero(np.diff(owner)) + 1, [len(owner)]])
    first = line.first.copy()
    for start, end in list(pairwise(edges))[1:]:
        (phone, word), (_, before) = (line.pieces[owner[t]] for t in (start, start - 1))
        most = voice.longest[voice.phones.index(phone)] / HOP if word >= 0 > before else np.inf
        if end - start > most:
            places = line.owner == owner[start]
            first[places] = np.maximum(first[places], end - int(most))
    return None if (first == line.first).all() else replace(line, first=first)


def _pieces(line: Chain, path: np.ndarray) -> list[Piece]:
    owner = line.owner[path]
    edges = np.concatenate([[0], np.flatnonzero(np.diff(owner)) + 1, [len(owner)]])
    return [(*line.pieces[owner[a]], a * HOP, b * HOP) for a, b in pairwise(edges)]


def first_states(pieces: Sequence[Piece], count: int, phones: Phones) -> np.ndarray:
    """Return the state (T,) of each frame when every piece is cut into three equal parts."""
    rows = {phone: STATES * k for k, phone in enumerate(phones)} | {SHORT_PAUSE: STATES * phones.index(SILENCE)}
    states = np.full(count, rows[SILENCE])
    for phone, _, start, end in pieces:
        a, b = (min(round(t / HOP), count) for t in (start, end))
        states[a:b] = rows[phone] + np.arange(b - a) * STATES // max(b - a, 1)
    return states
