"""Ways to damage a file: as bytes, as lines, as values of JSON, as arrays of an archive."""

import copy
import io
import json
import random
import re
import struct
import zipfile
from collections.abc import Callable
from typing import Any

import numpy as np
import torch

ODD = (
    "",
    "-1",
    "0",
    "1e999",
    "-1e999",
    "nan",
    "inf",
    "9" * 400,
    "400000000",
    "1" + "0" * 30,
    "٣",
    "½",
    "0x10",
    "1_0",
    "1,5",
    "true",
    "null",
    "../../escaped",
    "/etc/passwd",
    "CON",
    "a\\b",
    "\x00",
    "\u202e",
    "\x1b[31m\x07",
    "é" * 300,
    "[]",
    "{}",
    '"',
    ",",
    "\t",
)
"""Words that stand in for a value of a text file."""
VALUES: tuple[Any, ...] = (
    None,
    True,
    False,
    0,
    -1,
    1,
    10**30,
    int("9" * 400),
    4e8,
    1e308,
    float("inf"),
    float("nan"),
    "",
    "abc",
    "../../escaped",
    "/x",
    "٣",
    "1/0",
    "\x00",
    "\x1b]0;own\x07",
    [],
    [[]],
    [-1],
    {},
    {"a": 1},
    {"": None},
)
"""What stands in for a value of JSON."""


def damaged(data: bytes, rng: random.Random) -> bytes:
    """The data with one to three damages of kinds that fit what it is."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        data = rng.choice(_kinds(data))(data, rng)
    return data


def _kinds(data: bytes) -> list[Callable[[bytes, random.Random], bytes]]:
    if data[:2] == b"PK":
        return [_arrays, _arrays, _arrays, _arrays, _flip, _cut, _claim]
    if data[:4] == b"glTF":
        return [_document, _document, _document, _document, _flip, _cut, _insert]
    if b"producer_name" in data or b"pytorch" in data[:64]:
        return [_described, _described, _described, _described, _flip, _cut, _insert]
    kinds = [_cut, _flip, _insert, _lines, _word, _word, _word, _encoding, _nested]
    if _is_json(data):
        return [*kinds, _value, _value, _value, _value, _value]
    return [*kinds, _json_line, _json_line, _json_line] if _is_json(data.split(b"\n")[0]) else kinds


def _is_json(data: bytes) -> bool:
    try:
        json.loads(data)
    except (ValueError, RecursionError):
        return False
    return True


def _cut(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] if rng.random() < 0.7 else data[at:]


def _flip(data: bytes, rng: random.Random) -> bytes:
    made = bytearray(data)
    for _ in range(rng.choice((1, 1, 4, 30))):
        if made:
            made[rng.randrange(len(made))] ^= 1 << rng.randrange(8)
    return bytes(made)


def _insert(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return (
        data[:at]
        + rng.choice((b"\x00", b"\xff\xfe", b"\xc3", b"{", b"\n\n", rng.randbytes(9), b"9" * 500))
        + data[at:]
    )


def _lines(data: bytes, rng: random.Random) -> bytes:
    """Lines that come twice, change places or are gone."""
    lines = data.split(b"\n")
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    match rng.randrange(4):
        case 0:
            lines.insert(b, lines[a])
        case 1:
            lines[a], lines[b] = lines[b], lines[a]
        case 2:
            del lines[a]
        case _:
            lines = lines[:a] + [lines[a]] * rng.choice((2, 300)) + lines[a:]
    return b"\n".join(lines)


def _word(data: bytes, rng: random.Random) -> bytes:
    """One word or number in another's place."""
    found = list(re.finditer(rb"[^\s,:;=\[\]{}\"]+", data))
    if not found:
        return data
    at = rng.choice(found)
    other = rng.choice(found)[0] if rng.random() < 0.3 else rng.choice(ODD).encode()
    return data[: at.start()] + other + data[at.end() :]


def _encoding(data: bytes, rng: random.Random) -> bytes:
    text = data.decode("utf-8", "replace")
    return text.encode(
        rng.choice(("utf-16", "utf-16-le", "utf-32", "utf-8-sig", "utf-7", "cp500")), "replace"
    )


def _nested(data: bytes, rng: random.Random) -> bytes:
    depth = rng.choice((30, 2000, 100_000))
    return (
        b"[" * depth + data[:40] + b"]" * depth
        if rng.random() < 0.5
        else b'{"a":' * depth + b"1" + b"}" * depth
    )


def _value(data: bytes, rng: random.Random) -> bytes:
    return json.dumps(_changed(json.loads(data), rng)).encode()


def _document(data: bytes, rng: random.Random) -> bytes:
    """A binary glTF file whose document says something else."""
    try:
        length = struct.unpack_from("<I", data, 12)[0]
        text = json.dumps(_changed(json.loads(data[20 : 20 + length]), rng)).encode()
    except Exception:
        return _flip(data, rng)
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    head = data[:8] + struct.pack("<I", 20 + len(text) + len(rest)) + struct.pack("<I4s", len(text), b"JSON")
    return head + text + rest


def _json_line(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    at = rng.randrange(len(lines))
    if _is_json(lines[at]):
        lines[at] = _value(lines[at], rng)
    return b"\n".join(lines)


def _odd(rng: random.Random) -> Any:
    """One of the values, its own copy: what takes it may change it."""
    return copy.deepcopy(rng.choice(VALUES))


def _changed(value: Any, rng: random.Random, depth: int = 0) -> Any:
    """Plain containers in which one value is another, absent, or there under another name."""
    if not isinstance(value, list | dict) or not value or rng.random() < 0.15 + 0.05 * depth:
        return _odd(rng)
    keys = list(value) if isinstance(value, dict) else list(range(len(value)))
    key = rng.choice(keys)
    made = dict(value) if isinstance(value, dict) else list(value)
    what = rng.random()
    if what < 0.12:
        del made[key]
    elif what < 0.2 and isinstance(made, dict):
        made[rng.choice(("extra", "", "__class__", "_target_"))] = _odd(rng)
    elif what < 0.3 and isinstance(made, list):
        made.insert(key, made[key])
    else:
        made[key] = _changed(made[key], rng, depth + 1)
    return made


def _arrays(data: bytes, rng: random.Random) -> bytes:
    """An archive in which one array is another, of another type or shape, absent, or several."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            held = {name: archive[name] for name in archive.files if name != "archive/data"}
        if "archive/data.pkl" in held or not all(isinstance(array, np.ndarray) for array in held.values()):
            return _state(data, rng)
    except Exception:
        return _flip(data, rng)
    if not held or max(array.size for array in held.values()) > 1e7:
        return data
    name = rng.choice(sorted(held))
    array = held[name]
    made: tuple[Callable[[], Any], ...] = (
        lambda: np.zeros(0),
        lambda: array.reshape(-1),
        lambda: array[None],
        lambda: array[..., :-1] if array.ndim else array,
        lambda: array[:-1] if array.ndim else array,
        lambda: np.full(array.shape, np.nan),
        lambda: np.full(array.shape, np.inf),
        lambda: np.full(array.shape, "abc"),
        lambda: np.zeros(array.shape, "M8[s]"),
        lambda: np.zeros(array.shape, [("f", "<f4")]),
        lambda: np.zeros(array.shape, complex),
        lambda: np.full(array.shape, -1),
        lambda: np.full(array.shape, 10**18),
        lambda: np.array(3.0),
        lambda: np.zeros((0, *array.shape[1:]), array.dtype),
        lambda: np.array({"a": 1}, object),
        lambda: held[rng.choice(sorted(held))],
        lambda: np.zeros(array.shape, "S3"),
        lambda: np.zeros(array.shape, bool),
    )
    if rng.random() < 0.1:
        del held[name]
    else:
        held[name] = rng.choice(made)()
    whole = io.BytesIO()
    (np.savez_compressed if rng.random() < 0.3 else np.savez)(whole, **held)
    return whole.getvalue()


def _state(data: bytes, rng: random.Random) -> bytes:
    """A checkpoint in which one tensor or value is another or absent."""
    odd = (torch.zeros(0), torch.full((2, 2), float("nan")), torch.zeros(3, dtype=torch.int64))
    state = _changed(torch.load(io.BytesIO(data), weights_only=True), rng)
    if isinstance(state, dict) and state and rng.random() < 0.4:
        part = state[next(iter(state))] if rng.random() < 0.3 else state.get("state")
        if isinstance(part, dict) and part:
            part[rng.choice(list(part))] = rng.choice(odd)
    whole = io.BytesIO()
    torch.save(state, whole)
    return whole.getvalue()


def _described(data: bytes, rng: random.Random) -> bytes:
    """An ONNX file whose description says something else."""
    import onnx

    try:
        model = onnx.load_from_string(data)
        held = model.metadata_props[rng.randrange(len(model.metadata_props))]
        held.value = json.dumps(_changed(json.loads(held.value), rng))
    except Exception:
        return _flip(data, rng)
    made: bytes = model.SerializeToString()
    return made


def _claim(data: bytes, rng: random.Random) -> bytes:
    """An archive in which the header of one array promises gigabytes, or whose zeros fill them."""
    whole = io.BytesIO()
    shape = rng.choice(((10**9,), (10**5, 10**5), (-1, 5), (2**40, 2**40), (10**12, 0)))
    header = f"{{'descr': '{rng.choice(('<f4', '<f8', '<U0', '|b1'))}', 'fortran_order': False, 'shape': {shape}, }}"
    padded = header.encode().ljust(117) + b"\n"
    try:
        with (
            zipfile.ZipFile(io.BytesIO(data)) as old,
            zipfile.ZipFile(whole, "w", zipfile.ZIP_DEFLATED) as new,
        ):
            names = old.namelist()
            other = rng.choice(names)
            for name in names:
                body = (
                    b"\x93NUMPY\x01\x00"
                    + struct.pack("<H", len(padded))
                    + padded
                    + bytes(rng.choice((0, 64, 10**7)))
                )
                new.writestr(name, body if name == other else old.read(name))
    except Exception:
        return _flip(data, rng)
    return whole.getvalue()
