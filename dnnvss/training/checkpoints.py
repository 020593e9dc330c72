"""Checkpoints: tensors and plain containers, written whole or not at all."""

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import torch

from dnnvss import files
from dnnvss.archives import check_sizes
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.training.arrays import load_arrays

T = TypeVar("T")


def load_checkpoint(path: Path) -> dict[str, Any]:
    """Return the tensors and plain containers in a checkpoint, or in the ``.npz`` of
    :func:`dnnvss.training.arrays.save_arrays`.

    Raises:
        DnnvssError: the file is missing, cut short, or holds anything but tensors and plain containers.
    """
    remedy = "Delete it and run the same command (dnnvss train) again"
    if path.suffix == ".npz":
        return load_arrays(path, torch.from_numpy)
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


def _load(path: Path, remedy: str) -> Any:
    """What a file of torch's holds, if it is an archive of tensors and opens to what it is.

    Older formats of torch's tell sizes that nothing checks.
    """
    with path.open("rb") as file:
        if file.read(4) != b"PK\x03\x04":
            raise DnnvssError("is not a checkpoint of this package", file=path, remedy=remedy)
        check_sizes(file, path, remedy, path.stat().st_size)
    return torch.load(path, map_location="cpu", weights_only=True)
