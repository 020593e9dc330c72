"""How a system's results depend on the depth and width of its network: a heat map over a sweep."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.records import read_value
from dnnvss.runs.files import RunFiles
from dnnvss.runs.settings import RunSettings

MEASURES = {"correlation": "correlation", "rmse": "RMSE (parameter units)"}


def network_size(settings: RunSettings) -> tuple[int, int]:
    """Return the layers and the width of the network that settings describe.

    Raises:
        DnnvssError: the model has no network, or layers of different widths.
    """
    hidden = list(settings.model.get("network", {}).get("hidden", []))
    if not hidden or len(set(hidden)) > 1:
        raise DnnvssError(f"model={settings.model_name} with hidden layers {hidden} has no place in a table of sizes",
                          remedy="Sweep over networks whose layers are equally wide")
    return len(hidden), int(hidden[0])


def write_sizes(folders: Sequence[Path], settings: Sequence[RunSettings], out: Path) -> list[Path]:
    """Write ``sizes.json`` and ``sizes.png``, speech of the test split by layers and width, and return their paths.

    Args:
        folders: finished runs.
        settings: of each.
        out: folder.

    Raises:
        DnnvssError: a run without a network, or two of the same size.
    """
    from dnnvss.render.plots import plot_grid

    found: dict[tuple[int, int], dict[str, float]] = {}
    for folder, own in zip(folders, settings, strict=True):
        size = network_size(own)
        if size in found:
            raise DnnvssError(f"two runs have {size[0]} layers of {size[1]} units", file=folder,
                              remedy="Let nothing but the size differ")
        place, remedy = "systems.model.regions.speech", "Train the run anew: dnnvss train overwrite=true"
        found[size] = {name: read_value(RunFiles(folder).metrics, f"{place}.{name}.mean", float, remedy)
                       for name in MEASURES}
    layers, widths = (sorted({size[axis] for size in found}) for axis in (0, 1))
    grids = {title: np.array([[found.get((n, w), {}).get(name, np.nan) for w in widths] for n in layers], float)
             for name, title in MEASURES.items()}
    kept = [{"layers": n, "width": w, **values} for (n, w), values in sorted(found.items())]
    return [files.write_json(out / "sizes.json", kept),
            plot_grid(out / "sizes.png", grids, ("hidden layers", layers), ("units a layer", widths))]
