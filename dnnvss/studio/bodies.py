"""JSON that strangers may have sent: bounded in depth, and strict."""

import json
from typing import Any

from dnnvss.errors import DnnvssError

DEPTH = 20
"""Lists and objects within each other that a body may have."""


def read_body(body: bytes) -> Any:
    """The value of a JSON text in UTF-8.

    Raises:
        DnnvssError: it is no JSON, holds NaN or Infinity, or is nested more deeply than :data:`DEPTH`.
    """
    try:
        value = json.loads(body.decode(), parse_constant=_refuse)
    except RecursionError:
        raise _nested() from None
    except ValueError as error:
        raise DnnvssError(f"what was sent is no JSON: {error}", remedy="Load the page again") from None
    if _depth(value) > DEPTH:
        raise _nested()
    return value


def _nested() -> DnnvssError:
    return DnnvssError(f"what was sent is nested more than {DEPTH} deep", remedy="Load the page again")


def _refuse(name: str) -> Any:
    raise ValueError(f"{name} is no number")


def _depth(value: Any) -> int:
    """How many lists and objects stand within each other, 0 for a single value."""
    depth, row = -1, [value]
    while row:
        depth += 1
        inner = [each for each in row if isinstance(each, list | dict)]
        row = [child for each in inner for child in (each.values() if isinstance(each, dict) else each)]
        if inner and not row:
            depth += 1
    return depth
