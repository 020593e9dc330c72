"""A run's network for other programs, and a bundle: all that synthesis needs, without what training needs.

A bundle is a folder with the exported network and the run's face, talker, durations and configuration.
``python synth.py run=BUNDLE`` speaks from it with neither Lightning nor hydra in the process.
"""

import shutil
from pathlib import Path
from typing import TYPE_CHECKING

from dnnvss import __version__, files
from dnnvss.errors import DnnvssError

if TYPE_CHECKING:
    from dnnvss.runs.run import Run
    from dnnvss.systems import VisualModel

INDEX = "bundle.json"
"""Written last: a folder without it is no bundle."""
_FILES = ("config.yaml", "aam.npz", "face.npz", "talker.npz", "durations.npz", "voice.json")


def is_bundle(folder: Path) -> bool:
    """Return whether a folder is a whole bundle."""
    return (folder / INDEX).is_file()


def open_network(folder: Path) -> "VisualModel":
    """Return the network of a bundle.

    Raises:
        DnnvssError: a file is missing, damaged, or needs a package that is missing.
    """
    from dnnvss.export.exported import ExportedModel

    return ExportedModel.open(folder / files.read_json(folder / INDEX)["network"])


def export_run(run: "Run", path: Path) -> Path:
    """Write the network of a run to ``path`` (``.onnx`` or ``.pt2``) and return the path.

    Raises:
        DnnvssError: the run's system is no network, another suffix, or a package is missing.
    """
    from dnnvss.export.description import Description
    from dnnvss.export.graph import frame_streams
    from dnnvss.export.write import write_network

    streams = frame_streams(run.model)
    arrays = {name: streams.get_buffer(f"target_{name}").tolist() for name in ("mean", "deviation", "variance")}
    scaler = {name: streams.get_buffer(f"numeric_{name}").tolist() for name in ("mean", "deviation")}
    description = Description(str(run.config.model.name), run.task.table, run.task.clock, run.task.windows,
                              tuple(run.face.names), scaler, arrays, streams.predicted)
    return write_network(path, streams, description)


def write_bundle(run: "Run", folder: Path, network: str = "model.onnx") -> Path:
    """Write a bundle of a run and return its folder; an older bundle there is replaced.

    Raises:
        DnnvssError: as :func:`export_run`; or the folder holds something else.
    """
    ours = {network, INDEX, "units.pt", *_FILES}  # what an export that was killed may have left
    if folder.is_dir() and {p.name for p in folder.iterdir()} - ours and not is_bundle(folder):
        raise DnnvssError("holds something that is not a bundle", file=folder, remedy="Choose another folder")
    export_run(run, folder / network)  # whole or not at all; what it refuses leaves the older bundle as it is
    (folder / INDEX).unlink(missing_ok=True)
    units = ("units.pt",) if run.task.table.uses_visemes else ()
    for name in (*_FILES, *units):
        with files.replacing(folder / name) as temporary:
            shutil.copyfile(run.folder / name, temporary)
    files.write_json(folder / INDEX, {"network": network, "run": run.folder.name, "dnnvss": __version__})
    return folder
