"""Motion capture as a corpus: markers in space, repaired, or the named curves of a rig."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

from data_prep.capture.stages import Done, groups_of, repaired
from data_prep.capture.takes import KINDS, READ, VERSION, Taken, alike, is_take, read_take
from data_prep.folder import unsaid, words_of, written
from data_prep.pipeline import prepare
from data_prep.recipe import Recipe, Source, own_lexicon
from data_prep.shelf import Shelf
from data_prep.splits import given_splits
from data_prep.stages import FOLDER, Workshop
from data_prep.untold import speech_alone
from dnnvss.corpus import UNITS, CorpusInfo
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.formats.transcripts import read_transcript
from dnnvss.media.folders import SOUNDS
from dnnvss.timing import FrameClock

_WORDS = "Write the words of the take there, or give its sound alone"


def prepare_motion(
    raw: str | Path,
    out: str | Path,
    *,
    name: str = "motion",
    variant: str = "en_us",
    lexicon: Mapping[str, str] | None = None,
    credit: str = "",
    val: float = 0.05,
    test: float = 0.05,
    jig: Sequence[str] | str = "jig",
    groups: Mapping[str, Sequence[str]] | None = None,
    rate: int | float | str | None = None,
    jobs: int = -1,
    backend: str = "loky",
    strict: bool = False,
) -> Path:
    """Return the folder of the prepared corpus.

    A take is ``ID.c3d``, ``ID.trc`` or ``ID.csv``: markers in space (the columns of a CSV are ``NAME_x NAME_y
    NAME_z``), or the named curves of a rig (Live Link Face, or a name over each column). Beside it lie ``ID.wav``
    (flac, mp3), ``ID.txt`` with its words and, where known, phone times ``ID.TextGrid`` or ``ID.lab``. A take with
    sound and without words serves systems that read the voice alone.

    Markers are repaired (:mod:`data_prep.capture`): head motion is taken out by the markers of a jig, markers under
    wrong names get their own, gaps are filled and noise is smoothed away. Each repaired stretch is written to
    ``repairs/ID.json``, and a sum of them to the report.

    Args:
        raw: the folder of takes.
        out: the folder to write.
        name: name of the prepared corpus.
        variant: pronunciation variant of the talker, ``en_us`` or ``en_gb``.
        lexicon: word to phones, before the variant's lexicon.
        credit: the line shown wherever a picture or number from the corpus is shown.
        val, test: shares of the utterances, where the split is not given.
        jig: names of the markers that sit on the head, or what they begin with.
        groups: group to its markers, in order; by default the names without the digits at their end. ``lips`` is one
            of them, a closed line round the mouth.
        rate: frames a second of takes that do not tell it.
        jobs, backend: processes and joblib backend.
        strict: an utterance that would be dropped is an error.

    Raises:
        DnnvssError: no take, markers and curves in one folder, a jig that is not seen, or nothing is left.
    """
    shelf, shop = Shelf(Path(raw)), Workshop(Path(out), jobs, backend, strict)
    session = _session(shelf, shop, rate)
    usual, dimensions = session.usual, 1
    rows = {name: (k, k + 1) for k, name in enumerate(usual.names)}
    if usual.kind == "markers":
        settled = groups_of(usual.names, jig, groups)
        session = session.after(repaired(shop, session.marks, settled, float(Fraction(usual.rate))))
        rows, dimensions = settled.rows, 3
    info = CorpusInfo(name, (0, 0), usual.rate, rows, variant, credit, dimensions, UNITS[dimensions])
    recipe = Recipe(info, given_splits(shelf.root), val=val, test=test, rate=usual.rate,
                    lexicon=own_lexicon(lexicon), speech_valid=0.5)
    return prepare(_sources(session, shelf, shop, variant), recipe, shop)


@dataclass(frozen=True)
class _Session:
    """The takes of a folder.

    Args:
        usual: what most are like.
        marks: id to the points of each that can be used.
        notes: id to what is told of it.
        problems: id to why a take cannot be used.
    """

    usual: Taken
    marks: dict[str, Path]
    notes: dict[str, list[str]]
    problems: dict[str, str]

    def after(self, done: Done) -> "_Session":
        """The same session, repaired."""
        notes = {i: [*told, *done.notes.get(i, ())] for i, told in self.notes.items()}
        return replace(self, marks=done.marks, notes=notes, problems=self.problems | done.problems)


def _session(shelf: Shelf, shop: Workshop, rate: int | float | str | None) -> _Session:
    """The takes of a folder, read."""
    takes = dict(reversed(list(shelf.of_kind(*reversed(KINDS)))))
    takes = {i: path for i, path in takes.items() if is_take(path)}
    if not takes:
        raise DnnvssError("holds no take", file=shelf.root, remedy=f"Put takes there: {' '.join(KINDS)}")
    given = None if rate is None else str(FrameClock(rate).rate)
    read = shop.run(READ, read_take, {i: {"path": path, "rate": given} for i, path in takes.items()}, VERSION)
    problems = {i: str(r["dropped"]) for i, r in read.items() if "dropped" in r}
    known = {i: Taken(**{**r, "names": tuple(r["names"])}) for i, r in read.items() if i not in problems}
    usual, odd = alike(known, shelf.root)
    good = [i for i in known if i not in odd]
    marks = {i: shop.out / FOLDER / READ / f"{i}.npz" for i in good}
    return _Session(usual, marks, {i: known[i].notes for i in good}, problems | odd)


def _sources(session: _Session, shelf: Shelf, shop: Workshop, variant: str) -> list[Source]:
    """Every take with its sound and words, or why it cannot be used."""
    return [Source(i, problem=session.problems[i]) if i in session.problems
            else _source(shelf, shop, i, session.marks[i], variant, session.notes[i])
            for i in sorted(session.notes.keys() | session.problems)]


def _source(shelf: Shelf, shop: Workshop, name: str, marks: Path, variant: str, notes: Sequence[str]) -> Source:
    sound = shelf.get(name, *SOUNDS)
    try:
        if shelf.get(name, ".txt", ".lab") is None:
            if sound is None:
                raise DnnvssError("has neither words nor sound", file=shelf.path(name, ".txt"), utterance=name,
                                  remedy=_WORDS)
            return speech_alone(Source(name, landmarks=(marks,), sound=sound, notes=tuple(notes)), shop)
        transcript, times = written(shelf, name)
        text, left = read_transcript(transcript, name)
        words = words_of(text, variant, transcript, name)
        if sound is None and times is None:
            raise DnnvssError("has neither sound nor phone times", file=marks, utterance=name,
                              remedy=f"Put {name}.wav (flac, mp3) or {name}.TextGrid (lab) beside it")
    except ShortageError:
        raise
    except DnnvssError as error:
        return Source(name, problem=str(error))
    return Source(name, text, words, landmarks=(marks,), alignment=times, sound=sound, notes=(*notes, *unsaid(left)))
