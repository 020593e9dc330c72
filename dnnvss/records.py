"""JSON files of ours, read as what a settings dataclass declares."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.settings import read_settings, shown

T = TypeVar("T")


def read_record(cls: type[T], path: str | Path, remedy: str) -> T:
    """What a JSON file holds, as an instance of a settings dataclass.

    Raises:
        DnnvssError: the file cannot be read, or holds other names, types or values than the class declares.
    """
    return as_record(cls, files.read_json(path, remedy), path, remedy)


def as_record(cls: type[T], value: Any, path: str | Path, remedy: str | None, place: str = "") -> T:
    """A value out of a file, as an instance of a settings dataclass.

    Args:
        cls: the dataclass.
        value: plain containers.
        path: the file, for messages.
        remedy: what to do where the value is no such instance; None where its names and values are what
            somebody asks, who is told of each what it may be.
        place: where in the file it stands, such as ``line 3``.

    Raises:
        DnnvssError: it has other names, types or values than the class declares.
    """
    before = f"{place}: " if place else ""
    if not isinstance(value, Mapping):
        raise DnnvssError(f"{before}{shown(value)} is no table of names and values", file=path, remedy=remedy)
    try:
        return read_settings(cls, value, "")
    except DnnvssError as error:
        raise DnnvssError(f"{before}{error.problem}", file=path, remedy=remedy or error.remedy) from error


def read_value(path: str | Path, names: str, kind: type[T], remedy: str) -> T:
    """One value of a JSON file, found by names with dots between them.

    Raises:
        DnnvssError: the file cannot be read, has no such value, or one of another type.
    """
    value = files.read_json(path, remedy)
    for name in names.split("."):
        value = value.get(name) if isinstance(value, Mapping) else None
    if type(value) is int and kind is float and abs(value) < 2**63:
        value = float(value)
    if not isinstance(value, kind):
        raise DnnvssError(f"{names} is {shown(value)}", file=path, remedy=remedy)
    return value
