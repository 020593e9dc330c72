"""What a system learnt, of runs of any age: arrays and plain containers, without torch where they lie in ``.npz``."""

from pathlib import Path
from typing import Any

from dnnvss.training.arrays import load_arrays


def read_learnt(path: Path) -> dict[str, Any]:
    """What a system learnt, of a ``model.npz``, or of a ``model.pt`` as runs of before have it, as arrays.

    Raises:
        DnnvssError: as :func:`load_arrays`.
    """
    if path.suffix == ".npz":
        return load_arrays(path)
    from dnnvss.training.checkpoints import load_checkpoint  # loads torch

    learnt: dict[str, Any] = _as_arrays(load_checkpoint(path))
    return learnt


def _as_arrays(value: Any) -> Any:
    """Nested containers with their tensors as arrays."""
    if isinstance(value, dict):
        return {key: _as_arrays(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(_as_arrays(part) for part in value)
    return value.numpy() if hasattr(value, "detach") else value
