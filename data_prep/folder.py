"""Any folder of recordings: a video, its words and its landmarks for each sentence."""

import re
from collections.abc import Mapping
from pathlib import Path

from data_prep.pipeline import Recipe, Source, prepare
from data_prep.splits import read_splits
from data_prep.stages import Workshop
from dnnvss import files
from dnnvss.corpus import CorpusInfo
from dnnvss.errors import DnnvssError
from dnnvss.formats import LAYOUT_68, read_landmarks, read_marks
from dnnvss.text.sentence import spoken_words

VIDEOS = (".mp4", ".mov", ".mkv", ".avi", ".mpg", ".mpeg", ".webm", ".m4v")
"""Kinds of video; where an id has several, the first."""

_LANDMARKS = "Give ID.npz (points, valid), ID.csv of OpenFace, a folder ID of .pts files, or ID_000001.pts, ..."


def prepare_folder(raw: str | Path, out: str | Path, *, name: str = "folder", variant: str = "en_us",
                   lexicon: Mapping[str, str] | None = None, credit: str = "", val: float = 0.05, test: float = 0.05,
                   sync: bool = False, jobs: int = -1, backend: str = "loky", strict: bool = False) -> Path:
    """Return the folder of the prepared corpus.

    For each video ``ID.mp4`` (or another kind) there is ``ID.txt`` with its words, landmarks (see
    :func:`dnnvss.formats.read_landmarks`), and where they are known phone times ``ID.TextGrid`` or ``ID.lab``. Groups
    of landmarks come from ``landmarks.json`` (``{"groups": {name: [first, end]}, "scale": 1}``), or are those of
    68-point landmarks. ``splits/{train,val,test}.txt`` (an id a line) are used where they are; those that are not are
    drawn from the utterances that the others leave.

    Args:
        raw: the folder of recordings.
        out: the folder to write.
        name: name of the prepared corpus.
        variant: pronunciation variant of the talker, ``en_us`` or ``en_gb``.
        lexicon: word to phones, before the variant's lexicon.
        credit: the line shown wherever a picture or number from the corpus is shown.
        val, test: shares of the utterances, where the split is not given.
        sync: measure how late each clip's sound is beside its picture, and move it (:mod:`data_prep.sync`).
        jobs, backend: processes and joblib backend.
        strict: an utterance that would be dropped is an error.

    Raises:
        DnnvssError: no video, unknown groups of landmarks, or nothing is left.
    """
    raw = Path(raw)
    videos = _videos(raw)
    sources = [_source(raw, i, video, variant) for i, video in sorted(videos.items())]
    groups, scale = _groups(raw, sources)
    info = CorpusInfo(name, (0, 0), "25", groups, variant, credit)
    recipe = Recipe(info, read_splits(raw / "splits"), val=val, test=test, scale=scale, lexicon=dict(lexicon or {}),
                    sync=sync)
    return prepare(sources, recipe, Workshop(Path(out), jobs, backend, strict))


def _videos(raw: Path) -> dict[str, Path]:
    if not raw.is_dir():
        raise DnnvssError("no such folder", file=raw, remedy="Set corpus.raw to the folder of your recordings")
    found: dict[str, Path] = {}
    for suffix in VIDEOS:
        for path in sorted(p for p in raw.iterdir() if p.suffix.lower() == suffix):
            found.setdefault(path.stem, path)
    if not found:
        raise DnnvssError("holds no video", file=raw, remedy=f"Put videos there ({' '.join(VIDEOS)})")
    return found


def _source(raw: Path, name: str, video: Path, variant: str) -> Source:
    transcript = raw / f"{name}.txt"
    try:
        text = files.read(transcript, lambda p: p.read_text(encoding="utf-8"), "Write the words of the recording there")
        text = " ".join(text.split())
        words = tuple(word for word, _ in spoken_words(text, variant))
        if not words:
            raise DnnvssError("the transcript holds no word", file=transcript, utterance=name,
                              remedy="Write the words of the recording there")
        marks = _landmarks(raw, name)
    except DnnvssError as error:
        return Source(name, video=video, problem=str(error))
    times = (path for s in (".TextGrid", ".lab") if (path := raw / f"{name}{s}").is_file())
    return Source(name, text, words, video, marks, alignment=next(times, None))


def _landmarks(raw: Path, name: str) -> tuple[Path, ...]:
    for path in (raw / f"{name}.npz", raw / f"{name}.csv", raw / f"{name}.pts", raw / name):
        if path.exists():
            return (path,)
    sequence = tuple(sorted(p for p in raw.glob("*.pts") if re.fullmatch(rf"{re.escape(name)}_\d+", p.stem)))
    if not sequence:
        raise DnnvssError("no landmarks", file=raw / f"{name}.npz", utterance=name, remedy=_LANDMARKS)
    return sequence


def _groups(raw: Path, sources: list[Source]) -> tuple[dict[str, tuple[int, int]], float]:
    """Return the groups of landmarks and what stored coordinates are divided by."""
    described = raw / "landmarks.json"
    if described.is_file():
        marks = read_marks(described)
        if not marks.groups:
            raise DnnvssError("describes no groups of landmarks", file=described,
                              remedy="Write {\"groups\": {\"lips_outer\": [48, 60], ...}} there")
        return marks.groups, marks.scale
    first = next((s for s in sources if not s.problem), None)
    if first is not None and (count := _count(first)) not in (0, 68):
        raise DnnvssError(f"utterance {first.id} has {count} landmarks a frame, and their groups are not known",
                          file=described, remedy="Describe them there: {\"groups\": {\"lips_outer\": [48, 60], ...}}")
    return dict(LAYOUT_68), 1.0


def _count(source: Source) -> int:
    """Return the landmarks of a frame of the first recording; 0 where they cannot be read (the report will say why)."""
    try:
        found = read_landmarks(source.landmarks[0])
    except DnnvssError:
        return 0
    return found.points.shape[1]
