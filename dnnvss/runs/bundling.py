"""Writes the network of a run for other programs, and bundles."""

import shutil
from pathlib import Path

from dnnvss import __version__, files
from dnnvss.errors import DnnvssError
from dnnvss.export.description import Description
from dnnvss.export.graph import frame_streams, is_network
from dnnvss.runs.bundle import NETWORKS, BundleIndex, is_bundle
from dnnvss.runs.files import RunFiles
from dnnvss.runs.run import Run
from dnnvss.staging import is_ours, sweep
from dnnvss.training.arrays import save_arrays
from dnnvss.training.checkpoints import load_checkpoint
from dnnvss.training.learnt import read_learnt


def export_run(run: Run, path: Path) -> Path:
    """Write the network of a run to ``path`` (``.onnx`` or ``.pt2``) and return the path.

    Raises:
        DnnvssError: the run's system is no network, another suffix, or a package is missing.
    """
    from dnnvss.export.write import write_network

    if not is_network(run.trained):
        raise DnnvssError(f"model={run.settings.model_name} is not a network, so that no other program can run it",
                          file=run.folder, remedy="A name without suffix makes a bundle of it: --out FOLDER")
    streams = frame_streams(run.trained)
    arrays = {name: streams.get_buffer(f"target_{name}").tolist() for name in ("mean", "deviation", "variance")}
    scaler = {name: streams.get_buffer(f"numeric_{name}").tolist() for name in ("mean", "deviation")}
    description = Description(run.settings.model_name, run.task.table, run.task.clock, run.task.windows,
                              tuple(run.face.names), scaler, arrays, streams.predicted, streams.reach)
    return write_network(path, streams, description)


def write_bundle(run: Run, folder: Path, network: str = "model.onnx") -> Path:
    """Write a bundle of a run and return its folder; an older bundle there is replaced, whole or not at all.

    Args:
        run: any run. What a system that is no network learnt is kept as arrays.
        folder: of the bundle.
        network: ``model.onnx``, or ``model.npz`` for a network's weights as arrays.

    Raises:
        DnnvssError: as :func:`export_run`; the run is a bundle; or the folder holds something else.
    """
    if is_bundle(run.folder):
        raise DnnvssError("is a bundle already", file=run.folder, remedy="Copy it, or export the run that it came from")
    theirs = RunFiles(folder)
    _refuse_other(theirs)
    exports = network == NETWORKS[0] and is_network(run.trained)
    name = network if exports else NETWORKS[1]
    with files.together(theirs.index) as group:
        if exports:
            export_run(run, folder / name)
        else:
            save_arrays(folder / name, read_learnt(run.files.model))
        if "visemes" in run.task.table.sources:
            save_arrays(theirs.bundled_units, load_checkpoint(run.files.units))
        for path in _copied(run):
            with files.replacing(folder / path.name) as temporary:
                shutil.copyfile(path, temporary)
        digests = {path.name: files.digest(part.file) for path, part in sorted(group.parts.items())}
        for path in {*theirs.members, *(folder / other for other in NETWORKS)} - group.parts.keys():
            group.leave_out(path)
        BundleIndex(name, run.folder.name, __version__, digests).save(folder)
    return folder


def _refuse_other(places: RunFiles) -> None:
    """Refuse a folder that holds something that is no bundle; what a killed export left there is removed.

    Raises:
        DnnvssError: it does.
    """
    folder = places.folder
    if not folder.is_dir() or is_bundle(folder):
        return
    sweep(folder)
    ours = {places.index.name, *NETWORKS, *(path.name for path in places.members)}
    if {path.name for path in folder.iterdir() if not is_ours(path.name)} - ours:
        raise DnnvssError("holds something that is not a bundle", file=folder, remedy="Choose another folder")


def _copied(run: Run) -> list[Path]:
    """What a bundle takes from its run as it is; a face without texture is drawn into nothing."""
    optional = (run.files.picture, run.files.life, run.files.heard)
    return [*run.files.needed, *(path for path in optional if path.is_file())]
