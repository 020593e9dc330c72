"""What makes a folder a bundle: all that synthesis needs, without what training needs.

A bundle has the files of a run folder under the same names, but for a network, which is kept as other programs read
it; what no other program would understand stays as it is in the run. ``python synth.py run=BUNDLE`` speaks from it with
neither Lightning nor hydra in the process.
"""

from dataclasses import asdict, dataclass
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.runs.files import RunFiles
from dnnvss.settings import read_settings

_REMEDY = "Export the run again: dnnvss export RUN"


@dataclass(frozen=True)
class BundleIndex:
    """What ``bundle.json`` says.

    Args:
        network: the file of the network in the bundle; where the system is no network, what it learnt.
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
        try:
            return read_settings(cls, files.read_json(path, _REMEDY), "")
        except DnnvssError as error:
            raise DnnvssError(error.problem, file=path, remedy=_REMEDY) from error

    def save(self, folder: Path) -> Path:
        """Write the index, which makes the folder a bundle, and return its path."""
        return files.write_json(RunFiles(folder).index, asdict(self))


def is_bundle(folder: Path) -> bool:
    """Whether a folder is a whole bundle."""
    return RunFiles(folder).index.is_file()
