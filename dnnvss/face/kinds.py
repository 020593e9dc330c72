"""The kinds of faces by name, and what each tells the rest of the package about itself."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np

from dnnvss.archives import Held, read_declared
from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Code, Face
from dnnvss.face.clips import Clip

FACES: dict[str, str] = {"aam": "dnnvss.face.aam.kind", "points": "dnnvss.face.points.kind",
                         "rig": "dnnvss.face.rig.kind"}
"""Name of a kind to the module whose ``KIND`` describes it; loaded when it is first asked for."""
_REMEDY = "Train again, or delete the file and run the same command"


class FaceSettings(Protocol):
    """How a face is fitted: a frozen dataclass that names its kind."""

    face: ClassVar[str]


@dataclass(frozen=True)
class Encoded:
    """A clip as a kind encodes it: its code, and arrays to be kept beside it for the report."""

    code: Code
    notes: Mapping[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class FaceKind:
    """A kind of face: how it is fitted to clips, encodes them, and is kept.

    Args:
        name: of the kind, in ``face=NAME`` and in the files of faces.
        version: raised when the code changes what it computes, so that old encodings are not taken for new.
        read: plain containers (YAML) to settings.
        plain: settings to plain containers, which the key of an encoding is made from.
        fit: clips, the corpus's landmark groups, settings and ``progress=`` to a face.
        encode: a face and a clip to what is kept; :class:`~dnnvss.face.clips.UnusableClipError` drops the clip.
        report: face, corpus, splits, folder of the codes (``<id>.npz``) and ids of what was encoded, to plain
            containers.
        stabilise: face, tracked landmarks (F, L, 2 or 3) and the clip's code to the points (F, P, 2 or 3) in the
            reference frame, without head pose and what is the clip's own: what ``Face.points`` would give if the face
            could express everything.
        load, load_code: from the files that ``Face.save`` and ``Code.save`` wrote.
        pictures: whether clips need pictures.
        lacks: what faces of this kind cannot show, a sentence for reports; empty where there is nothing to say.
    """

    name: str
    version: int
    read: Callable[[Mapping[str, Any]], Any]
    plain: Callable[[Any], dict[str, Any]]
    fit: Callable[..., Face]
    encode: Callable[[Any, Clip], Encoded]
    report: Callable[[Any, Corpus, Mapping[str, Sequence[str]], Path, Sequence[str]], dict[str, Any]]
    stabilise: Callable[[Any, np.ndarray, Any], np.ndarray]
    load: Callable[[Path], Face]
    load_code: Callable[[Path], Code]
    pictures: bool = True
    lacks: str = ""


def face_kind(name: str) -> FaceKind:
    """The kind of a name.

    Raises:
        DnnvssError: there is none.
    """
    if name not in FACES:
        raise DnnvssError(f"no face is of the kind {name!r}", remedy=f"Use one of {', '.join(FACES)}")
    kind: FaceKind = import_module(FACES[name]).KIND
    return kind


def read_face_settings(kind: str, values: Mapping[str, Any]) -> FaceSettings:
    """The settings of a kind, from plain containers.

    Raises:
        DnnvssError: an unknown kind or setting, or a value that means nothing.
    """
    settings: FaceSettings = face_kind(kind).read(values)
    return settings


def load_face(path: Path) -> Face:
    """The face in a file, of whichever kind.

    Raises:
        DnnvssError: the file is missing, damaged or of a kind that this version does not know.
    """
    return face_kind(str(read_declared(path, {"kind": Held((), "U")}, _REMEDY)["kind"])).load(path)
