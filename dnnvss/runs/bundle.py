"""What makes a folder a bundle: all that synthesis needs, without what training needs.

A bundle has the files of a run folder under the same names, but for what was learnt: a network is kept as other
programs read it, all else as arrays of numbers (``.npz``). Nothing in a bundle is run when it is opened. ``python
synth.py run=BUNDLE`` speaks from it with neither Lightning nor hydra in the process.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.records import read_record
from dnnvss.runs.files import RunFiles

NETWORKS = ("model.onnx", "model.npz")
"""What is learnt in a bundle: a network as other programs read it, or arrays of numbers with JSON that orders them."""
_REMEDY = "Export the run again: dnnvss export RUN"


@dataclass(frozen=True)
class BundleIndex:
    """What ``bundle.json`` says.

    Args:
        network: the file of the network in the bundle; where the system is no network, what it learnt.
        run: the name of the run folder that it came from.
        dnnvss: the version that wrote it.
        digests: name of each other file of the bundle to the SHA-256 of what it holds.
    """

    network: str
    run: str
    dnnvss: str
    digests: Mapping[str, str]

    @classmethod
    def load(cls, folder: Path) -> "BundleIndex":
        """The index of the bundle in a folder.

        Raises:
            DnnvssError: it is damaged or says less than it must.
        """
        return read_record(cls, RunFiles(folder).index, _REMEDY)

    def check(self, folder: Path) -> Path:
        """The file of the network, after every file was found to be what the bundle was written with.

        A bundle holds the network as ONNX, or what the system learnt as arrays.

        Raises:
            DnnvssError: a name that leads out of the folder or that no bundle has, a file that is missing or another,
                or a network in a form that opening would run.
        """
        path = RunFiles(folder).index
        if self.network not in NETWORKS:
            raise DnnvssError(f"network={self.network} is none of {', '.join(NETWORKS)}", file=path, remedy=_REMEDY)
        known = {self.network, *(each.name for each in RunFiles(folder).members)}
        needed = {self.network, *(each.name for each in RunFiles(folder).needed)}
        for name in sorted(needed | self.digests.keys()):
            if name not in known or name not in self.digests:
                raise DnnvssError(f"digests: {name!r} is {'missing' if name in known else 'no file of a bundle'}",
                                  file=path, remedy=_REMEDY)
            member = files.inside(folder, name)
            if files.read(member, files.digest, _REMEDY) != self.digests[name]:
                raise DnnvssError("is not the file that the bundle was written with", file=member, remedy=_REMEDY)
        return folder / self.network

    def save(self, folder: Path) -> Path:
        """Write the index, which makes the folder a bundle, and return its path."""
        return files.write_json(RunFiles(folder).index, asdict(self))


def is_bundle(folder: Path) -> bool:
    """Whether a folder is a whole bundle."""
    return RunFiles(folder).index.is_file()
