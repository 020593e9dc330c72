"""The settings of a run: what ``conf/train.yaml`` composes, and ``config.yaml`` keeps, as one typed value."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from typing import Any

from dnnvss import __version__, files
from dnnvss.curves import STATIC, STATIC_DELTA, STATIC_DELTA_DELTA2
from dnnvss.errors import DnnvssError
from dnnvss.face.kinds import FaceSettings, read_face_settings
from dnnvss.features import FeatureTable
from dnnvss.files.plain_yaml import UnfitError, read_yaml
from dnnvss.runs.bundle import BundleIndex
from dnnvss.runs.files import RunFiles
from dnnvss.runs.talkers import is_together, talker_run
from dnnvss.settings import at_home, read_settings, setting, shown
from dnnvss.style.generator import StyleSettings
from dnnvss.systems.examples import Task
from dnnvss.timing import FrameClock

WINDOWS = {"static": STATIC, "static_delta": STATIC_DELTA, "static_delta_delta2": STATIC_DELTA_DELTA2}


@dataclass(frozen=True)
class TrajectorySettings:
    """On which clock systems predict, and which streams."""

    rate: int | float | str = setting(100, doc="frames a second")
    windows: str = setting("static_delta_delta2", choices=WINDOWS, doc="the streams that MLPG joins")

    def __post_init__(self) -> None:
        FrameClock.from_setting(self.rate, "trajectory.rate")

    @property
    def clock(self) -> FrameClock:
        """The trajectory clock."""
        return FrameClock(self.rate)


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """What every run is told beside its groups, with the groups that belong to all runs."""

    seed: int = setting(0, least=0)
    runs: str = setting("runs", path=True, doc="folder of run folders")
    run: str | None = setting(None, path=True, doc="the run folder; named by what changes results where None")
    overwrite: bool = setting(False, doc="train anew where a finished run has the same name")
    jobs: int = setting(-1, least=-1, nonzero=True, doc="processes of the stage that encodes faces; -1 for all cores")
    folds: int | None = setting(None, least=0, doc="parts of all sentences, each predicted by a system that was "
                                "trained without it; 0 for the test split, by size where None")
    knowledge: str | tuple[str, ...] | None = setting(None, path=True, doc="run folders of other talkers to learn from")
    sample: bool = setting(True, doc="render test sentences at the end")
    trajectory: TrajectorySettings
    style: StyleSettings


_NAMED = (("corpus", "out"), ("corpus", "split"), ("labels", "name"), ("model", "name"), ("face", "kind"))
"""What every group that is read later says of itself, as text."""


@dataclass(frozen=True, kw_only=True)
class RunSettings(RunOptions):
    """What a run is trained with, as its ``config.yaml`` keeps it.

    The other groups are plain values: each is read by the room that it belongs to, when that is asked for. A bundle
    speaks without what only training reads.

    Args:
        heard_with: the other talkers of the same training, each with a hash of what its own results depend on.
        balance: how much small talkers counted in it.
    """

    corpus: Mapping[str, Any]
    face: Mapping[str, Any]
    aam: Mapping[str, Any]
    labels: Mapping[str, Any]
    visemes: Mapping[str, Any]
    model: Mapping[str, Any]
    trainer: Mapping[str, Any]
    heard_with: Mapping[str, str] = setting({})
    balance: float = setting(0.0, least=0, most=1)

    @classmethod
    def load(cls, folder: Path) -> "RunSettings":
        """The settings that the run in a folder was begun with.

        Raises:
            DnnvssError: the folder holds no run, runs of several talkers, or a run whose settings mean nothing to this
                version.
        """
        if is_together(folder):
            folder = talker_run(folder, None)
        path = RunFiles(folder).config
        values = files.read(path, _plain, nearest_run(folder))
        _check_version(RunFiles(folder), values)
        try:
            found = read_settings(cls, values, "")
            for group, name in _NAMED:
                if not isinstance(value := getattr(found, group).get(name), str):
                    raise DnnvssError(f"{group}.{name}={shown(value)} is no text")
        except DnnvssError as error:
            raise DnnvssError(error.problem, file=path, remedy=_anew(folder, values)) from error
        return found

    def write(self, folder: Path) -> Path:
        """Keep the settings in a run folder and return the path."""
        from omegaconf import OmegaConf

        return files.write_text(RunFiles(folder).config, OmegaConf.to_yaml(OmegaConf.create(asdict(self))))

    @cached_property
    def task(self) -> Task:
        """What a system is trained on: labels, clock and streams.

        Raises:
            DnnvssError: labels that do not exist.
        """
        windows = WINDOWS[self.trajectory.windows]
        return Task(FeatureTable.from_config(dict(self.labels)), self.trajectory.clock, windows)

    @property
    def face_settings(self) -> FaceSettings:
        """How the face is fitted: the group ``face``, over the group of its kind where there is one (``aam``).

        Raises:
            DnnvssError: an unknown kind or setting, or a value that means nothing.
        """
        chosen = dict(self.face)
        kind = str(chosen.pop("kind"))
        return read_face_settings(kind, {**{"aam": self.aam}.get(kind, {}), **chosen})

    @property
    def corpus_folder(self) -> Path:
        """The folder of the prepared corpus."""
        return at_home(self.corpus["out"])

    @property
    def split(self) -> str:
        """The variant of the split; empty for the usual one."""
        return str(self.corpus["split"])

    @property
    def labels_name(self) -> str:
        """The name of the labels."""
        return str(self.labels["name"])

    @property
    def model_name(self) -> str:
        """The name of the system."""
        return str(self.model["name"])


def _plain(path: Path) -> Any:
    """What a run's YAML says, as plain containers; nothing in it is looked up, imported or repeated.

    Raises:
        DnnvssError: it is larger or deeper than any run's, or holds an alias, by which a few lines grow without end.
    """
    text = files.read_text(path, _WRITTEN)
    if len(text) > _LONGEST:
        raise DnnvssError(f"has {len(text)} characters", file=path, remedy=_WRITTEN)
    try:
        return read_yaml(text, aliases=False)
    except UnfitError as error:
        raise DnnvssError(str(error), file=path, remedy=_WRITTEN) from error


_LONGEST = 2**20
_WRITTEN = "Use the file that dnnvss train wrote into the run folder"


def _check_version(places: RunFiles, values: Any) -> None:
    """Refuse a run or a bundle that another version of the package wrote."""
    written = __version__
    if places.index.is_file():
        written = BundleIndex.load(places.folder).dnnvss
    elif places.provenance.is_file():
        written = places.written().dnnvss or __version__
    if _release(written) != _release(__version__):
        raise DnnvssError(f"was trained by dnnvss {written}, and this is {__version__}", file=places.folder,
                          remedy=_anew(places.folder, values))


def _release(version: str) -> list[str]:
    """The parts of a version that tell whether files mean the same."""
    return version.split(".")[:2]


def nearest_run(folder: Path) -> str:
    """What to do about a folder that is no run: name that of a file, one in it, or the likest one; or train one."""
    if folder.is_file() and RunFiles(folder.parent).config.is_file():
        return f"Name the folder of the run: {folder.parent}"
    if inside := _runs_in(folder):
        return f"Name one of the runs in it, such as {inside[0]}"
    beside = {path.name: path for place in (folder.parent / "runs", folder.parent) for path in _runs_in(place)}
    if not folder.exists() and (near := get_close_matches(folder.name, beside, 1)):
        return f"Did you mean {beside[near[0]]}?"
    return "Train a system first: dnnvss train"


def _runs_in(folder: Path) -> list[Path]:
    """The runs in a folder, in the order of their names."""
    return sorted(path.parent for path in folder.glob(f"*/{RunFiles(folder).config.name}"))


def _anew(folder: Path, values: Any) -> str:
    """The command that trains a run again, as far as its settings can be read."""
    named = values.items() if isinstance(values, dict) else ()
    groups = {name: part["name"] for name, part in named if isinstance(part, dict) and "name" in part}
    chosen = [f"{name}={groups[name]}" for name in ("corpus", "labels", "model") if name in groups]
    return f"Train it anew: {' '.join(['dnnvss train', *chosen, f'run={folder}', 'overwrite=true'])}"
