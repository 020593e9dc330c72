"""What makes two runs the same run: the name of a folder, and whether a run goes on as it was begun."""

import hashlib
import json
import shutil
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from dnnvss import __version__
from dnnvss.errors import DnnvssError
from dnnvss.features import Settings
from dnnvss.runs.files import RunFiles
from dnnvss.runs.settings import RunSettings
from dnnvss.staging import is_ours
from dnnvss.systems.members import widest_layer
from dnnvss.training.settings import SHARING

_NOT_RESULTS = ("runs", "run", "overwrite", "jobs", "sample", "knowledge")
_UNSAID = ("segment", "sound_offsets", "sound_norm", "voicing")
"""Settings of labels that their files leave at their defaults: said aloud, these are no other labels."""


def run_name(settings: RunSettings, fingerprint: str) -> str:
    """A folder name that changes when, and only when, something that changes results does.

    Args:
        settings: of the run.
        fingerprint: of the corpus.
    """
    return named(str(settings.corpus["name"]), settings, hash_of(what_counts(settings, fingerprint)))


def named(talker: str, settings: RunSettings, digest: str) -> str:
    """The name of a folder by what can be read in it, and a hash of all that counts."""
    kind = str(settings.face["kind"])
    face = "" if kind == "aam" else kind
    parts = [talker, settings.split, settings.labels_name, settings.model_name, face, digest]
    return "-".join(p for p in parts if p)


def hash_of(counts: Any) -> str:
    """Eight letters that change with what counts, and with the version of the package."""
    return hashlib.sha256(json.dumps([counts, __version__], sort_keys=True).encode()).hexdigest()[:8]


def run_folder(settings: RunSettings, fingerprint: str) -> Path:
    """The folder of a run: the one that is named, else one among all runs by what changes results."""
    return Path(settings.run or Path(settings.runs) / run_name(settings, fingerprint))


def what_counts(settings: RunSettings, fingerprint: str) -> dict[str, Any]:
    """The settings that change results, with the fingerprint of the corpus.

    Those of dynamic visemes count where the labels have some, those of the AAM where the face is one.
    """
    kept = {k: v for k, v in asdict(settings).items() if k not in _NOT_RESULTS}
    if kept["folds"] is None:
        del kept["folds"]
    if not settings.heard_with:
        del kept["heard_with"], kept["balance"]
    kept["trainer"] = _fit_that_counts(kept["trainer"], widest_layer(kept["model"]))
    kept["model"] = system_that_counts(kept["model"])
    read, usual = settings.task.table.settings, Settings()
    same = {name for name in _UNSAID if getattr(read, name) == getattr(usual, name)}
    kept["labels"] = {k: v for k, v in kept["labels"].items() if k not in same}
    if (rate := settings.trajectory.clock.rate).denominator == 1:
        kept["trajectory"]["rate"] = int(rate)  # however it was written
    if kept["face"]["kind"] != "aam":
        del kept["aam"]
    if "visemes" not in settings.task.table.sources:
        del kept["visemes"]
    kept["corpus"] = {"fingerprint": fingerprint, "split": settings.split}
    return kept


def system_that_counts(model: Mapping[str, Any]) -> dict[str, Any]:
    """The settings of a system that change what comes of it: of what it learns from, what that is and not where."""
    counts = {k: v for k, v in model.items() if k != "sources"}
    if sources := model.get("sources"):
        counts["sources"] = {name: {k: v for k, v in own.items() if k != "checkpoint"} for name, own in sources.items()}
    if systems := model.get("systems"):
        counts["systems"] = {name: system_that_counts(own) for name, own in systems.items()}
    return {k: _fit_that_counts(v, widest_layer(counts)) if k == "fit" else v for k, v in counts.items()}


def _fit_that_counts(fit: Mapping[str, Any], widest: int) -> dict[str, Any]:
    """The settings of a fit that change what comes of it; those that are off are left out.

    Args:
        fit: the settings.
        widest: inputs of the widest layer that is fitted.
    """
    off = {"refine", "refine_rate"} if not fit.get("refine") else set()
    off |= {"steps"} if not fit.get("steps") else set()
    if fit.get("optimizer") == "sgd" or not fit.get("base_width") or widest <= fit["base_width"]:
        off |= {"base_width"}
    return {k: v for k, v in fit.items() if k not in {"progress", "figure_every", *SHARING, *off}}


def check_begun(folder: Path, settings: RunSettings, fingerprint: str) -> None:
    """Refuse to go on with a run that was begun with other settings or another corpus.

    Raises:
        DnnvssError: they differ in something that changes results; the first few are named. Or the folder holds
            something that is no run.
    """
    places = RunFiles(folder)
    if not places.provenance.is_file() and foreign(folder):
        raise DnnvssError("holds something that is not a run", file=folder,
                          remedy="Name a folder that is empty or not there yet, or leave run= out")
    if not places.config.is_file() or not places.provenance.is_file():
        return
    corpus = places.written().corpus
    pairs = ((RunSettings.load(folder), corpus), (settings, fingerprint))
    before, now = (_flat(what_counts(s, f)) for s, f in pairs)
    changed = [f"{key} ({before.get(key)}, now {now.get(key)})" for key in sorted({*before, *now})
               if before.get(key) != now.get(key)]
    if changed:
        more = f" and {len(changed) - 3} more" if len(changed) > 3 else ""
        raise DnnvssError(f"holds a run with other settings: {', '.join(changed[:3])}{more}", file=folder,
                          remedy="Leave run= out or name another folder; overwrite=true deletes this run first")


def delete_run(folder: Path) -> None:
    """Delete a run folder, if there is one.

    Raises:
        DnnvssError: the folder holds something that is no run.
    """
    if not folder.exists():
        return
    if foreign(folder) and not RunFiles(folder).provenance.is_file():
        raise DnnvssError("holds something that is not a run, so overwrite=true does not delete it", file=folder,
                          remedy="Choose another folder")
    shutil.rmtree(folder)


def foreign(folder: Path) -> bool:
    """Whether a folder without provenance, which comes first into a run, holds anything but what a kill left."""
    return folder.is_dir() and not all(is_ours(path.name) for path in folder.iterdir())


def _flat(value: Any, name: str = "") -> dict[str, Any]:
    """Nested containers as one, with dotted names."""
    if not isinstance(value, dict):
        return {name: value}
    return {k: v for key, part in value.items() for k, v in _flat(part, f"{name}.{key}" if name else str(key)).items()}
