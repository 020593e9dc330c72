"""Run by a test as a program: kills fits with SIGKILL at several moments, then lets them go on.

``python killed_fit.py FOLDER`` writes the weights of an uninterrupted fit and of each fit that was killed. Fits run in
forks of this process, which has everything imported and computes nothing itself.
"""

import os
import signal
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
import lightning  # noqa: F401  (once, before the forks)
from conftest import CLOCK, TABLE, make_example, of_layers

import dnnvss.training.callbacks
from dnnvss.curves import STATIC_DELTA_DELTA2, mlpg
from dnnvss.systems import Example
from dnnvss.systems.frame_network import FrameNetwork
from dnnvss.systems.network import NetworkModel
from dnnvss.systems.viseme_network import UnitNetwork, unit_targets
from dnnvss.timing import Tier
from dnnvss.training import FitSettings
from dnnvss.training.module import FitModule

SETTINGS = FitSettings(epochs=3, batch_size=32, progress=False, figure_every=0, accelerator="cpu", refine=2,
                       refine_rate=1e-3)


def fit(folder: Path) -> None:
    """Fit a network, refine it, fit one that predicts visemes and one over time; write their weights.

    The error variances, which tell the validation errors, are written too.
    """
    rng = np.random.default_rng(1)
    train, val = ([make_example(f"{name}{i}", rng) for i in range(count)] for name, count in (("train", 4), ("val", 2)))
    network = of_layers(16, 16, dropout=0.2, input_dropout=0.2)
    model = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(network, SETTINGS))
    model.fit(train, val, folder)
    model.refine(train, val, partial(mlpg, windows=STATIC_DELTA_DELTA2), folder / "refined")
    seen, held = ([(e.codes, unit_targets(gestures(e), CLOCK)) for e in part] for part in (train, val))
    units = UnitNetwork.fit(seen, held, 4, [16], 0.2, SETTINGS, folder / "units")
    over_time = {"kind": "recurrent", "width": 8, "dropout": 0.2, "input_dropout": 0.2}
    sequences = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(over_time, replace(SETTINGS, utterances=2)))
    sequences.fit(train, val, folder / "over_time")
    np.savez(folder / "result.npz", weights=flat(model.networks_[0]), variance=model.variance_,
             units=flat(units.network), over_time=flat(sequences.networks_[0]))


def flat(network: FrameNetwork) -> np.ndarray:
    """All weights in one row."""
    return np.concatenate([p.detach().numpy().ravel() for p in network.parameters()])


def gestures(example: Example) -> Tier:
    """A tier of four visemes that follow from the phones."""
    return Tier("visemes", [(a, b, str(ord(p[0]) % 4)) for a, b, p in example.alignment["phones"]])


def die() -> None:
    """End this process as nobody can prevent."""
    os.kill(os.getpid(), signal.SIGKILL)


def counted(function: Callable, number: int, before: bool = True) -> Callable:
    """Return ``function`` that dies with its call of the given number, before or after it does its work."""
    calls = 0

    def wrapped(*args: object, **kwargs: object) -> object:
        nonlocal calls
        calls += 1
        if before and calls == number:
            die()
        result = function(*args, **kwargs)
        if calls == number:
            die()
        return result

    return wrapped


def half_written(number: int) -> Callable:
    """Return a ``Path.write_bytes`` that dies in the middle of its work."""
    calls, whole = 0, Path.write_bytes

    def write(path: Path, data: memoryview) -> int:
        nonlocal calls
        calls += 1
        if calls == number:
            whole(path, bytes(data)[: len(data) // 2])
            die()
        return whole(path, data)

    return write


def in_first_epoch() -> None:
    """Die before there is any checkpoint."""
    FitModule.step = counted(FitModule.step, 3)  # type: ignore[method-assign]


def in_an_epoch() -> None:
    """Die in the middle of the second epoch."""
    FitModule.on_train_epoch_start = counted(FitModule.on_train_epoch_start, 2)  # type: ignore[method-assign]


def in_a_refinement() -> None:
    """Die in its second pass, after the three epochs of the fit."""
    FitModule.on_train_epoch_start = counted(FitModule.on_train_epoch_start, 5)  # type: ignore[method-assign]


def in_a_fit_of_visemes() -> None:
    """Die in its second epoch, after the fit and the refinement."""
    FitModule.on_train_epoch_start = counted(FitModule.on_train_epoch_start, 7)  # type: ignore[method-assign]


def in_a_fit_over_time() -> None:
    """Die in its second epoch, after all the others."""
    FitModule.on_train_epoch_start = counted(FitModule.on_train_epoch_start, 10)  # type: ignore[method-assign]


def writing_a_checkpoint() -> None:
    """Die with half of the third checkpoint (the best or the last of the second epoch) on the disk."""
    Path.write_bytes = half_written(3)  # type: ignore[method-assign,assignment]


def between_best_and_last() -> None:
    """Die when the best of the second epoch is written and the last is not."""
    save = counted(dnnvss.training.callbacks.save_checkpoint, 3, before=False)
    dnnvss.training.callbacks.save_checkpoint = save  # type: ignore[assignment]


POINTS = (in_first_epoch, in_an_epoch, in_a_refinement, in_a_fit_of_visemes, in_a_fit_over_time, writing_a_checkpoint,
          between_best_and_last)


def forked(work: Callable[[], None]) -> int:
    """Return how a fork of this process ended that did the work."""
    child = os.fork()
    if child == 0:
        work()
        os._exit(0)
    return os.waitpid(child, 0)[1]


def main(home: Path) -> None:
    """Write ``result.npz`` of every fit."""
    assert forked(lambda: fit(home / "whole")) == 0
    for point in POINTS:
        folder = home / point.__name__

        def killed(point: Callable[[], None] = point, folder: Path = folder) -> None:
            point()
            fit(folder)

        assert forked(killed) == signal.SIGKILL, point.__name__
        assert not (folder / "result.npz").exists()
        assert forked(lambda folder=folder: fit(folder)) == 0, point.__name__


if __name__ == "__main__":
    main(Path(sys.argv[1]))
