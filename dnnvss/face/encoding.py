"""The cached stage between a corpus and its systems: fit a face, encode every clip, report."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Code, Face
from dnnvss.face.clips import Clip, UnusableClipError, corpus_clips
from dnnvss.face.kinds import FACES, FaceKind, FaceSettings, face_kind
from dnnvss.progress import counted
from dnnvss.records import as_record
from dnnvss.settings import setting
from dnnvss.timing import fill_invalid

FACE, CODES, REPORT = "face.npz", "codes", "report.json"
"""What lies in the folder of an encoding."""
_BATCH = 32
ENOUGH = 150_000
"""Frames that a face is fitted to: a hundred minutes at 25 frames a second. Of a longer corpus it is every so-many-th
clip, so that the memory of a fit has a bound."""


@dataclass(frozen=True)
class EncodedCorpus:
    """A folder with a fitted face, the code of every clip (``codes/<id>.npz``) and ``report.json``.

    Args:
        folder: where they are.
        key: hash of the corpus, the splits and the settings that they were made from.
        kind: of the face.
        splits: name of a split to its utterance ids, as they were encoded.
        dropped: utterance id to the reason why it has no code.
    """

    folder: Path
    key: str
    kind: str
    splits: dict[str, tuple[str, ...]]
    dropped: dict[str, str]

    @classmethod
    def open(cls, folder: Path, splits: Mapping[str, Sequence[str]] | None = None) -> "EncodedCorpus":
        """The encoding in a folder.

        Raises:
            DnnvssError: it was not finished, or its report is damaged.
        """
        path, remedy = folder / REPORT, f"Delete {folder} and run the command again"
        report = files.read_json(path, remedy)
        names = ("face", "dropped")
        kept = as_record(_Kept, {n: report.get(n) for n in names} if isinstance(report, dict) else 0, path, remedy)
        ids = {name: tuple(split) for name, split in (splits or {}).items()}
        return cls(folder, folder.name, kept.face, ids, dict(kept.dropped))

    @cached_property
    def face(self) -> Face:
        """The face, read when it is first asked for."""
        return face_kind(self.kind).load(self.folder / FACE)

    @cached_property
    def report(self) -> dict[str, Any]:
        """What the encoding is worth, as its kind measures it, and what was dropped."""
        report: dict[str, Any] = files.read_json(self.folder / REPORT)
        return report

    def clip(self, utterance: str) -> Code:
        """The code of an utterance.

        Raises:
            DnnvssError: it was not encoded (the message says why), or its file is damaged.
        """
        if utterance in self.dropped:
            raise DnnvssError(f"was not encoded: {self.dropped[utterance]}", utterance=utterance)
        path = self.folder / CODES / f"{utterance}.npz"
        code = face_kind(self.kind).load_code(path)
        if code.parameters.shape[1] != len(self.face.names):
            raise DnnvssError(f"holds {code.parameters.shape[1]} parameters, and the face has {len(self.face.names)}",
                              file=path, remedy=f"Delete {self.folder} and run the command again")
        return code

    def tracked(self, corpus: Corpus, utterance: str) -> np.ndarray | None:
        """The tracked points (F, P, 2 or 3) of an utterance in the face's frame; None where it has no landmarks,
        or the face no points.

        What is the recording's own, head pose first of all, is taken out (see :attr:`FaceKind.stabilise`); frames that
        were not measured are interpolated.
        """
        record = corpus.utterances[utterance]
        if record.landmarks is None or not self.face.jacobian().shape[1]:
            return None
        code = self.clip(utterance)
        try:
            points = face_kind(self.kind).stabilise(self.face, corpus.landmarks(record)[0], code)
        except ValueError as error:
            raise DnnvssError(f"does not fit the face beside it ({error})", utterance=utterance,
                              file=self.folder / CODES / f"{utterance}.npz",
                              remedy=f"Delete {self.folder} and run the command again") from error
        measured = code.valid.copy()
        for frames in code.outliers.values():
            measured[list(frames)] = False
        return fill_invalid(points, measured)

    @property
    def told(self) -> list[str]:
        """What is to be told of frames that were left out: a line for each utterance, and one for all of them."""
        lines = [f"left out: {lost} of {of} frames of utterance {i}{self._why(i)}"
                 for i, (lost, of) in self.left_out.items()]
        if not lines:
            return []
        lost, of = (int(self.report["left_out"][name]) for name in ("frames", "of"))
        return [*lines, f"left out of learning and of scores: {lost} of {of} frames ({lost / max(of, 1):.2%})"]

    def _why(self, utterance: str) -> str:
        reasons = self.report.get("outliers", {}).get(utterance, {})
        return f" ({', '.join(f'{name} {len(frames)}' for name, frames in reasons.items())})" if reasons else ""

    @cached_property
    def left_out(self) -> dict[str, tuple[int, int]]:
        """Utterances of which frames were left out of learning and of scores, to these frames and all of them."""
        known = self.report.get("left_out", {}).get("utterances", {})
        return {i: (int(lost), int(of)) for i, (lost, of) in known.items()}


@dataclass(frozen=True, kw_only=True)
class _Kept:
    """What every report of an encoding says."""

    face: str = setting(choices=FACES)
    dropped: Mapping[str, str]


def encode_corpus(
    corpus: Corpus,
    splits: Mapping[str, Sequence[str]],
    settings: FaceSettings,
    folder: str | Path = "face",
    *,
    progress: bool = True,
) -> EncodedCorpus:
    """Every utterance of the splits as parameters of a face that is fitted on the split ``train`` alone.

    The work goes to ``folder/<key>``, where the key is a hash of the corpus, the splits and the settings. A second call
    opens what the first one made; a call after a kill does what is left. Clips are shared out by joblib (choose the
    backend with ``joblib.parallel_config``).

    Args:
        corpus: a prepared corpus.
        splits: name to utterance ids, ``train`` among them.
        settings: of the face; they say of which kind it is.
        folder: folder of all encodings.
        progress: show progress bars.

    Raises:
        DnnvssError: no ``train`` split, an unknown utterance, a corpus that the settings do not fit, or a folder
            in which nothing may be written.
    """
    ids = {name: tuple(split) for name, split in splits.items()}
    if not ids.get("train"):
        raise DnnvssError(f"no utterance in split 'train'; there are {sorted(ids)}", remedy="Give a split named train")
    for unknown in (i for split in ids.values() for i in split if i not in corpus.utterances):
        raise DnnvssError("is in a split and not in the corpus", utterance=unknown, file=corpus.root / "corpus.json")
    home = encoding_folder(corpus, ids, settings, folder)
    if not (home / REPORT).is_file():
        files.check_writable([home / FACE])
        _make(face_kind(settings.face), settings, corpus, ids, home, progress)
    return EncodedCorpus.open(home, ids)


def encoding_folder(corpus: Corpus, splits: Mapping[str, Sequence[str]], settings: FaceSettings,
                    folder: str | Path = "face") -> Path:
    """The folder of an encoding, finished or not; a face that lies there is taken, and none is fitted.

    The arguments are those of :func:`encode_corpus`.
    """
    ids = {name: tuple(split) for name, split in splits.items()}
    return Path(folder) / _key(face_kind(settings.face), settings, corpus, ids)


def newest_encoding(corpus: Corpus) -> EncodedCorpus:
    """The encoding of a corpus that was finished last.

    Raises:
        DnnvssError: there is none.
    """
    reports = sorted((corpus.root / "face").glob(f"*/{REPORT}"), key=lambda p: p.stat().st_mtime)
    if not reports:
        raise DnnvssError("was not encoded yet", file=corpus.root / "face",
                          remedy="Train a system first: dnnvss train")
    return EncodedCorpus.open(reports[-1].parent)


def find_encoding(corpus: Corpus, face: Path) -> EncodedCorpus | None:
    """The encoding of a corpus that was made with the face in a file, None where it is not kept."""
    own = face.read_bytes()
    for path in sorted((corpus.root / "face").glob(f"*/{FACE}")):
        if path.stat().st_size == len(own) and path.read_bytes() == own and (path.parent / REPORT).is_file():
            return EncodedCorpus.open(path.parent)
    return None


def _key(kind: FaceKind, settings: FaceSettings, corpus: Corpus, splits: Mapping[str, Sequence[str]]) -> str:
    parts = [kind.name, kind.version, kind.plain(settings), corpus.fingerprint, splits]
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=list).encode()).hexdigest()[:16]


def _make(kind: FaceKind, settings: FaceSettings, corpus: Corpus, splits: Mapping[str, Sequence[str]], home: Path,
          progress: bool) -> None:
    """Fit, encode and report what is not there yet; the report is written last."""
    everything = sorted({i for split in splits.values() for i in split})
    dropped = _unfilmed(corpus, everything, splits["train"]) if kind.pictures else {}
    face = _fitted(kind, settings, corpus, [i for i in splits["train"] if i not in dropped], home / FACE, progress)
    clips = corpus_clips(corpus, [corpus.utterances[i] for i in everything if i not in dropped])
    dropped |= _encode(kind, home, clips, progress)
    kept = [i for i in everything if i not in dropped]
    report = kind.report(face, corpus, splits, home / CODES, kept)
    lost = _left_out(kind, home / CODES, kept)
    files.write_json(home / REPORT, {"face": kind.name, **report, "left_out": lost, "dropped": dropped})


def _left_out(kind: FaceKind, codes: Path, kept: Sequence[str]) -> dict[str, Any]:
    """How many frames are not valid, of how many, in all and for each utterance that has some."""
    counts = {i: (int((~valid).sum()), len(valid)) for i in kept
              for valid in [kind.load_code(codes / f"{i}.npz").valid]}
    return {"frames": sum(n for n, _ in counts.values()), "of": sum(n for _, n in counts.values()),
            "utterances": {i: own for i, own in counts.items() if own[0]}}


def _unfilmed(corpus: Corpus, ids: Sequence[str], train: Sequence[str]) -> dict[str, str]:
    """The utterances that have no video, each with that as its reason.

    Raises:
        DnnvssError: all training utterances are among them, or the corpus holds landmarks in space or curves of a rig.
    """
    remedy = "Choose a face that needs no pictures: face=points"
    if corpus.info.dimensions == 1:
        raise DnnvssError("it holds the curves of a rig, and this face lies in the picture", file=corpus.root,
                          remedy="Choose the face that moves a rig: face=rig")
    if corpus.info.dimensions != 2:
        raise DnnvssError(f"its landmarks have {corpus.info.dimensions} coordinates, and this face lies in the picture",
                          file=corpus.root, remedy=remedy)
    found = {i: "it has no video" for i in ids if corpus.utterances[i].video is None}
    if all(i in found for i in train):
        raise DnnvssError(f"none of the {len(train)} training utterances has a video", file=corpus.root, remedy=remedy)
    return found


def _fitted(kind: FaceKind, settings: FaceSettings, corpus: Corpus, train: Sequence[str], path: Path,
            progress: bool) -> Face:
    if path.is_file():
        return kind.load(path)
    step = max(1, -(-sum(corpus.utterances[i].frames for i in train) // ENOUGH))
    clips = corpus_clips(corpus, [corpus.utterances[i] for i in train[::step]])
    face = kind.fit(clips, corpus.info.landmark_groups, settings, progress=progress)
    face.save(path)
    return face


def _encode(kind: FaceKind, home: Path, clips: Sequence[Clip], progress: bool) -> dict[str, str]:
    """Write the code of each clip that has none yet, and return the clips that cannot be encoded with the reason.

    Workers read the face from its file, once each, rather than with every clip.
    """
    import joblib  # slow to import, and synthesis needs none of it

    left = [clip for clip in clips if not (home / CODES / f"{clip.id}.npz").is_file()]
    jobs = [joblib.delayed(_encode_one)(kind.name, home, clip) for clip in left]
    dropped: dict[str, str] = {}
    with counted(desc="encoding clips", total=len(clips), initial=len(clips) - len(left), unit="clips",
                 disable=not progress) as bar:
        for start in range(0, len(jobs), _BATCH):
            done = joblib.Parallel()(jobs[start:start + _BATCH])
            dropped |= {utterance: reason for utterance, reason in done if reason}
            bar.update(len(done))
    return dropped


@lru_cache(maxsize=1)
def _opened(kind: str, path: Path) -> Face:
    return face_kind(kind).load(path)


def _encode_one(name: str, home: Path, clip: Clip) -> tuple[str, str]:
    """Write a clip's code and return its id and, where none of its frames is usable, the reason."""
    try:
        encoded = face_kind(name).encode(_opened(name, home / FACE), clip)
    except UnusableClipError as error:
        return clip.id, error.problem
    encoded.code.save(home / CODES / f"{clip.id}.npz", **encoded.notes)
    return clip.id, ""
