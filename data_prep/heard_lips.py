"""Lips that are heard: regressions from the sound of clips to the movements of the lips, cross-fitted.

From many clips a small network learns it, from few a Gaussian process, which needs less to learn from and sees less of
the sound at once. Both read mel cepstra and say the leading movements of the lips.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial.distance import cdist, pdist

from dnnvss.progress import counted
from dnnvss.speech.align_features import HOP

MANY = 60
"""Clips from which the network learns."""
MODES = 6
"""Leading movements of the lips that are heard."""
EVERY = 2
"""Cepstra from one heard frame to the next: 100 a second."""

_FOLDS, _HIDDEN, _STEPS, _BATCH, _RATE = 4, 128, 1000, 512, 3e-3
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
    usual = np.concatenate([clips[n].sound[::20] for n in names])
    scale = np.tile(usual.std(axis=0) + 1e-6, len(_CONTEXT)).astype(np.float32)
    heard = {}
    for fold in counted(range(_FOLDS), "hearing the lips", unit="parts"):
        held = {names[k] for k in order[fold::_FOLDS]}
        network = _fitted([clips[n] for n in names if n not in held], scale, fold)
        with torch.no_grad():
            for name in held:
                heard[name] = network(torch.from_numpy(clips[name].heard(_CONTEXT) / scale)).numpy()
    return heard


def _fitted(clips: Sequence[SyncClip], scale: np.ndarray, seed: int) -> torch.nn.Module:
    random = np.random.default_rng(seed)
    lips = [clip.lips(clip.times).astype(np.float32) for clip in clips]
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        network = torch.nn.Sequential(torch.nn.Dropout(0.1), torch.nn.Linear(len(scale), _HIDDEN), torch.nn.Tanh(),
                                      torch.nn.Linear(_HIDDEN, MODES))
        optimiser = torch.optim.AdamW(network.parameters(), _RATE)
        schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, _STEPS)
        for _ in range(_STEPS):
            some = random.integers(len(clips), size=16)
            at = [random.integers(len(lips[k]), size=_BATCH // 16) for k in some]
            x = np.concatenate([_window(clips[k].sound, EVERY * a) for k, a in zip(some, at, strict=True)]) / scale
            y = np.concatenate([lips[k][a] for k, a in zip(some, at, strict=True)])
            loss = torch.nn.functional.mse_loss(network(torch.from_numpy(x)), torch.from_numpy(y))
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            schedule.step()
    return network.eval()


def _window(sound: np.ndarray, centres: np.ndarray) -> np.ndarray:
    return sound[np.clip(centres[:, None] + _CONTEXT, 0, len(sound) - 1)].reshape(len(centres), -1)


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
        apart = pdist(x[:: max(1, len(x) // _SOME)])
        width = _WIDTH * float(np.median(apart)) if len(apart) and apart.any() else 1.0
        kernel = _kernel(x, x, width) + _NOISE * np.eye(len(x))
        return cls(x, width, y.mean(axis=0), np.linalg.solve(kernel, y - y.mean(axis=0)))

    def __call__(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(self.mean + _kernel(x, self.seen, self.width) @ self.weights)


def _kernel(a: np.ndarray, b: np.ndarray, width: float) -> np.ndarray:
    return np.asarray(np.exp(cdist(a, b, "sqeuclidean") / (-2 * width**2)))
