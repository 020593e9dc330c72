"""Arrays in ``.npz`` files: read within bounds that are checked before anything is held, and by declaration."""

import zipfile
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError

_LEAST, _RATIO = 256_000_000, 20  # bytes that any file may open to, and how many times its own size

_NOUNS = {"f": "numbers", "i": "whole numbers", "u": "whole numbers", "b": "true or false", "U": "text"}


def read_arrays(path: str | Path, remedy: str = "Write the file again", most: int | None = None,
                names: Collection[str] | None = None) -> dict[str, np.ndarray]:
    """The arrays of an ``.npz`` file by name; pickled objects are refused.

    Args:
        path: the file.
        remedy: what to do where it cannot be read.
        most: bytes that the arrays may fill together; 256 MB or twenty times the file, whichever is more, where None.
        names: those that are read, where they are there; all of them where None.

    Raises:
        DnnvssError: the file is missing, cut short, not of its kind, or would open to more than that.
    """

    def load(p: Path) -> dict[str, np.ndarray]:
        with p.open("rb") as file:
            check_sizes(file, p, remedy, max(_LEAST, _RATIO * p.stat().st_size) if most is None else most)
            with zipfile.ZipFile(file) as archive:
                members = {m.filename.removesuffix(".npy"): m for m in archive.infolist()}
                return {name: _member(archive, m) for name, m in members.items() if names is None or name in names}

    found: dict[str, np.ndarray] = files.read(path, load, remedy)
    return found


def check_sizes(file: IO[bytes], path: Path, remedy: str, most: int) -> None:
    """Refuse an archive whose members open to more than ``most`` bytes together.

    Args:
        file: opened; it is left at its start.
        path, remedy: for the message.
        most: bytes.

    Raises:
        DnnvssError: they do.
    """
    with zipfile.ZipFile(file) as archive:
        whole = sum(member.file_size for member in archive.infolist())
    file.seek(0)
    if whole > most:
        raise DnnvssError(f"opens to {whole / 1e6:,.1f} MB, and {most / 1e6:,.1f} MB are the most that it can need",
                          file=path, remedy=remedy)


def _member(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> np.ndarray:
    """One array, whose header promises as much as there is."""
    with archive.open(member) as file:
        shape, columns, dtype = _header(file)
        promised = dtype.itemsize
        for size in shape:
            promised *= size
        if min(shape, default=0) < 0 or not dtype.itemsize or promised != member.file_size - file.tell():
            raise ValueError(f"{member.filename} has no {dtype} of the shape {shape}")
        values = np.frombuffer(bytearray(file.read()), dtype)
        return values.reshape(shape, order="F" if columns else "C")


def _header(file: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype]:
    """Shape, whether columns lie together, and type in the header of an array; the file then stands at its first
    value."""
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, columns, dtype = read(file)
    if dtype.hasobject:
        raise ValueError("it holds objects, not numbers")
    return shape, columns, dtype


@dataclass(frozen=True)
class Held:
    """What an array of a file of ours must be.

    Args:
        dims: its axes: a length, or a letter that stands for one length in all arrays of the file; ``...`` at the end
            for any more axes.
        kinds: of its type, as in ``dtype.kind``: f, i, u, b or U.
        optional: it may be absent.
        finite: whether its numbers must be.
    """

    dims: tuple[Any, ...] = ()
    kinds: str = "f"
    optional: bool = False
    finite: bool = True


def read_declared(path: str | Path, declared: Mapping[str, Held], remedy: str, *, more: bool = False,
                  most: int | None = None, sizes: Mapping[str, int] | None = None) -> dict[str, np.ndarray]:
    """The arrays of a file of ours, each as it is declared.

    Args:
        path: an ``.npz`` file.
        declared: name to what the array must be.
        remedy: what to do where one is not.
        more: the file may hold other arrays, which are given as they are.
        most: as for :func:`read_arrays`.
        sizes: letters of ``dims`` whose length is known.

    Raises:
        DnnvssError: the file cannot be read, or an array is absent, of another shape or type, or not finite.
    """
    arrays = read_arrays(path, remedy, most, None if more else declared)
    check_arrays(arrays, declared, path, remedy, sizes)
    return arrays


def check_arrays(arrays: Mapping[str, np.ndarray], declared: Mapping[str, Held], path: str | Path | None, remedy: str,
                 sizes: Mapping[str, int] | None = None) -> None:
    """Refuse arrays that are not as declared; see :func:`read_declared`."""
    letters = dict(sizes or {})
    if lacking := [name for name, held in declared.items() if name not in arrays and not held.optional]:
        raise DnnvssError(f"lacks {', '.join(lacking)}", file=path, remedy=remedy)
    for name, held in declared.items():
        if name in arrays and (fault := _fault(arrays[name], held, letters)):
            raise DnnvssError(f"{name} {fault}", file=path, remedy=remedy)


def _fault(array: np.ndarray, held: Held, letters: dict[str, int]) -> str | None:
    """What is wrong with an array, None where nothing is; letters that are new get their length."""
    if array.dtype.kind not in held.kinds:
        return f"holds {array.dtype}, not {_NOUNS[held.kinds[0]]}"
    open_end = held.dims[-1:] == (...,)
    dims = held.dims[:-1] if open_end else held.dims
    wrong = array.ndim < len(dims) if open_end else array.ndim != len(dims)
    if not wrong:
        lengths = [letters.setdefault(d, n) if isinstance(d, str) else d
                   for d, n in zip(dims, array.shape, strict=False)]
        wrong = list(array.shape[: len(dims)]) != lengths
    if wrong:
        wanted = ", ".join(str(letters.get(d, d)) if d is not ... else "..." for d in held.dims)
        return f"has the shape {array.shape}, not ({wanted})"
    if held.finite and array.dtype.kind == "f" and not np.isfinite(array).all():
        return "holds numbers that are not finite"
    return None
