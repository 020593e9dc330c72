"""A prepared corpus on disk: ``corpus.json``, ``utterances.jsonl``, ``splits/*.txt``, media and landmarks."""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.corpus.utterance import Utterance
from dnnvss.errors import DnnvssError


@dataclass(frozen=True)
class CorpusInfo:
    """What holds for the whole corpus.

    Args:
        name: short name, used in folder names.
        size: width and height of the video in pixels.
        rate: frame rate of the video, as text (``"25"``, ``"30000/1001"``).
        landmark_groups: name of a group of landmark points to the half-open range of its rows.
        variant: pronunciation variant of the talker (``"en_us"``, ``"en_gb"``).
        credit: the line to print wherever a picture or number made from the corpus is shown.
    """

    name: str
    size: tuple[int, int]
    rate: str
    landmark_groups: dict[str, tuple[int, int]] = field(default_factory=dict)
    variant: str = "en_us"
    credit: str = ""


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
            DnnvssError: the folder was not prepared, or one of its files is damaged.
        """
        root = Path(root)
        remedy = "Prepare the corpus first: python -m data_prep corpus=NAME"
        info = files.read_json(root / "corpus.json", remedy)
        info["size"] = tuple(info["size"])
        info["landmark_groups"] = {name: (a, b) for name, (a, b) in info["landmark_groups"].items()}
        rows = files.read(
            root / "utterances.jsonl",
            lambda path: [Utterance.from_json(json.loads(line)) for line in path.read_text("utf-8").splitlines()],
            remedy,
        )
        return cls(root, CorpusInfo(**info), {u.id: u for u in rows})

    @staticmethod
    def write(root: Path, info: CorpusInfo, utterances: Iterable[Utterance], splits: dict[str, list[str]]) -> None:
        """Write ``corpus.json``, ``utterances.jsonl`` and the splits into ``root``; ``corpus.json`` comes last."""
        lines = [json.dumps(u.to_json(), ensure_ascii=False) for u in utterances]
        files.write_text(root / "utterances.jsonl", "\n".join(lines) + "\n")
        for name, ids in splits.items():
            files.write_text(root / "splits" / f"{name}.txt", "\n".join(ids) + "\n")
        files.write_json(root / "corpus.json", asdict(info))

    def split(self, name: str, variant: str = "") -> list[Utterance]:
        """Return the utterances of a split: ``train``, ``val`` or ``test``, e.g. with ``variant="unseen"``.

        Ids that the preparation dropped (see ``report.jsonl``) are left out.

        Raises:
            DnnvssError: there is no such split, or none of its utterances was kept.
        """
        file = self.root / "splits" / (f"{variant}_{name}.txt" if variant else f"{name}.txt")
        known = sorted(p.stem for p in file.parent.glob("*.txt"))
        ids = files.read(file, lambda p: p.read_text("utf-8").split(), f"Choose one of the splits {known}")
        kept = [self.utterances[i] for i in ids if i in self.utterances]
        if not kept:
            raise DnnvssError(f"split {name!r} holds none of the corpus's utterances", file=file,
                              remedy="See report.jsonl beside it for why utterances were dropped")
        return kept

    def path(self, utterance: Utterance, kind: str) -> Path:
        """Return the absolute path of an utterance's ``video``, ``audio`` or ``landmarks``.

        Raises:
            DnnvssError: the utterance has no such file.
        """
        relative = getattr(utterance, kind)
        if relative is None or not (self.root / relative).is_file():
            file = self.root / (relative or "corpus.json")
            raise DnnvssError(f"has no {kind}", utterance=utterance.id, file=file, remedy="Prepare the corpus again")
        return self.root / relative

    def landmarks(self, utterance: Utterance) -> tuple[np.ndarray, np.ndarray]:
        """Return points (F, P, 2) float32 in pixels and valid (F,) bool; frames that are not valid are interpolated."""
        arrays = files.read_arrays(self.path(utterance, "landmarks"), "Prepare the corpus again")
        return arrays["points"], arrays["valid"]

    @cached_property
    def fingerprint(self) -> str:
        """A hash of the records and the corpus description: changes when the data changes."""
        digest = hashlib.sha256()
        for name in ("corpus.json", "utterances.jsonl"):
            digest.update((self.root / name).read_bytes())
        return digest.hexdigest()[:16]
