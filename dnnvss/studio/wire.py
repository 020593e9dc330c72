"""What the service and its workers send each other: a head as JSON, and bytes behind it."""

import asyncio
import json
import struct
from collections.abc import Mapping
from typing import Any, BinaryIO

_LENGTHS = struct.Struct(">II")


def framed(head: Mapping[str, Any], body: bytes = b"") -> bytes:
    """A message: the lengths of head and body in four bytes each, then both."""
    text = json.dumps(head, allow_nan=False).encode()
    return _LENGTHS.pack(len(text), len(body)) + text + body


def read_frame(file: BinaryIO) -> tuple[dict[str, Any], bytes] | None:
    """The next message of a file; None where it has ended."""
    lengths = file.read(_LENGTHS.size)
    if len(lengths) < _LENGTHS.size:
        return None
    head, body = (file.read(length) for length in _LENGTHS.unpack(lengths))
    return json.loads(head), body


async def receive(reader: asyncio.StreamReader) -> tuple[dict[str, Any], bytes]:
    """The next message.

    Raises:
        asyncio.IncompleteReadError: who sends has ended.
    """
    head, body = _LENGTHS.unpack(await reader.readexactly(_LENGTHS.size))
    return json.loads(await reader.readexactly(head)), await reader.readexactly(body)
