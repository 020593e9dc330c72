"""The folder that a training of several talkers leaves: whose runs lie in it, and where."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.records import read_record
from dnnvss.runs.files import RunFiles, TogetherFiles

_REMEDY = "Delete the folder, or train anew with overwrite=true"


@dataclass(frozen=True)
class TalkersIndex:
    """What the index of such a folder says.

    Args:
        talkers: the name of each talker's corpus to the name of the run folder.
    """

    talkers: Mapping[str, str]

    @classmethod
    def load(cls, folder: Path) -> "TalkersIndex":
        """The index of a folder.

        Raises:
            DnnvssError: it is missing or damaged.
        """
        return read_record(cls, TogetherFiles(folder).index, _REMEDY)

    def save(self, folder: Path) -> Path:
        """Write the index and return its path."""
        return files.write_json(TogetherFiles(folder).index, asdict(self))


def is_together(folder: Path) -> bool:
    """Whether a folder is that of a training of several talkers."""
    return TogetherFiles(folder).index.is_file()


def talker_run(folder: Path, talker: str | None) -> Path:
    """The run of a talker in the folder of a training.

    Raises:
        DnnvssError: no talker is named, none of that name is there, or the run has not ended.
    """
    runs = TalkersIndex.load(folder).talkers
    known = ", ".join(runs)
    if talker is None:
        raise DnnvssError(f"holds runs of {known}", file=folder,
                          remedy="Add talker=NAME, or name the folder of one of them in it")
    if talker not in runs:
        raise DnnvssError(f"holds no run of talker={talker}", file=folder, remedy=f"Use one of {known}")
    path = files.inside(folder, runs[talker])
    if not RunFiles(path).finished:
        raise DnnvssError("holds a run that has not ended", file=path,
                          remedy="Run its command (dnnvss train) again: it goes on where it stopped")
    return path


def run_folders(runs: Path) -> list[Path]:
    """What lies in a folder of runs, and in the trainings of several talkers in it."""
    there = list(runs.glob("*"))
    return [*there, *(run for folder in there if is_together(folder) for run in folder.glob("*"))]
