"""The cached stage of the pipeline: fit on the training split, encode every clip, report."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

from tqdm import tqdm

from dnnvss import files
from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.face.aam.clips import Clip, ClipCode, corpus_clips
from dnnvss.face.aam.coding import UnusableClipError, clip_errors, measure_clip
from dnnvss.face.aam.config import AAMConfig
from dnnvss.face.aam.fit import fit_aam
from dnnvss.face.aam.model import ActiveAppearanceModel
from dnnvss.face.aam.report import build_report

_ALGORITHM = 4
"""Raised when the code changes what it computes, so that old caches are not taken for new."""
_BATCH = 32


@dataclass(frozen=True)
class EncodedCorpus:
    """A folder with a fitted model (``aam.npz``), the code of every clip (``codes/<id>.npz``) and ``report.json``.

    Args:
        folder: where they are.
        key: hash of the corpus, the splits and the settings that they were made from.
        splits: name of a split to its utterance ids, as they were encoded.
        dropped: utterance id to the reason why it has no code.
    """

    folder: Path
    key: str
    splits: dict[str, tuple[str, ...]]
    dropped: dict[str, str]

    @cached_property
    def model(self) -> ActiveAppearanceModel:
        """The model, read when it is first asked for."""
        return ActiveAppearanceModel.load(self.folder / "aam.npz")

    @cached_property
    def report(self) -> dict:
        """Errors of reconstruction, variance between clips, and outliers (see :func:`build_report`)."""
        return files.read_json(self.folder / "report.json")

    def clip(self, utterance: str) -> ClipCode:
        """Return the code of an utterance.

        Raises:
            DnnvssError: it was not encoded (the message says why), or its file is damaged.
        """
        if utterance in self.dropped:
            raise DnnvssError(f"was not encoded: {self.dropped[utterance]}", utterance=utterance)
        return ClipCode.load(self.folder / "codes" / f"{utterance}.npz")


def encode_corpus(
    corpus: Corpus,
    splits: Mapping[str, Sequence[str]],
    config: AAMConfig | None = None,
    folder: str | Path = "aam",
    *,
    progress: bool = True,
) -> EncodedCorpus:
    """Return every utterance of the splits as parameters of a model fitted on the split ``train`` alone.

    The work goes to ``folder/<key>``, where the key is a hash of the corpus, the splits and the settings. A second call
    opens what the first one made; a call after a kill does what is left. Clips are shared out by joblib (choose the
    backend with ``joblib.parallel_config``).

    Args:
        corpus: a prepared corpus.
        splits: name to utterance ids, ``train`` among them.
        config: the settings; the defaults where None.
        folder: folder of all encodings.
        progress: show progress bars.

    Raises:
        DnnvssError: no ``train`` split, an unknown utterance, or a corpus that the settings do not fit.
    """
    config = config or AAMConfig()
    ids = {name: tuple(split) for name, split in splits.items()}
    if not ids.get("train"):
        raise DnnvssError(f"no utterance in split 'train'; there are {sorted(ids)}", remedy="Give a split named train")
    for unknown in (i for split in ids.values() for i in split if i not in corpus.utterances):
        raise DnnvssError("is in a split and not in the corpus", utterance=unknown, file=corpus.root / "corpus.json")
    key = config.key(corpus.fingerprint, ids, _ALGORITHM)
    home = Path(folder) / key
    if (home / "report.json").is_file():
        report = files.read_json(home / "report.json", f"Delete {home} and run the command again")
        return EncodedCorpus(home, key, ids, report["dropped"])
    model = _fitted(corpus, ids["train"], config, home, progress)
    everything = sorted({i for split in ids.values() for i in split})
    clips = corpus_clips(corpus, [corpus.utterances[i] for i in everything])
    dropped = _encode(home / "aam.npz", clips, home / "codes", progress)
    report = build_report(model, corpus, ids, home / "codes", dropped)
    files.write_json(home / "report.json", report)
    return EncodedCorpus(home, key, ids, dropped)


def _fitted(
    corpus: Corpus, train: Sequence[str], config: AAMConfig, home: Path, progress: bool
) -> ActiveAppearanceModel:
    if (home / "aam.npz").is_file():
        return ActiveAppearanceModel.load(home / "aam.npz")
    clips = corpus_clips(corpus, [corpus.utterances[i] for i in train])
    model = fit_aam(clips, corpus.info.landmark_groups, config, progress=progress)
    model.save(home / "aam.npz")
    return model


def _encode(path: Path, clips: Sequence[Clip], folder: Path, progress: bool) -> dict[str, str]:
    """Write the code of each clip that has none yet, and return the clips that cannot be encoded with the reason.

    Workers read the model from its file, once each, rather than with every clip.
    """
    import joblib  # slow to import, and synthesis needs none of it

    left = [clip for clip in clips if not (folder / f"{clip.id}.npz").is_file()]
    jobs = [joblib.delayed(_encode_one)(path, clip, folder) for clip in left]
    dropped: dict[str, str] = {}
    with tqdm(total=len(clips), initial=len(clips) - len(left), desc="encoding clips", unit="clip",
              disable=not progress) as bar:
        for start in range(0, len(jobs), _BATCH):
            done = joblib.Parallel()(jobs[start:start + _BATCH])
            dropped |= {utterance: reason for utterance, reason in done if reason}
            bar.update(len(done))
    return dropped


@lru_cache(maxsize=1)
def _opened(path: Path) -> ActiveAppearanceModel:
    return ActiveAppearanceModel.load(path)


def _encode_one(path: Path, clip: Clip, folder: Path) -> tuple[str, str]:
    """Write a clip's code and return its id and, where none of its frames is usable, the reason."""
    model = _opened(path)
    try:
        measured = measure_clip(model, clip)
    except UnusableClipError as error:
        return clip.id, error.problem
    measured.code.save(folder / f"{clip.id}.npz", errors=clip_errors(model, measured))
    return clip.id, ""
