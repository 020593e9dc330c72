"""What a system learnt as arrays and JSON in one ``.npz``: nothing in it is run when it is opened, and torch is not
needed."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.errors import DnnvssError

_REMEDY = "Train the run anew, or export it again"


def save_arrays(path: Path, state: dict[str, Any]) -> Path:
    """Write arrays, tensors and plain containers as ``.npz``, whole or not at all, and return the path.

    The arrays are numbered; ``tree`` is JSON in UTF-8 that says where each belongs.
    """
    arrays: list[np.ndarray] = []
    tree = _taken_apart(state, arrays)
    named = {str(k): array for k, array in enumerate(arrays)}
    return files.write_arrays(path, tree=np.frombuffer(json.dumps(tree).encode(), np.uint8), **named)


def load_arrays(path: Path, leaf: Callable[[np.ndarray], Any] = np.asarray) -> dict[str, Any]:
    """What :func:`save_arrays` wrote, every array as ``leaf`` gives it.

    Raises:
        DnnvssError: the file is missing, damaged, or holds anything else.
    """
    arrays = read_arrays(path, _REMEDY)
    try:
        state = _put_together(json.loads(arrays.pop("tree").tobytes()), arrays, leaf)
    except (LookupError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise DnnvssError(f"holds no state of a system ({type(error).__name__})", file=path, remedy=_REMEDY) from error
    if not isinstance(state, dict):
        raise DnnvssError("holds no state of a system", file=path, remedy=_REMEDY)
    return state


def _taken_apart(value: Any, arrays: list[np.ndarray]) -> Any:
    """A value as JSON, its arrays and tensors taken out into ``arrays``."""
    if hasattr(value, "__array__"):
        arrays.append(np.asarray(value.detach().cpu() if hasattr(value, "detach") else value))
        return {"array": len(arrays) - 1}
    if isinstance(value, dict):
        return {"table": [[key, _taken_apart(part, arrays)] for key, part in value.items()]}
    if isinstance(value, list | tuple):
        return {type(value).__name__: [_taken_apart(part, arrays) for part in value]}
    assert value is None or isinstance(value, bool | int | float | str), type(value)
    return {"value": value}


def _put_together(tree: Any, arrays: dict[str, np.ndarray], leaf: Callable[[np.ndarray], Any]) -> Any:
    (kind, value), = tree.items()
    if kind == "array":
        return leaf(arrays[str(value)])
    if kind == "table":
        return {key: _put_together(part, arrays, leaf) for key, part in value}
    if kind in ("list", "tuple"):
        parts = [_put_together(part, arrays, leaf) for part in value]
        return parts if kind == "list" else tuple(parts)
    if kind != "value" or isinstance(value, dict | list):
        raise ValueError(kind)
    return value
