"""A prepared corpus on disk: ``corpus.json``, ``utterances.jsonl``, ``splits/*.txt``, media and landmarks."""

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.archives import Held, read_declared
from dnnvss.corpus.utterance import Utterance, read_utterances
from dnnvss.errors import DnnvssError
from dnnvss.media import SPEECH_RATE, Sound, read_audio
from dnnvss.records import read_record
from dnnvss.settings import setting
from dnnvss.timing import FrameClock

SPLITS = ("train", "val", "test")
"""Splits of a corpus, and of each variant of it (``unseen_train``, ...)."""
UNITS = {1: "curve", 2: "px", 3: "mm"}
"""Coordinates of a landmark to their unit; with one, each is the value of a named curve of a rig."""
_MOST = 100_000  # pixels of a side, points of a frame
_POINTS = 1000  # of a frame, more than any markup has
_SPARE = 1_000_000  # bytes of headers and of what older corpora keep beside the landmarks


def split_files(folder: Path) -> dict[str, list[str]]:
    """Return the ids in each ``*.txt`` of a folder by the name of the file; nothing if there is no folder.

    A file has one id a line; ids may hold spaces, blank lines do not count, nor does an id that was there before.

    Raises:
        DnnvssError: a file cannot be read.
    """

    remedy = "Give one id a line"

    def ids(path: Path) -> list[str]:
        lines = (line.strip() for line in files.read_text(files.inside(folder, path.name), remedy).splitlines())
        return list(dict.fromkeys(filter(None, lines)))

    there = sorted(folder.iterdir()) if folder.is_dir() else []
    return {p.stem.lower() if p.stem.lower() in SPLITS else p.stem: ids(p)
            for p in there if p.suffix.lower() == ".txt" and not p.name.startswith(".")}


def check_apart(splits: Mapping[str, Sequence[str]], folder: Path) -> None:
    """Refuse splits of one variant that share utterances: what is tested must not have been trained on.

    Args:
        splits: ids by name of the split; ``train``, ``val`` and ``test``, with or without a variant before them.
        folder: where they are, for the message.

    Raises:
        DnnvssError: an id is in two splits of one variant; the first few are named.
    """
    for one, two in combinations(splits, 2):
        (variant, _, kind), (other, _, kind_too) = one.rpartition("_"), two.rpartition("_")
        if variant != other or not {kind, kind_too} <= set(SPLITS):
            continue
        if both := sorted(set(splits[one]) & set(splits[two])):
            more = f" and {len(both) - 3} more" if len(both) > 3 else ""
            raise DnnvssError(f"{one} and {two} both name {', '.join(both[:3])}{more}", file=folder,
                              remedy="Let each utterance be in one of them")


@dataclass(frozen=True)
class CorpusInfo:
    """What holds for the whole corpus.

    Args:
        name: short name, used in folder names.
        size: width and height of the video in pixels; 0 and 0 where there is none and nothing says it.
        rate: frame rate of the video, as text (``"25"``, ``"30000/1001"``).
        landmark_groups: name of a group of landmark points to the half-open range of its rows.
        variant: pronunciation variant of the talker (``"en_us"``, ``"en_gb"``).
        credit: the line to print wherever a picture or number made from the corpus is shown.
        dimensions: coordinates of a landmark, 2 or 3; 1 where each is a curve of a rig, and its group names it.
        unit: of the landmarks: ``px``, ``mm``, or ``curve`` for that of each curve.
    """

    name: str
    size: tuple[int, int]
    rate: str
    landmark_groups: Mapping[str, tuple[int, int]] = setting({}, least=0, most=_MOST)
    variant: str = setting("en_us", choices=("en_us", "en_gb"))
    credit: str = ""
    dimensions: int = setting(2, choices=UNITS)
    unit: str = setting(UNITS[2], choices=UNITS.values())

    def to_json(self) -> dict[str, Any]:
        """Plain containers; what later versions added is left out where it is as it always was."""
        added = {"dimensions": 2, "unit": UNITS[2]}
        return {name: value for name, value in asdict(self).items() if value != added.get(name)}

    def check(self, file: Path, remedy: str) -> None:
        """Refuse a rate or a size that is none and a group without points.

        Raises:
            DnnvssError: names the file that says so.
        """
        FrameClock.from_setting(self.rate, f"{file}: rate")
        if not 0 <= min(self.size) <= max(self.size) <= _MOST:
            raise DnnvssError(f"size is {list(self.size)}", file=file, remedy=remedy)
        for name, (first, end) in self.landmark_groups.items():
            if first >= end:
                raise DnnvssError(f"the group {name} runs from {first} to {end}", file=file, remedy=remedy)


@dataclass(frozen=True)
class Corpus:
    """A prepared corpus, opened for reading."""

    root: Path
    info: CorpusInfo
    utterances: dict[str, Utterance]

    @classmethod
    def open(cls, root: str | Path) -> "Corpus":
        """Return the corpus in a folder written by ``data_prep``.

        Raises:
            DnnvssError: the folder was not prepared, one of its files is damaged, or a name leads out of the folder.
        """
        root = Path(root)
        remedy = ("Prepare the corpus first: dnnvss prepare corpus=NAME corpus.raw=FOLDER; "
                  "corpus=demo, the built-in talker, needs no folder")
        info = read_record(CorpusInfo, root / "corpus.json", remedy)
        info.check(root / "corpus.json", remedy)
        return cls(root, info, read_utterances(root / "utterances.jsonl", remedy))

    @staticmethod
    def write(root: Path, info: CorpusInfo, utterances: Iterable[Utterance], splits: dict[str, list[str]]) -> None:
        """Write ``corpus.json``, ``utterances.jsonl`` and the splits into ``root``; ``corpus.json`` comes last.

        Raises:
            DnnvssError: train, val and test of one variant share utterances, or a file cannot be written.
        """
        check_apart(splits, root / "splits")
        lines = [files.json_text(u.to_json()) for u in utterances]
        files.write_text(root / "utterances.jsonl", "\n".join(lines) + "\n")
        for name, ids in splits.items():
            files.write_text(root / "splits" / f"{name}.txt", "\n".join(ids) + "\n")
        files.write_json(root / "corpus.json", info.to_json())

    def split(self, name: str, variant: str = "") -> list[Utterance]:
        """Return the utterances of a split: ``train``, ``val`` or ``test``, e.g. with ``variant="unseen"``.

        Ids that the preparation dropped (see ``report.jsonl``) are left out.

        Raises:
            DnnvssError: there is no such split, none of its utterances was kept, or the variant's splits share some.
        """
        file = files.inside(self.root / "splits", f"{variant}_{name}.txt" if variant else f"{name}.txt")
        splits = split_files(file.parent)
        if file.stem not in splits:
            raise DnnvssError("no such file", file=file, remedy=f"Choose one of the splits {sorted(splits)}")
        check_apart({s: ids for s, ids in splits.items() if s.rpartition("_")[0] == variant}, file.parent)
        kept = [self.utterances[i] for i in splits[file.stem] if i in self.utterances]
        if not kept:
            raise DnnvssError(f"split {name!r} holds none of the corpus's utterances", file=file,
                              remedy="See report.jsonl beside it for why utterances were dropped")
        return kept

    def path(self, utterance: Utterance, kind: str) -> Path:
        """Return the absolute path of an utterance's ``video``, ``audio`` or ``landmarks``.

        Raises:
            DnnvssError: the utterance has no such file, or one that leads out of the corpus.
        """
        relative, remedy = getattr(utterance, kind), "Prepare the corpus again"
        file = files.inside(self.root, relative or "corpus.json")
        if relative is None or not file.is_file():
            raise DnnvssError(f"has no {kind}", utterance=utterance.id, file=file, remedy=remedy)
        return file

    def landmarks(self, utterance: Utterance) -> tuple[np.ndarray, np.ndarray]:
        """Points (F, P, 1, 2 or 3) float32 in the corpus's unit and valid (F,); the others are interpolated."""
        file, count = self.path(utterance, "landmarks"), self.info.dimensions
        points = 2 * max((end for _, end in self.info.landmark_groups.values()), default=0)
        most = _SPARE + 8 * utterance.frames * count * max(points, _POINTS)
        declared = {"points": Held(("F", "P", count), "f", finite=False), "valid": Held(("F",), "b")}
        arrays = read_declared(file, declared, "Prepare the corpus again", most=most)
        return arrays["points"], arrays["valid"]

    def sound(self, utterance: Utterance) -> Sound:
        """The recorded sound of an utterance.

        Raises:
            DnnvssError: the utterance has none.
        """
        samples = read_audio(self.path(utterance, "audio"), SPEECH_RATE)
        return Sound(samples, SPEECH_RATE, self.root / "sound", self._sounds)

    @cached_property
    def _sounds(self) -> Callable[[], Iterator[Sound]]:
        """What gives all recordings that have sound."""
        heard = [u for u in self.utterances.values() if u.audio]
        return lambda: map(self.sound, heard)

    @cached_property
    def fingerprint(self) -> str:
        """A hash of the description, the records with the digests of their files, and the splits.

        It changes when the data changes. Corpora that were prepared before records had digests lack those.
        """
        digest = hashlib.sha256()
        for name in ("corpus.json", "utterances.jsonl"):
            digest.update((self.root / name).read_bytes())
        digest.update(json.dumps(split_files(self.root / "splits"), sort_keys=True).encode())
        return digest.hexdigest()[:16]
