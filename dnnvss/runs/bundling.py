"""Writes the network of a run for other programs, and bundles."""

import shutil
from pathlib import Path

from dnnvss import __version__, files
from dnnvss.errors import DnnvssError
from dnnvss.export.description import Description
from dnnvss.runs.bundle import BundleIndex, is_bundle
from dnnvss.runs.files import RunFiles
from dnnvss.runs.run import Run


def export_run(run: Run, path: Path) -> Path:
    """Write the network of a run to ``path`` (``.onnx`` or ``.pt2``) and return the path.

    Raises:
        DnnvssError: the run's system is no network, another suffix, or a package is missing.
    """
    from dnnvss.export.graph import frame_streams
    from dnnvss.export.write import write_network

    streams = frame_streams(run.model)
    arrays = {name: streams.get_buffer(f"target_{name}").tolist() for name in ("mean", "deviation", "variance")}
    scaler = {name: streams.get_buffer(f"numeric_{name}").tolist() for name in ("mean", "deviation")}
    description = Description(run.settings.model_name, run.task.table, run.task.clock, run.task.windows,
                              tuple(run.face.names), scaler, arrays, streams.predicted)
    return write_network(path, streams, description)


def write_bundle(run: Run, folder: Path, network: str = "model.onnx") -> Path:
    """Write a bundle of a run and return its folder; an older bundle there is replaced.

    Raises:
        DnnvssError: as :func:`export_run`; or the folder holds something else.
    """
    theirs = RunFiles(folder)
    ours = {network, theirs.index.name, theirs.units.name, *(path.name for path in _kept(theirs))}
    if folder.is_dir() and {p.name for p in folder.iterdir()} - ours and not is_bundle(folder):
        raise DnnvssError("holds something that is not a bundle", file=folder, remedy="Choose another folder")
    export_run(run, folder / network)  # whole or not at all; what it refuses leaves the older bundle as it is
    files.remove(theirs.index)
    for path in [*_kept(run.files), *([run.files.units] if "visemes" in run.task.table.sources else [])]:
        with files.replacing(folder / path.name) as temporary:
            shutil.copyfile(path, temporary)
    BundleIndex(network, run.folder.name, __version__).save(folder)
    return folder


def _kept(places: RunFiles) -> tuple[Path, ...]:
    """What every bundle takes from its run; an export that was killed may have left some of it."""
    return places.config, places.face, places.picture, places.talker, places.durations, places.voice
