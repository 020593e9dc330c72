"""The GRID corpus: a talker's videos, word times and landmarks.

Source: M. Cooke, J. Barker, S. Cunningham, X. Shao, "An audio-visual corpus for speech perception and automatic speech
recognition", J. Acoust. Soc. Am. 120(5), 2006.
"""

from collections.abc import Mapping
from pathlib import Path

from data_prep.pipeline import Then, prepare
from data_prep.points import nets
from data_prep.recipe import Recipe, Source, own_lexicon
from data_prep.splits import given_splits
from data_prep.stages import Workshop
from dnnvss.corpus import CorpusInfo
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.face.landmarker import mesh_groups
from dnnvss.formats import Marks, read_grid_align, read_marks
from dnnvss.media.folders import is_visible

CREDIT = "GRID corpus: Cooke, Barker, Cunningham, Shao, J. Acoust. Soc. Am. 120(5), 2006"

DIGITS = {"z": "zero", "1": "one", "2": "two", "3": "three", "4": "four", "5": "five", "6": "six", "7": "seven",
          "8": "eight", "9": "nine"}

WORDS: tuple[Mapping[str, str], ...] = (
    {"b": "bin", "l": "lay", "p": "place", "s": "set"},
    {"b": "blue", "g": "green", "r": "red", "w": "white"},
    {"a": "at", "b": "by", "i": "in", "w": "with"},
    {letter: letter for letter in "abcdefghijklmnopqrstuvxyz"},
    DIGITS,
    {"a": "again", "n": "now", "p": "please", "s": "soon"},
)
"""The word of each place in an id by its letter."""

LEXICON = {"a": "EY", "white": "W AY T"}
"""What the variant's lexicon says otherwise: in this grammar *a* is a letter, never the article."""

SOUND_DELAY = {".mp4": 0.02322, ".mpg": 0.0}
"""Seconds by which the sound of a file is late, beyond what the file says. An AAC encoder puts 1024 samples before the
sound, and mp4 copies made without an edit list do not declare them: measured as 23.2 ms against the corpus's own mpg on
the six clips that are there in both forms."""

LETTER = 3
"""The place of the spoken letter in an id: what splits are even in."""

SUFFIXES = (".mp4", ".mpg")
"""Kinds of video; where an id has both, the first."""


def words_of(name: str) -> tuple[str, ...] | None:
    """Return the six words that an id spells, or None where it is not an id of GRID."""
    if len(name) != len(WORDS) or any(c not in table for c, table in zip(name, WORDS, strict=True)):
        return None
    return tuple(table[c] for c, table in zip(name, WORDS, strict=True))


def prepare_grid(raw: str | Path, out: str | Path, *, name: str = "grid", variant: str = "en_gb",
                 lexicon: Mapping[str, str] | None = None, sound_delay: Mapping[str, float] | None = None,
                 word_slack: float = 0.25, sync: bool = True, landmarker: str | None = None, jobs: int = -1,
                 backend: str = "loky", strict: bool = False, then: Then = prepare) -> Path:
    """Return the folder of the prepared corpus.

    Videos are ``video/*.mp4``, ``raw/*.mpg`` (the corpus's own MPEG-1) or ``*.mpg`` in ``raw`` itself; where an id has
    more than one, the mp4 is taken. Word times are ``align/*.align`` or beside the video, landmarks
    ``landmarks/*.npz`` with ``landmarks.json``; without that folder they are found in the pictures
    (:mod:`dnnvss.face.landmarker`). Of ``splits/*.txt`` those of train, val and test that are not there are drawn,
    even in the spoken letter.

    Args:
        raw: the corpus as it was distributed.
        out: the folder to write.
        name: name of the prepared corpus.
        variant: pronunciation variant of the talker.
        lexicon: word to phones, before :data:`LEXICON` and the variant's lexicon.
        sound_delay: suffix of the video to seconds, before :data:`SOUND_DELAY`.
        word_slack: seconds around the given word times in which a word is looked for.
        sync: measure how late each clip's sound is beside its picture, and move it (:mod:`data_prep.sync`).
        landmarker: ``face_landmarker.task`` where no package brings it, for a corpus without landmarks.
        jobs, backend: processes and joblib backend.
        strict: an utterance that would be dropped is an error.
        then: what is done with what was found.

    Raises:
        DnnvssError: there is no video, no description of the landmarks, or nothing is left.
    """
    raw = Path(raw)
    videos = _videos(raw)
    given = (raw / "landmarks").exists()
    task, lacking = (None, None) if given else nets(landmarker)
    marks = read_marks(raw / "landmarks.json") if given else Marks(mesh_groups())
    info = CorpusInfo(name, (0, 0), "25", marks.groups, variant, CREDIT)
    recipe = Recipe(info, given_splits(raw), stratum=lambda i: i[LETTER : LETTER + 1], val=0.083, test=0.056,
                    scale=marks.scale, lexicon=LEXICON | own_lexicon(lexicon), slack=word_slack,
                    sync=sync, task=task, lacking=lacking)
    delays = SOUND_DELAY | dict(sound_delay or {})
    sources = [_source(raw, i, video, delays.get(video.suffix.lower(), 0.0), not given)
               for i, video in sorted(videos.items())]
    return then(sources, recipe, Workshop(Path(out), jobs, backend, strict))


def _videos(raw: Path) -> dict[str, Path]:
    found: dict[str, Path] = {}
    for suffix in SUFFIXES:
        for folder in (raw / "video", raw / "raw", raw):
            for path in sorted(filter(is_visible, folder.glob(f"*{suffix}"))):
                found.setdefault(path.stem, path)
    if not found:
        raise DnnvssError("holds no video", file=raw, remedy="Set corpus.raw to the folder with video/*.mp4 or *.mpg")
    return found


def _source(raw: Path, name: str, video: Path, delay: float, find: bool) -> Source:
    landmarks, times = raw / "landmarks" / f"{name}.npz", raw / "align" / f"{name}.align"
    if not times.is_file() and video.with_suffix(".align").is_file():
        times = video.with_suffix(".align")
    spelt = words_of(name)
    notes: list[str] = []
    try:
        if not find and not landmarks.is_file():
            raise DnnvssError("no such file", file=landmarks, utterance=name, remedy="Track the video's landmarks")
        if times.is_file():
            spans = [s for s in read_grid_align(times) if s.label]
            said, bounds = tuple(s.label.lower() for s in spans), tuple((s.start, s.end) for s in spans)
            if spelt and said != spelt:
                notes.append(f"its id spells {' '.join(spelt)!r}, its word times say {' '.join(said)!r} (taken)")
        elif spelt:
            said, bounds = spelt, ()
            notes.append("no word times: its words are those that its id spells")
        else:
            raise DnnvssError("no transcript", file=times, utterance=name, remedy="Give its word times")
        if not said:
            raise DnnvssError("holds no word", file=times, utterance=name, remedy="Give its word times")
    except ShortageError:
        raise  # it says nothing about the recording
    except DnnvssError as error:
        return Source(name, video=video, problem=str(error))
    marks = () if find else (landmarks,)
    return Source(name, " ".join(said), said, video, marks, bounds, delay=delay, notes=tuple(notes))
