"""FACEGOOD's tracks: a voice and the 116 curves of a rig, animated by hand.

Source: FACEGOOD/FACEGOOD-Audio2Face (MIT).
"""

from pathlib import Path

import numpy as np

from data_prep.pipeline import prepare
from data_prep.recipe import Recipe, Source
from data_prep.shelf import Shelf
from data_prep.splits import given_splits
from data_prep.stages import FOLDER, Workshop
from data_prep.untold import speech_alone
from dnnvss import files
from dnnvss.archives import read_arrays
from dnnvss.corpus import UNITS, CorpusInfo
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.formats import write_npz
from dnnvss.formats.openface import Landmarks

CREDIT = "FACEGOOD-Audio2Face: voice and rig curves, FACEGOOD Co. (MIT)"
RATE = "30"
_PREFIX, _NAMES = "bs_value_", "bsname.txt"
_REMEDY = "Set corpus.raw to the folder with ID.flac, bs_value_ID.npz and bsname.txt"


def prepare_facegood(
    raw: str | Path,
    out: str | Path,
    *,
    name: str = "facegood",
    jobs: int = -1,
    backend: str = "loky",
    strict: bool = False,
) -> Path:
    """Return the folder of the prepared corpus: ``ID.flac`` (wav, mp3) and ``bs_value_ID.npz`` of each track.

    Args:
        raw: the tracks, and ``bsname.txt``, the number and the names of the curves.
        out: the folder to write.
        name: of the corpus.
        jobs, backend: processes and joblib backend.
        strict: a track that would be dropped is an error.

    Raises:
        DnnvssError: no track, or names that are not those of the curves.
    """
    shelf, shop = Shelf(Path(raw)), Workshop(Path(out), jobs, backend, strict)
    names = curve_names(shelf.root / _NAMES)
    tracks = dict(shelf.of_kind(".flac", ".wav", ".mp3"))
    if not tracks:
        raise DnnvssError("holds no sound", file=shelf.root, remedy=_REMEDY)
    sources = [_source(shelf, shop, i, path, len(names)) for i, path in sorted(tracks.items())]
    rows = {curve: (k, k + 1) for k, curve in enumerate(names)}
    info = CorpusInfo(name, (0, 0), RATE, rows, "en_us", CREDIT, 1, UNITS[1])
    recipe = Recipe(
        info, given_splits(shelf.root), val=0.15, test=0.15, rate=RATE, speech_valid=0.5
    )
    return prepare(sources, recipe, shop)


def curve_names(path: Path) -> tuple[str, ...]:
    """The names of the columns, from a ``bsname.txt`` whose first line is the number of its names.

    The tracks lie a column behind it: column k holds the curve of name k - 1, and the first that of the last. Told by
    the curves themselves: only so do the ten pairs of left and right that move agree (correlation .9996; as the file
    stands .29), and the curve that follows loudness is ``mouth_stretch_c``, the open jaw.

    Raises:
        DnnvssError: it is missing, or holds another number of names.
    """
    lines = [line.strip() for line in files.read_text(path, _REMEDY).splitlines() if line.strip()]
    if not lines or lines[0] != str(len(lines) - 1) or len(set(lines[1:])) < len(lines) - 1:
        raise DnnvssError(
            f"holds {len(lines) - 1} names, and its first line says {lines[0] if lines else 'nothing'}",
            file=path,
            remedy="Give the number of curves, and a name a line",
        )
    return (lines[-1], *lines[1:-1])


def _source(shelf: Shelf, shop: Workshop, name: str, sound: Path, count: int) -> Source:
    path = shelf.root / f"{_PREFIX}{name}.npz"
    try:
        arrays = [
            a for a in read_arrays(path, _REMEDY).values() if a.ndim == 2 and a.shape[1] == count
        ]
        if len(arrays) != 1 or not np.isfinite(arrays[0]).all():
            raise DnnvssError(
                f"holds no curves (frames, {count})", file=path, utterance=name, remedy=_REMEDY
            )
        marks = shop.out / FOLDER / "curves" / f"{name}.npz"
        if not marks.is_file() or marks.stat().st_mtime < path.stat().st_mtime:
            write_npz(
                marks,
                Landmarks(arrays[0].astype(np.float32)[..., None], np.ones(len(arrays[0]), bool)),
            )
        return speech_alone(Source(name, landmarks=(marks,), sound=sound), shop)
    except ShortageError:
        raise
    except DnnvssError as error:
        return Source(name, problem=str(error))
