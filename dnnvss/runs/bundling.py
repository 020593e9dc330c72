"""Writes the network of a run for other programs, and bundles."""

import shutil
from pathlib import Path

from dnnvss import __version__, files
from dnnvss.errors import DnnvssError
from dnnvss.export.description import Description
from dnnvss.export.graph import frame_streams, is_network
from dnnvss.runs.bundle import BundleIndex, is_bundle
from dnnvss.runs.files import RunFiles
from dnnvss.runs.run import Run


def export_run(run: Run, path: Path) -> Path:
    """Write the network of a run to ``path`` (``.onnx`` or ``.pt2``) and return the path.

    Raises:
        DnnvssError: the run's system is no network, another suffix, or a package is missing.
    """
    from dnnvss.export.write import write_network

    streams = frame_streams(run.model)
    arrays = {name: streams.get_buffer(f"target_{name}").tolist() for name in ("mean", "deviation", "variance")}
    scaler = {name: streams.get_buffer(f"numeric_{name}").tolist() for name in ("mean", "deviation")}
    description = Description(run.settings.model_name, run.task.table, run.task.clock, run.task.windows,
                              tuple(run.face.names), scaler, arrays, streams.predicted)
    return write_network(path, streams, description)


def write_bundle(run: Run, folder: Path, network: str = "model.onnx") -> Path:
    """Write a bundle of a run and return its folder; an older bundle there is replaced.

    Args:
        run: any run. What a system that is no network learnt is kept as it is.
        folder: of the bundle.
        network: the name of the file that a network is exported to.

    Raises:
        DnnvssError: as :func:`export_run`; the run is a bundle; or the folder holds something else.
    """
    if is_bundle(run.folder):
        raise DnnvssError("is a bundle already", file=run.folder, remedy="Copy it, or export the run that it came from")
    theirs = RunFiles(folder)
    ours = {network, theirs.index.name, theirs.units.name, theirs.model.name, *(path.name for path in _kept(theirs))}
    if folder.is_dir() and {p.name for p in folder.iterdir()} - ours and not is_bundle(folder):
        raise DnnvssError("holds something that is not a bundle", file=folder, remedy="Choose another folder")
    exports = is_network(run.model)
    if exports:
        export_run(run, folder / network)  # whole or not at all; what it refuses leaves the older bundle as it is
    files.remove(theirs.index)
    drawn = run.files.picture.is_file()  # a face without texture is drawn into nothing
    kept = [path for path in _kept(run.files) if drawn or path != run.files.picture]
    copied = [*kept, *([run.files.units] if "visemes" in run.task.table.sources else [])]
    for path in copied if exports else [run.files.model, *copied]:
        with files.replacing(folder / path.name) as temporary:
            shutil.copyfile(path, temporary)
    BundleIndex(network if exports else theirs.model.name, run.folder.name, __version__).save(folder)
    return folder


def _kept(places: RunFiles) -> tuple[Path, ...]:
    """What every bundle takes from its run; an export that was killed may have left some of it."""
    return places.config, places.face, places.picture, places.talker, places.durations, places.voice
