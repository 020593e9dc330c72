"""Checkpoints: tensors and plain containers, written whole or not at all; for others, as arrays and JSON."""

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import torch

from dnnvss import files
from dnnvss.archives import check_sizes, read_arrays
from dnnvss.errors import DnnvssError, ShortageError

T = TypeVar("T")


def load_checkpoint(path: Path) -> dict[str, Any]:
    """Return the tensors and plain containers in a checkpoint, or in the ``.npz`` of :func:`save_arrays`.

    Raises:
        DnnvssError: the file is missing, cut short, or holds anything but tensors and plain containers.
    """
    remedy = "Delete it and run the same train.py command again"
    if path.suffix == ".npz":
        return _from_arrays(path)
    state = files.read(path, lambda p: _load(p, remedy), remedy)
    if not isinstance(state, dict):
        raise DnnvssError("is not a checkpoint of this package", file=path, remedy=remedy)
    return state


def read_checkpoint(path: Path, build: Callable[[dict[str, Any]], T], remedy: str) -> T:
    """What is built of a checkpoint; one that lacks a part, or has it in another shape, is told as damaged.

    Args:
        path: the file.
        build: makes it of the tensors and plain containers.
        remedy: what to do where that fails.

    Raises:
        DnnvssError: it cannot be read, or nothing can be built of it.
    """
    def read(p: Path) -> T:
        try:
            return build(load_checkpoint(p))
        except ShortageError:
            raise
        except DnnvssError as error:
            raise DnnvssError(error.problem, file=path, remedy=error.remedy or remedy) from error

    made: T = files.read(path, read, remedy)
    return made


def save_checkpoint(path: Path, state: dict[str, Any]) -> None:
    """Write tensors and plain containers to ``path``, whole or not at all."""
    whole = io.BytesIO()
    torch.save(state, whole)  # in memory: torch's own writer does not say that a disk is full
    with files.replacing(path) as temporary:
        temporary.write_bytes(whole.getbuffer())


def save_arrays(path: Path, state: dict[str, Any]) -> Path:
    """Write tensors and plain containers as ``.npz``, whole or not at all, and return the path.

    The arrays are numbered; ``tree`` is JSON in UTF-8 that says where each belongs. Nothing in the file is run when it
    is opened, by this program or another.
    """
    arrays: list[np.ndarray] = []
    tree = _taken_apart(state, arrays)
    named = {str(k): array for k, array in enumerate(arrays)}
    return files.write_arrays(path, tree=np.frombuffer(json.dumps(tree).encode(), np.uint8), **named)


def _taken_apart(value: Any, arrays: list[np.ndarray]) -> Any:
    """A value as JSON, its tensors taken out into ``arrays``."""
    if isinstance(value, torch.Tensor):
        arrays.append(value.detach().cpu().numpy())
        return {"array": len(arrays) - 1}
    if isinstance(value, dict):
        return {"table": [[key, _taken_apart(part, arrays)] for key, part in value.items()]}
    if isinstance(value, list | tuple):
        return {type(value).__name__: [_taken_apart(part, arrays) for part in value]}
    assert value is None or isinstance(value, bool | int | float | str), type(value)
    return {"value": value}


def _from_arrays(path: Path) -> dict[str, Any]:
    remedy = "Export the run again: dnnvss export RUN"
    arrays = read_arrays(path, remedy)
    try:
        state = _put_together(json.loads(arrays.pop("tree").tobytes()), arrays)
    except (LookupError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise DnnvssError(f"holds no state of a system ({type(error).__name__})", file=path, remedy=remedy) from error
    if not isinstance(state, dict):
        raise DnnvssError("holds no state of a system", file=path, remedy=remedy)
    return state


def _put_together(tree: Any, arrays: dict[str, np.ndarray]) -> Any:
    (kind, value), = tree.items()
    if kind == "array":
        return torch.from_numpy(arrays[str(value)])
    if kind == "table":
        return {key: _put_together(part, arrays) for key, part in value}
    if kind in ("list", "tuple"):
        parts = [_put_together(part, arrays) for part in value]
        return parts if kind == "list" else tuple(parts)
    if kind != "value" or isinstance(value, dict | list):
        raise ValueError(kind)
    return value


def _load(path: Path, remedy: str) -> Any:
    """What a file of torch's holds, if it is an archive of tensors and opens to what it is.

    Older formats of torch's tell sizes that nothing checks.
    """
    with path.open("rb") as file:
        if file.read(4) != b"PK\x03\x04":
            raise DnnvssError("is not a checkpoint of this package", file=path, remedy=remedy)
        check_sizes(file, path, remedy, path.stat().st_size)
    return torch.load(path, map_location="cpu", weights_only=True)
