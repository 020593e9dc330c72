"""The run folder: everything that synthesis needs, and where the results came from."""

import hashlib
import json
import platform
from dataclasses import dataclass
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from dnnvss import __version__, files
from dnnvss.corpus import Utterance
from dnnvss.curves import STATIC, STATIC_DELTA, STATIC_DELTA_DELTA2
from dnnvss.errors import DnnvssError
from dnnvss.face.aam import ActiveAppearanceModel
from dnnvss.features import FeatureTable
from dnnvss.runs.bundle import is_bundle, open_network
from dnnvss.style import Talker
from dnnvss.style.generator import Generator
from dnnvss.systems import Example, VisualModel
from dnnvss.systems.examples import Task
from dnnvss.systems.units import UnitModel
from dnnvss.timing import FrameClock
from dnnvss.training.checkpoints import load_checkpoint, save_checkpoint
from dnnvss.training.precision import resolve
from dnnvss.training.settings import SHARING
from dnnvss.visemes import TIER

_PACKAGES = ("torch", "lightning", "numpy", "scipy", "hydra-core", "av", "pocketsphinx")
WINDOWS = {"static": STATIC, "static_delta": STATIC_DELTA, "static_delta_delta2": STATIC_DELTA_DELTA2}
_NOT_RESULTS = ("runs", "run", "overwrite", "jobs", "sample")


def run_name(config: DictConfig, fingerprint: str) -> str:
    """Return a folder name that changes when, and only when, something that changes results does."""
    kept = _what_counts(config, fingerprint)
    digest = hashlib.sha256(json.dumps([kept, __version__], sort_keys=True).encode()).hexdigest()[:8]
    parts = [config.corpus.name, config.corpus.split, config.labels.name, config.model.name, digest]
    return "-".join(p for p in parts if p)


def check_settings(folder: Path, config: DictConfig, fingerprint: str) -> None:
    """Refuse to go on with a run that was begun with other settings or another corpus.

    Raises:
        DnnvssError: they differ in something that changes results; the first few are named.
    """
    if not (folder / "config.yaml").is_file() or not (folder / "run.json").is_file():
        return
    old = files.read(folder / "config.yaml", OmegaConf.load, "Delete the folder")
    corpus = str(files.read_json(folder / "run.json", "Delete the folder").get("corpus"))
    before, now = (_flat(_what_counts(c, f)) for c, f in ((old, corpus), (config, fingerprint)))
    changed = [f"{key} ({before.get(key)}, now {now.get(key)})" for key in sorted({*before, *now})
               if before.get(key) != now.get(key)]
    if changed:
        more = f" and {len(changed) - 3} more" if len(changed) > 3 else ""
        raise DnnvssError(f"holds a run with other settings: {', '.join(changed[:3])}{more}", file=folder,
                          remedy="Leave run= out or name another folder; overwrite=true deletes this run first")


def _flat(value: Any, name: str = "") -> dict[str, Any]:
    """Return nested containers as one, with dotted names."""
    if not isinstance(value, dict):
        return {name: value}
    return {k: v for key, part in value.items() for k, v in _flat(part, f"{name}.{key}" if name else str(key)).items()}


def _what_counts(config: DictConfig, fingerprint: str) -> dict[str, Any]:
    """Return the settings that change results, with the fingerprint of the corpus."""
    resolved: dict[str, Any] = OmegaConf.to_container(config, resolve=True)  # type: ignore[assignment]
    kept = {k: v for k, v in resolved.items() if k not in _NOT_RESULTS}
    unused = [] if config.trainer.refine else ["refine", "refine_rate"]
    for quiet in ("progress", "figure_every", *SHARING, *unused):
        kept["trainer"].pop(quiet, None)
        kept["model"].get("settings", {}).pop(quiet, None)
    if not make_task(config).table.uses_visemes:
        del kept["visemes"]
    kept["corpus"] = {"fingerprint": fingerprint, "split": config.corpus.split}
    return kept


def provenance(config: DictConfig, fingerprint: str) -> dict[str, Any]:
    """Return versions of the code and its main dependencies, the fingerprint of the data, and the number format."""
    versions = {name: metadata.version(name) for name in _PACKAGES}
    return {"dnnvss": __version__, "python": platform.python_version(), "packages": versions, "corpus": fingerprint,
            "precision": resolve(config.trainer.precision, config.trainer.accelerator)}


@dataclass(frozen=True)
class Run:
    """A trained system, opened for use."""

    folder: Path
    config: DictConfig
    task: Task
    model: VisualModel

    @cached_property
    def face(self) -> ActiveAppearanceModel:
        """The appearance model that turns trajectories into pictures."""
        return ActiveAppearanceModel.load(self.folder / "aam.npz")

    @cached_property
    def generator(self) -> Generator:
        """What turns examples into trajectories, with what was learnt of the talker."""
        return Generator(self.task, self.model, Talker.load(self.folder / "talker.npz"))

    @cached_property
    def units(self) -> UnitModel | None:
        """The dynamic visemes of the run and their predictor, None where its labels have none."""
        return UnitModel.load(self.folder / "units.pt") if self.task.table.uses_visemes else None

    def example(self, utterance: Utterance) -> Example:
        """Return an utterance as the model sees it; where it has no tier ``visemes``, that is predicted from text."""
        if self.units is None or TIER in utterance.alignment:
            return self.task.example(utterance)
        return self.task.example(utterance, visemes=self.units.tiers(utterance))

    @staticmethod
    def save(folder: Path, task: Task, model: VisualModel) -> None:
        """Write the checkpoint: tensors and plain containers, whole or not at all."""
        save_checkpoint(folder / "model.pt", {"table": task.table.describe(), "state": model.state()})

    @classmethod
    def open(cls, folder: Path) -> "Run":
        """Return the run in a folder, or in a bundle.

        Raises:
            DnnvssError: the folder holds no finished run, its checkpoint is damaged, or it was trained with another
                feature table than its configuration now builds.
        """
        config = files.read(folder / "config.yaml", OmegaConf.load, "Train a system first: python train.py")
        if is_bundle(folder):
            task, network = make_task(config), open_network(folder)
            task.table.check(network.table.describe())
            return cls(folder, config, task, network)
        if not (folder / "model.pt").is_file():
            raise DnnvssError("holds a run that has not ended", file=folder,
                              remedy="Run its train.py command again: it goes on where it stopped")
        checkpoint = load_checkpoint(folder / "model.pt")
        if not isinstance(config, DictConfig) or "table" not in checkpoint:
            raise DnnvssError("is no run folder of this package", file=folder, remedy="Train a system: python train.py")
        task = make_task(config)
        try:
            task.table.check(checkpoint["table"])
        except DnnvssError as error:
            raise DnnvssError(error.problem, file=folder / "model.pt", remedy=error.remedy) from error
        model = make_model(config, task)
        model.load_state(checkpoint["state"])
        return cls(folder, config, task, model)


def make_task(config: DictConfig) -> Task:
    """Return the task that a configuration describes."""
    clock = FrameClock(config.trajectory.rate)
    labels = OmegaConf.to_container(config.labels, resolve=True)
    if (windows := config.trajectory.windows) not in WINDOWS:
        raise DnnvssError(f"unknown trajectory.windows={windows!r}", remedy=f"Use one of {sorted(WINDOWS)}")
    return Task(FeatureTable.from_config(labels), clock, WINDOWS[windows])  # type: ignore[arg-type]


def make_model(config: DictConfig, task: Task) -> VisualModel:
    """Return the untrained model that a configuration describes.

    Raises:
        DnnvssError: a setting that the model refuses; or the labels have dynamic visemes, and a model of this kind
            would not look at them.
    """
    from hydra.errors import InstantiationException  # a bundle is opened without
    from hydra.utils import instantiate

    settings: dict[str, Any] = OmegaConf.to_container(config.model, resolve=True)  # type: ignore[assignment]
    name = settings.pop("name")
    try:
        model: VisualModel = instantiate(settings)(table=task.table, clock=task.clock)
    except InstantiationException as wrapped:
        cause: BaseException | None = wrapped
        while cause is not None and not isinstance(cause, DnnvssError):
            cause = cause.__cause__
        raise cause or wrapped from None
    if task.table.uses_visemes and not model.reads_visemes:
        raise DnnvssError(f"model={name} does not look at the dynamic visemes of labels={config.labels.name}",
                          remedy="Train it with labels of phones (labels=ph_d), or take a network (model=feedforward)")
    return model


def newest(runs: Path) -> Path:
    """Return the finished run in ``runs`` that ended last.

    Raises:
        DnnvssError: there is none.
    """
    finished = sorted(runs.glob("*/metrics.json"), key=lambda p: p.stat().st_mtime)
    if not finished:
        raise DnnvssError("no finished run here", file=runs, remedy="Train one first: python train.py corpus=demo")
    return finished[-1].parent
