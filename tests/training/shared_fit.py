"""Run by a test as a program: fits a small network, alone or shared by processes; the first writes its weights.

``python shared_fit.py FOLDER DEVICES``; with more devices than one Lightning starts this program again for each. With
a third argument the second process meets a loss that is no number in the only step of the epoch.
"""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from conftest import CLOCK, TABLE, make_example, of_layers

import dnnvss.systems.network
from dnnvss.errors import DnnvssError
from dnnvss.systems.network import NetworkModel
from dnnvss.training import FitSettings
from dnnvss.training.batches import Batch, FrameBatches
from dnnvss.training.devices import process_number


class Noted(FrameBatches):
    """Frame batches that write down which frames this process drew."""

    drawn: list[int] = []  # noqa: RUF012

    def draw(self, batches: Sequence[np.ndarray], first: int = 0) -> list[Batch]:
        """Return the batches."""
        if self.seed is not None:
            self.drawn.extend(np.concatenate(batches).tolist())
        return super().draw(batches, first)


def main(folder: Path, devices: int, spoilt: bool) -> None:
    """Fit and write."""
    dnnvss.systems.network.FrameBatches = Noted
    rng = np.random.default_rng(1)
    train, val = ([make_example(f"{name}{i}", rng) for i in range(count)] for name, count in (("train", 4), ("val", 2)))
    if spoilt and process_number() == 1:
        train = [replace(e, targets=e.targets * np.nan) for e in train]
    settings = FitSettings(epochs=2, batch_size=1000 if spoilt else 32, share=1.0, progress=False,
                           figure_every=0, accelerator="cpu", devices=devices, schedule="constant",
                           strategy="ddp" if devices > 1 else "auto")
    model = NetworkModel(TABLE, CLOCK, NetworkModel.Settings(of_layers(16, 16), settings))
    try:
        model.fit(train, val, folder)
    except DnnvssError as error:
        sys.exit(f"process {process_number()}: {error}")
    (folder / f"drawn{process_number()}.txt").write_text(" ".join(map(str, Noted.drawn)))
    if process_number() == 0:
        np.save(folder / "weights.npy", np.concatenate([p.detach().numpy().ravel()
                                                        for p in model.networks_[0].parameters()]))
        np.save(folder / "variance.npy", model.variance_)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), len(sys.argv) > 3)
