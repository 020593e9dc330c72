"""Stages that run on all cores, keep a result per utterance, and resume where they stopped."""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import joblib
import numpy as np

from data_prep.workers import workers
from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.progress import counted
from dnnvss.shortages import shortage_of
from dnnvss.staging import sweep_tree

FOLDER = ".stages"
"""The folder of stage results inside the prepared corpus."""

Work = Callable[..., dict[str, Any]]


@dataclass(frozen=True)
class Workshop:
    """Where a preparation works, and with how many hands.

    Args:
        out: folder of the prepared corpus.
        jobs: processes; -1 for all cores.
        backend: ``loky``, ``dask`` or ``ray``: :func:`data_prep.workers.workers`.
        strict: an utterance that would be dropped is an error instead.
    """

    out: Path
    jobs: int = -1
    backend: str = "loky"
    strict: bool = False

    def run(self, stage: str, work: Work, tasks: Mapping[str, dict[str, Any]], settings: Any = None) -> dict[str, Any]:
        """Return the result of ``work(name, out, **task)`` of every utterance, from earlier runs where nothing changed.

        Each result is written to ``out/.stages/<stage>/<id>.json`` as soon as it is there. It is made anew when the
        settings, the task or a file that the task names have changed, or where what was kept is damaged. A
        :class:`DnnvssError` about the utterance
        becomes the result ``{"dropped": message}``; one about a file in ``out`` (a full disk) ends the run, and so does
        a shortage of the system's, about which nothing is kept.
        """
        keys = {name: fingerprint(stage, settings, task) for name, task in tasks.items()}
        done = {name: _finished(self._file(stage, name), key) for name, key in keys.items()}
        waiting = [name for name, result in done.items() if result is None]
        if waiting:
            files.remove(self.out / "corpus.json")  # what is being changed cannot be opened
            calls = (joblib.delayed(_one)(self, stage, name, keys[name], work, tasks[name]) for name in waiting)
            with workers(self.backend, self.jobs) as order:
                results: Iterable[tuple[str, Any]] = joblib.Parallel(return_as=order)(calls)
                for name, result in counted(results, stage, total=len(tasks), initial=len(tasks) - len(waiting),
                                             unit="clips"):
                    done[name] = result
        return {name: done[name] for name in tasks}

    def _file(self, stage: str, name: str) -> Path:
        return self.out / FOLDER / stage / f"{name}.json"

    def arrays(self, stage: str, name: str) -> dict[str, np.ndarray]:
        """The arrays that a stage kept beside its result of an utterance.

        Raises:
            DnnvssError: somebody removed or damaged them.
        """
        path = self.out / FOLDER / stage / f"{name}.npz"
        return read_arrays(path, f"Delete {path.parent} and run the same command again: it makes them anew")

    def sweep(self) -> None:
        """Remove the temporary files of workers that were killed, if that can be done: it comes after everything."""
        sweep_tree(self.out)


def fingerprint(*values: Any) -> str:
    """Return a hash of plain values; a path counts with the size and the time of change of what it names."""
    text = json.dumps(values, sort_keys=True, default=_described)
    return hashlib.sha256(text.encode()).hexdigest()[:20]


def _described(value: Any) -> Any:
    if isinstance(value, Path):
        parts = sorted(value.iterdir()) if value.is_dir() else [value]
        return [[str(p), *((s := p.stat()).st_size, s.st_mtime_ns)] if p.exists() else [str(p)] for p in parts]
    return repr(value)


def _finished(path: Path, key: str) -> dict[str, Any] | None:
    """What a stage kept under a key, None where there is nothing or it is not as it was written."""
    if not path.is_file():
        return None
    try:
        kept = json.loads(path.read_text("utf-8"))
    except (ValueError, RecursionError):
        return None
    if not isinstance(kept, dict) or kept.get("key") != key or not isinstance(kept.get("result"), dict):
        return None
    result: dict[str, Any] = kept["result"]
    return result if kept.get("digest") == _digest(result, path) else None


def _digest(result: dict[str, Any], path: Path) -> str:
    """A digest of what a stage keeps of an utterance: its result, and the arrays beside it where there are some."""
    whole = hashlib.sha256(json.dumps(result, sort_keys=True).encode())
    if (arrays := path.with_name(f"{path.stem}.npz")).is_file():
        whole.update(arrays.read_bytes())
    return whole.hexdigest()[:20]


def _one(
    shop: Workshop, stage: str, name: str, key: str, work: Work, task: dict[str, Any]
) -> tuple[str, dict[str, Any]]:
    try:
        result = work(name=name, out=shop.out, **task)
    except ShortageError:
        raise  # it says nothing about the recording
    except DnnvssError as error:
        if error.file is not None and Path(error.file).resolve().is_relative_to(shop.out.resolve()):
            raise
        if (short := shortage_of(error)) is not None:
            raise short from error
        result = {"dropped": str(error)}
    path = shop._file(stage, name)
    plain: dict[str, Any] = json.loads(json.dumps(result))  # as a later call will read it
    files.write_text(path, json.dumps({"key": key, "digest": _digest(plain, path), "result": plain}))
    return name, plain
