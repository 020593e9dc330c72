"""What makes a folder a bundle: all that synthesis needs, without what training needs.

A bundle has the files of a run folder under the same names, but for the network, which is kept as other programs read
it. ``python synth.py run=BUNDLE`` speaks from it with neither Lightning nor hydra in the process.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.runs.files import RunFiles
from dnnvss.systems import VisualModel

_REMEDY = "Export the run again: python -m dnnvss.export RUN"


@dataclass(frozen=True)
class BundleIndex:
    """What ``bundle.json`` says.

    Args:
        network: the file of the network in the bundle.
        run: the name of the run folder that it came from.
        dnnvss: the version that wrote it.
    """

    network: str
    run: str
    dnnvss: str

    @classmethod
    def load(cls, folder: Path) -> "BundleIndex":
        """The index of the bundle in a folder.

        Raises:
            DnnvssError: it is damaged or says less than it must.
        """
        path = RunFiles(folder).index
        value = files.read_json(path, _REMEDY)
        try:
            return cls(**{name: str(value[name]) for name in ("network", "run", "dnnvss")})
        except (KeyError, TypeError) as error:
            raise DnnvssError(f"does not say {error}", file=path, remedy=_REMEDY) from error

    def save(self, folder: Path) -> Path:
        """Write the index, which makes the folder a bundle, and return its path."""
        return files.write_json(RunFiles(folder).index, asdict(self))


def is_bundle(folder: Path) -> bool:
    """Whether a folder is a whole bundle."""
    return RunFiles(folder).index.is_file()


def open_network(folder: Path) -> VisualModel:
    """The network of a bundle.

    Raises:
        DnnvssError: a file is missing, damaged, or needs a package that is missing.
    """
    from dnnvss.export.exported import ExportedModel

    return ExportedModel.open(folder / BundleIndex.load(folder).network)
