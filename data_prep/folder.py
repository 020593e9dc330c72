"""Any folder of recordings: a video or a sound, its words and its landmarks for each sentence."""

import re
import shlex
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path

from data_prep.long_told import has_tier, long_script
from data_prep.pipeline import Then, prepare
from data_prep.points import nets
from data_prep.recipe import Recipe, Source, own_lexicon
from data_prep.script import Script
from data_prep.shelf import Shelf
from data_prep.splits import given_splits
from data_prep.stages import Workshop
from dnnvss import files
from dnnvss.corpus import UNITS, CorpusInfo
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.face.landmarker import ROWS, mesh_groups
from dnnvss.formats import (
    LAYOUT_68,
    MESHES,
    SUBTITLES,
    Marks,
    is_words_csv,
    read_alignment,
    read_landmarks,
    read_marks,
    read_timed_text,
)
from dnnvss.formats.alignments import with_phones
from dnnvss.formats.htk import is_transcript
from dnnvss.formats.transcripts import check_transcript, read_transcript
from dnnvss.media.folders import SOUNDS, VIDEOS, is_visible
from dnnvss.text.normalise import tokens
from dnnvss.text.sentence import spoken_words
from dnnvss.text.wording import WORD, foreign_letter

_LOOKED_AT = 10_000  # files in folders inside, at most
_WORDS = "Write the words of the recording there"
_HEAR = "have them written down by a machine with corpus.importer.transcribe=true"

_ABOUT = re.compile(r"readme|licen[cs]e|notes?\b|index|transcripts?$", re.IGNORECASE)
"""Names of texts about a folder."""

SEEN = 0.5
"""Share of the frames of speech that must show the face; what is between the others is not learnt from."""

_LANDMARKS = "Give ID.npz (points, valid), ID.csv of OpenFace, a folder ID of .pts files, or ID_000001.pts, ..."


def prepare_folder(raw: str | Path, out: str | Path, *, name: str = "folder", variant: str = "en_us",
                   lexicon: Mapping[str, str] | None = None, credit: str = "", val: float = 0.05, test: float = 0.05,
                   sync: bool = False, dim: int = 2, rate: int | float | str | None = None,
                   landmarker: str | None = None, transcribe: bool = False, jobs: int = -1, backend: str = "loky",
                   strict: bool = False, then: Then = prepare) -> Path:
    """Return the folder of the prepared corpus.

    For each video ``ID.mp4`` (or another kind) there is ``ID.txt`` with its words, and where they are known landmarks
    (see :func:`dnnvss.formats.read_landmarks`) and phone times ``ID.TextGrid``, ``ID.lab``, ``ID.phn`` or ``ID.ctm`` (a
    ``.lab`` of words is a transcript). Groups of landmarks come from ``landmarks.json`` (``{"groups":
    {name: [first, end]}, "scale": 1}``), or are those of 68-point landmarks, or those of a face mesh of 468 or 478
    points. Where no video has landmarks, they are found in the pictures (:mod:`dnnvss.face.landmarker`). A video
    without sound takes ``ID.wav`` (flac, mp3) beside it, which begins with the first picture.
    ``splits/{train,val,test}.txt`` (an id a line) are used where they are; those that are not are drawn from the
    utterances that the others leave.

    A video of more than a minute with a transcript of more than 40 words, or one of any length with subtitles
    (``ID.srt``, ``ID.vtt``) or word times (``ID.csv`` with the columns start, end, word, ``ID.TextGrid``, ``ID.ctm``,
    ``ID.json`` or ``ID.tsv`` of a speech recogniser) in place of a transcript, is cut into utterances at pauses
    (:mod:`data_prep.long`).

    A recording without video is ``ID.csv`` or ``ID.npz`` (or a folder ``ID`` of .pts files) beside ``ID.txt``. Its
    sound is ``ID.wav`` (flac, mp3); without sound its phone times must be given. Its frame rate is ``rate``, that of
    ``landmarks.json`` (``"rate": 25``), or what the time stamps of all such recordings tell, in this order.

    Args:
        raw: the folder of recordings.
        out: the folder to write.
        name: name of the prepared corpus.
        variant: pronunciation variant of the talker, ``en_us`` or ``en_gb``.
        lexicon: word to phones, before the variant's lexicon.
        credit: the line shown wherever a picture or number from the corpus is shown.
        val, test: shares of the utterances, where the split is not given.
        sync: measure how late each clip's sound is beside its picture, and move it (:mod:`data_prep.sync`).
        dim: coordinates of a landmark: 2 in pixels of the picture, 3 in millimetres before the camera.
        rate: frames a second of landmarks without video.
        landmarker: ``face_landmarker.task`` where no package brings it, for videos without landmarks.
        transcribe: write down what is said in videos without a text, to be read (:mod:`data_prep.transcribing`).
        jobs, backend: processes and joblib backend.
        strict: an utterance that would be dropped is an error.
        then: what is done with what was found.

    Raises:
        DnnvssError: no recording, unknown groups of landmarks, no rate, or nothing is left.
    """
    raw = Path(raw)
    if dim not in (2, 3):
        raise DnnvssError(f"corpus.importer.dim is {dim!r}", remedy="Give 2 for points in the picture, 3 in space")
    shelf = Shelf(raw)
    videos = _recordings(shelf)
    given = any(shelf.landmarks(i) for i in videos)
    task, lacking = (None, None) if given else nets(landmarker)
    sources = [_source(shelf, i, video, variant, not given, transcribe) for i, video in sorted(videos.items())]
    marks, rows = _marks(raw, sources, dim)
    info = CorpusInfo(name, (0, 0), "25", marks.groups, variant, credit, dim, UNITS[dim])
    own = marks.rate if rate is None else str(rate)
    recipe = Recipe(info, given_splits(raw), val=val, test=test, scale=marks.scale, rate=own, size=marks.size,
                    lexicon=own_lexicon(lexicon), sync=sync, rows=rows, task=task,
                    lacking=lacking, speech_valid=SEEN, told=_alone(shelf, videos))
    return then(sources, recipe, Workshop(Path(out), jobs, backend, strict))


def _recordings(raw: Shelf) -> dict[str, Path | None]:
    """Id to video, None where there are landmarks without one.

    Landmarks are a recording where words or a sound lie beside them, or where the folder has no video at all.
    """
    found: dict[str, Path | None] = {}
    for name, path in raw.of_kind(*VIDEOS):
        found.setdefault(name, path)
    tracked = {name for name, _ in raw.of_kind(".csv", ".npz")} | raw.pts_folders
    bare = {i for i in tracked - set(found) if not found or raw.get(i, ".txt", *SOUNDS)}
    if not found and not bare:
        raise DnnvssError("holds no video and no landmarks", file=raw.root, remedy=_inside(raw.root) or
                          f"Put videos there ({' '.join(VIDEOS)}), or landmarks (ID.csv, ID.npz) with sound")
    return found | dict.fromkeys(sorted(bare))


def _alone(raw: Shelf, recordings: Collection[str]) -> tuple[str, ...]:
    """What the report says of texts that no recording has the name of: a name may be misspelt."""
    names = sorted(files.printable(path.name) for name, path in raw.of_kind(".txt", ".lab", *SUBTITLES)
                   if name not in recordings and not _ABOUT.match(name))
    found = f"Texts that are not used, for no recording has their name ({len(names)}): {_some(names)}"
    return (found,) if names else ()


def _inside(root: Path) -> str:
    """What to do where the videos lie in a folder of this one, as cameras leave them; nothing where they do not."""
    videos = [p for p in islice(root.glob("*/**/*"), _LOOKED_AT) if p.suffix.lower() in VIDEOS and is_visible(p)]
    if not videos:
        return ""
    folder, count = Counter(p.parent for p in videos).most_common(1)[0]
    return f"{count} videos lie in {files.printable(str(folder))}: set corpus.raw to it"


def _source(raw: Shelf, name: str, video: Path | None, variant: str, find: bool, transcribe: bool) -> Source:
    try:
        if video is not None and (special := _cut_or_guessed(raw, name, video, variant, find, transcribe)) is not None:
            return special
        transcript, times = written(raw, name)
        text, left = read_transcript(transcript, name)
        words = words_of(text, variant, transcript, name)
        marks = () if find else _landmarks(raw, name)
        sound = raw.get(name, *SOUNDS)
        if video is None and sound is None and times is None:
            raise DnnvssError("has neither video nor sound, and no phone times", file=marks[0], utterance=name,
                              remedy=f"Put {name}.wav (flac, mp3) or {name}.TextGrid (lab, ctm) beside it")
    except ShortageError:
        raise  # it says nothing about the recording
    except DnnvssError as error:
        return Source(name, video=video, problem=str(error))
    notes = unsaid(left) + _told(transcript, video) + _others(raw, name, video)
    return Source(name, text, words, video, marks, alignment=times, sound=sound, notes=notes)


def _cut_or_guessed(raw: Shelf, name: str, video: Path, variant: str, find: bool, transcribe: bool) -> Source | None:
    """A recording that is cut into utterances, or whose text is written down first; None for any other."""
    if (script := long_script(raw, name, video)) is not None:
        cues = read_timed_text(script[0])
        text = " ".join(cue.text for cue in cues)
        words = tuple(Script(cues, variant).words)
        lost = list(dict.fromkeys(unspeakable(text, variant)))
        marks = () if find else _landmarks(raw, name)
        return Source(name, text, words, video, marks, script=script[0], long=script[1],
                      notes=_told(script[0], video) + unspoken(lost))
    if transcribe and raw.get(name, ".txt", ".lab") is None:
        return Source(name, video=video, landmarks=() if find else _landmarks(raw, name), guessed=True,
                      sound=raw.get(name, *SOUNDS))
    return None


def words_of(text: str, variant: str, transcript: Path, name: str) -> tuple[str, ...]:
    """The words that are said for the text of a transcript.

    Raises:
        DnnvssError: there is none, one in letters of which no word of English is made, or one that lost a letter: it
            would be passed over.
    """
    if foreign := next(unspeakable(text, variant), ""):
        raise DnnvssError(f"cannot speak {foreign[:40]!r}", file=transcript, utterance=name,
                          remedy="Write it in English words as it is said")
    words = tuple(word for word, _ in spoken_words(text, variant))
    if not words:
        raise DnnvssError("the transcript holds no word", file=transcript, utterance=name, remedy=_WORDS)
    return words


_LOST = re.compile(r"[^\s\ufffd]*\ufffd\S*")
"""A word with a sign that could not be decoded where it was once read."""


def unspeakable(text: str, variant: str) -> Iterator[str]:
    """The words of a text that lost a letter, or in letters of which no word of English is made."""
    yield from (match[0] for match in _LOST.finditer(text))
    said = {w for token in tokens(text, variant, lenient=True) for w in WORD.findall(token.written)}  # kilohms, by 20
    yield from (w for w in WORD.findall(text)
                if foreign_letter(w) and w not in said and not spoken_words(w, variant))


def written(raw: Shelf, name: str) -> tuple[Path, Path | None]:
    """The transcript of an id, and its phone times where there are any.

    A ``.lab`` of words, as the Montreal Forced Aligner wants it, is a transcript. An ``.mlf`` or ``.ctm`` that has no
    recording of its name holds the times of many.

    Raises:
        DnnvssError: there is no transcript, or it is none.
    """
    times, lab = raw.get(name, ".textgrid", ".phn"), raw.get(name, ".lab")
    words = lab is not None and is_transcript(files.read_text(lab, _WORDS))
    if times is None and not words:
        times = lab
    table = raw.get(name, ".csv")
    if times is None and table is not None and is_words_csv(table) and "phones" in read_alignment(table):
        times = table
    if times is None and (scored := raw.get(name, ".ctm")) is not None and not has_tier(scored, "words"):
        times = scored
    if times is None:
        times = next((path for path in raw.in_common if name in with_phones(path)), None)
    transcript = raw.get(name, ".txt") or (lab if lab is not None and words else raw.path(name, ".txt"))
    if not transcript.is_file():
        raise DnnvssError("no such file", file=transcript, remedy=_beside(raw, name) or f"{_WORDS}, or {_HEAR}")
    check_transcript(transcript, name)
    return transcript, times


_DOCUMENTS = (".rtf", ".doc", ".docx", ".odt", ".pages", ".pdf", ".html", ".htm", ".md", ".text")
_SUBTITLES = (".ass", ".ssa", ".sbv", ".sub", ".lrc", ".smi", ".stl", ".scc")
_OTHERS = (".ttml", ".dfxp", ".xml", ".json3", ".srv3", ".tsv")
"""Captions that FFmpeg does not read either."""


def _beside(raw: Shelf, name: str) -> str:
    """What to do where a recording has no text that is read, but perhaps another; nothing where it has none."""
    for path in raw.others(name):
        shown, suffix = files.printable(path.name), path.suffix.lower()
        if suffix in _DOCUMENTS:
            return f"{shown} is not read: save its words as plain text, {name}.txt"
        if suffix in _SUBTITLES:
            return f"{shown} is not read: ffmpeg -i {shlex.quote(shown)} {shlex.quote(f'{name}.srt')}"
        if suffix in _OTHERS:
            return f"{shown} is not read: save or download its captions as SubRip, {name}.srt"
        if suffix in (".txt", *SUBTITLES):
            return f"{shown} is not taken, for its name is another one: if it is its text, rename it {name}{suffix}"
    return ""


def unsaid(left: str) -> tuple[str, ...]:
    """What the report says of the part of a transcript that nobody says."""
    return (f"nobody says {left!r} of its transcript, and it was left out",) if left else ()


def unspoken(lost: Sequence[str]) -> tuple[str, ...]:
    """What the report says of the words of a long text that cannot be spoken."""
    found = (f"words of its text that cannot be spoken, and are not learnt from where they are said ({len(lost)}): "
             f"{_some([repr(word) for word in lost])}")
    return (found,) if lost else ()


def _some(names: Sequence[str]) -> str:
    """The first three of some names, and that there are more."""
    return ", ".join([*names[:3], *(["..."] if len(names) > 3 else [])])


def _told(transcript: Path, video: Path | None) -> tuple[str, ...]:
    """What is to be said of how the files of a recording are written."""
    notes = []
    if (encoding := files.text_encoding(transcript.read_bytes())) in ("cp1252", "mac_roman"):
        notes.append(f"its transcript is not UTF-8 and was read as {encoding}")
    path = video or transcript
    if (shown := files.printable(path.name)) != path.name:
        notes.append(f"the name {shown} is not UTF-8 and was read as cp1252")
    return tuple(notes)


def _others(raw: Shelf, name: str, video: Path | None) -> tuple[str, ...]:
    """A note where there are several videos, or several other files of one kind, of one name."""
    kinds = [suffix for suffix in VIDEOS if raw.get(name, suffix) not in (None, video)] if video is not None else []
    notes = [f"there is also {name}{', '.join(kinds)}: {video.name} is taken"] if video is not None and kinds else []
    for path in raw.twice(name):
        taken = raw.path(name, path.suffix.lower())
        notes.append(f"there is also {files.printable(path.name)}: {files.printable(taken.name)} is taken")
    return tuple(notes)


def _landmarks(raw: Shelf, name: str) -> tuple[Path, ...]:
    if not (found := raw.landmarks(name)):
        raise DnnvssError("no landmarks", file=raw.path(name, ".npz"), utterance=name, remedy=_LANDMARKS)
    return found


def _marks(raw: Path, sources: list[Source], dim: int) -> tuple[Marks, tuple[int, ...] | None]:
    """What is said of the landmarks in ``landmarks.json``, and the points that are kept of a face mesh.

    Groups that are not told there are those of the mesh, or those of 68 points.
    """
    described = raw / "landmarks.json"
    marks = read_marks(described) if described.is_file() else Marks({})
    first = next((s for s in sources if not s.problem), None)
    if first is not None and not first.landmarks:
        return Marks(mesh_groups(), rate=marks.rate), None
    if marks.groups:
        return marks, None
    count = _count(first, dim) if first is not None else 0
    if count in MESHES:
        return marks._replace(groups=mesh_groups()), tuple(ROWS.tolist())
    if first is not None and count not in (0, 68):
        raise DnnvssError(f"utterance {first.id} has {count} landmarks a frame, and their groups are not known",
                          file=described, remedy="Describe them there: {\"groups\": {\"lips_outer\": [48, 60], ...}}")
    return marks._replace(groups=dict(LAYOUT_68)), None


def _count(source: Source, dim: int) -> int:
    """Return the landmarks of a frame of the first recording; 0 where they cannot be read (the report will say why)."""
    try:
        found = read_landmarks(source.landmarks[0], dim)
    except ShortageError:
        raise
    except DnnvssError:
        return 0
    return found.points.shape[1]
