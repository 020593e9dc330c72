"""Lips that are heard: regressions from the sound of clips to the movements of the lips, cross-fitted.

From many clips a small network learns it, from few a Gaussian process, which needs less to learn from and sees less of
the sound at once. Both read mel cepstra and say the leading movements of the lips.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dnnvss.progress import counted
from dnnvss.speech.align_features import HOP

MANY = 60
"""Clips from which the network learns."""
MODES = 6
"""Leading movements of the lips that are heard."""
EVERY = 2
"""Cepstra from one heard frame to the next: 100 a second."""

_FOLDS, _HIDDEN, _STEPS, _BATCH, _CLIPS, _RATE = 4, 128, 1000, 512, 16, 3e-3
_DROPPED = 26
"""Inputs of 256 that are dropped: a tenth."""
_MEAN, _SQUARE, _DECAY = 0.9, 0.999, 0.01
"""Of Adam, as its authors have them."""
_CONTEXT = np.arange(-48, 49, 6)
"""Cepstra that the network hears together: a quarter of a second to either side."""
_NEAR = np.arange(-12, 13, 4)
"""Cepstra that the Gaussian process hears together: 60 ms to either side."""
_PARTS, _THIN, _MOST = 10, 4, 2500
"""Parts that are left out in turn; every fourth frame of speech is learnt from, and so many at most."""
_SOME = 500
"""Frames from which the typical distance of two is measured."""
_WIDTH, _NOISE, _WHITENING = 0.5, 0.3, 0.5
"""Of the kernel, in typical distances of two frames; variance that is not heard; how alike all cepstra count. These and
the context were chosen on parts of ten and twenty clips of GRID's s1, whose lags 899 clips tell."""


@dataclass(frozen=True)
class SyncClip:
    """One clip, heard and seen.

    Args:
        sound: cepstra (N, 39), 200 a second.
        lips: seconds to the lips' leading movements (n, K), each of unit deviation over the corpus.
        spoken: (M,) bool, the heard frames (100 a second) from where speech begins to where it ends.
    """

    sound: np.ndarray
    lips: Callable[[np.ndarray], np.ndarray]
    spoken: np.ndarray

    @property
    def times(self) -> np.ndarray:
        """Seconds (M,) of the heard frames."""
        return (np.arange(0, len(self.sound), EVERY) + 0.5) * HOP

    def heard(self, around: np.ndarray) -> np.ndarray:
        """The cepstra (M, C) around each heard frame."""
        at = np.arange(0, len(self.sound), EVERY)[:, None] + around
        return self.sound[np.clip(at, 0, len(self.sound) - 1)].reshape(len(at), -1)


def crossfitted(clips: Mapping[str, SyncClip]) -> dict[str, np.ndarray]:
    """The lips (M, K) of each clip as they were heard by a regression that has not seen the clip."""
    return _by_network(clips) if len(clips) >= MANY else _by_kernel(clips)


def _by_network(clips: Mapping[str, SyncClip]) -> dict[str, np.ndarray]:
    names = list(clips)
    order = np.random.default_rng(0).permutation(len(names))
    scale = np.tile(np.concatenate([clips[n].sound[::20] for n in names]).std(axis=0) + 1e-6, len(_CONTEXT))
    lips = [clips[n].lips(clips[n].times).astype(np.float32) for n in names]
    heard = dict[str, np.ndarray]()
    for fold in counted(range(_FOLDS), "hearing the lips", unit="parts"):
        held = set(order[fold::_FOLDS].tolist())
        learnt = [k for k in range(len(names)) if k not in held]
        network = _Network.fit([clips[names[k]].sound for k in learnt], [lips[k] for k in learnt],
                               scale.astype(np.float32), fold)
        heard |= {names[k]: network(clips[names[k]].heard(_CONTEXT)) for k in held}
    return heard


def _around(sound: np.ndarray, centres: np.ndarray) -> np.ndarray:
    """The cepstra (n, C) around some of a sound."""
    return sound[np.clip(centres[:, None] + _CONTEXT, 0, len(sound) - 1)].reshape(len(centres), -1)


@dataclass(frozen=True)
class _Network:
    """A layer of tanh units and a linear one: weights (C, H) and (H, K), each with a last row that is added.

    What goes in is divided by ``scale`` (C,). It is so small that a library for networks takes longer to hand its
    arrays on than to multiply them.
    """

    scale: np.ndarray
    first: np.ndarray
    second: np.ndarray

    def __call__(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(_layer(np.tanh(_layer(x / self.scale, self.first)), self.second))

    @classmethod
    def fit(cls, sounds: Sequence[np.ndarray], lips: Sequence[np.ndarray], scale: np.ndarray,
            seed: int) -> "_Network":
        """The network with the least squared error, by Adam with a rate that falls to nothing along a cosine.

        A tenth of the inputs is dropped. **Source**: Kingma and Ba, "Adam", ICLR 2015; Loshchilov and Hutter,
        "Decoupled weight decay regularization", ICLR 2019.

        Args:
            sounds: cepstra (N, 39) of each clip.
            lips: movements (M, K) of each clip.
            scale: deviations (C,) of what goes in.
            seed: of what is drawn.
        """
        random = np.random.default_rng(seed)
        sizes = (len(scale), _HIDDEN, lips[0].shape[1])
        made = [random.uniform(-1, 1, (n + 1, m)).astype(np.float32) / np.float32(np.sqrt(n))
                for n, m in pairwise(sizes)]
        moments = [(np.zeros_like(w), np.zeros_like(w)) for w in made]
        for step in range(_STEPS):
            some = random.integers(len(sounds), size=_CLIPS)
            at = [random.integers(len(lips[k]), size=_BATCH // _CLIPS) for k in some]
            x = np.concatenate([_around(sounds[k], EVERY * a) for k, a in zip(some, at, strict=True)])
            y = np.concatenate([lips[k][a] for k, a in zip(some, at, strict=True)])
            x *= _kept(random, x.shape) / scale
            hidden = np.tanh(_layer(x, made[0]))
            gap = (_layer(hidden, made[1]) - y) * np.float32(2 / y.size)
            back = (gap @ made[1][:-1].T) * (1 - hidden**2)
            for w, own, (mean, square) in zip(made, (_slope(x, back), _slope(hidden, gap)), moments, strict=True):
                _moved(w, own, mean, square, step)
        return cls(scale, *made)


def _layer(x: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """What goes into the units (n, M) of a layer, from inputs (n, N) and weights (N + 1, M)."""
    return x @ weights[:-1] + weights[-1]


def _slope(x: np.ndarray, gap: np.ndarray) -> np.ndarray:
    """How the error grows with the weights (N + 1, M) of a layer, from its inputs (n, N) and gaps (n, M)."""
    return np.concatenate([x.T @ gap, gap.sum(axis=0, keepdims=True)])


def _kept(random: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Factors that drop a tenth of inputs and make up for it in the others, float32."""
    bits = np.frombuffer(random.bytes(int(np.prod(shape))), np.uint8).reshape(shape)
    return (bits >= _DROPPED) * np.float32(256 / (256 - _DROPPED))


def _moved(weights: np.ndarray, own: np.ndarray, mean: np.ndarray, square: np.ndarray, step: int) -> None:
    """Move weights in place by a step of Adam; ``mean`` and ``square`` are its moments."""
    rate = _RATE * (1 + np.cos(np.pi * step / _STEPS)) / 2
    mean += (own - mean) * np.float32(1 - _MEAN)
    square += (own * own - square) * np.float32(1 - _SQUARE)
    faster = 1 / (1 - _MEAN ** (step + 1))
    wide = np.sqrt(square * np.float32(1 / (1 - _SQUARE ** (step + 1)))) + np.float32(1e-8)
    weights *= np.float32(1 - rate * _DECAY)
    weights -= np.float32(rate * faster) * mean / wide


def _by_kernel(clips: Mapping[str, SyncClip]) -> dict[str, np.ndarray]:
    """As :class:`dnnvss.systems.kernel.KernelRegression` does it, on what is heard about each clip's mean."""
    names, parts = list(clips), min(len(clips), _PARTS)
    sounds = {n: clips[n].heard(_NEAR) for n in names}
    sounds = {n: x - x.mean(axis=0) for n, x in sounds.items()}
    scale = (np.concatenate(list(sounds.values())).std(axis=0) + 1e-6) ** _WHITENING
    learnt = {n: np.flatnonzero(clips[n].spoken)[::_THIN] for n in names}
    heard: dict[str, np.ndarray] = {}
    for part in range(parts):
        others = [n for k, n in enumerate(names) if k % parts != part]
        x = np.concatenate([sounds[n][learnt[n]] for n in others]) / scale
        y = np.concatenate([clips[n].lips(clips[n].times[learnt[n]]) for n in others])
        thin = max(1, -(-len(x) // _MOST))
        process = _Process.fit(x[::thin], y[::thin])
        heard |= {n: process(sounds[n] / scale) for n in names[part::parts]}
    return heard


@dataclass(frozen=True)
class _Process:
    seen: np.ndarray
    width: float
    mean: np.ndarray
    weights: np.ndarray

    @classmethod
    def fit(cls, x: np.ndarray, y: np.ndarray) -> "_Process":
        from scipy.spatial.distance import pdist  # slow to import, and needed by this alone

        apart = pdist(x[:: max(1, len(x) // _SOME)])
        width = _WIDTH * float(np.median(apart)) if len(apart) and apart.any() else 1.0
        kernel = _kernel(x, x, width) + _NOISE * np.eye(len(x))
        return cls(x, width, y.mean(axis=0), np.linalg.solve(kernel, y - y.mean(axis=0)))

    def __call__(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(self.mean + _kernel(x, self.seen, self.width) @ self.weights)


def _kernel(a: np.ndarray, b: np.ndarray, width: float) -> np.ndarray:
    from scipy.spatial.distance import cdist

    return np.asarray(np.exp(cdist(a, b, "sqeuclidean") / (-2 * width**2)))
