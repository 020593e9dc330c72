"""What an importer says of its recordings, how they are to be read, and what became of them so far."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from data_prep.report import Outcome, write_report
from data_prep.stages import Workshop
from dnnvss.corpus import CorpusInfo, checkup
from dnnvss.errors import DnnvssError
from dnnvss.text.lexicon import check_phones

Results = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Source:
    """What an importer found of one utterance.

    Args:
        id: unique in the corpus.
        text: the words as they are to be kept.
        words: the words as they are spoken, in lower case.
        video: the recording; None where there are landmarks alone.
        landmarks: an ``.npz`` or ``.csv`` file, a folder of ``.pts`` files, or the ``.pts`` files themselves; empty
            where they are to be found in the video.
        bounds: start and end of each word in seconds, where they are known.
        alignment: a file with the phones' times; then the aligner is not needed.
        delay: seconds by which the file's sound is late beyond what the file says.
        problem: why the utterance cannot be used, where the importer knows already.
        notes: what is to be said of it in the report.
        sound: a sound file beside landmarks without video, or beside a video without sound.
        script: a file that tells what is said in a long recording, with or without times: it is cut into utterances.
        long: why it is.
        guessed: its text was, or is to be, written down by a machine.
    """

    id: str
    text: str = ""
    words: tuple[str, ...] = ()
    video: Path | None = None
    landmarks: tuple[Path, ...] = ()
    bounds: tuple[tuple[float, float], ...] = ()
    alignment: Path | None = None
    delay: float = 0.0
    problem: str = ""
    notes: tuple[str, ...] = ()
    sound: Path | None = None
    script: Path | None = None
    long: str = ""
    guessed: bool = False


@dataclass(frozen=True)
class Recipe:
    """How the recordings of a corpus are read.

    Args:
        info: name, groups of landmarks, variant and credit; size and rate are found.
        splits: ids by name of the split, as given; of train, val and test those are drawn that are not there.
        stratum: what a drawn split is to be even in.
        val, test: shares of a drawn split.
        scale: what stored coordinates are divided by to give pixels (millimetres).
        rate: frames a second of landmarks without video; None where time stamps tell it.
        size: width and height of the pictures that landmarks without video lie in; None where that is not known.
        lexicon: word to phones, before the variant's lexicon.
        slack: seconds around given word times in which a word is looked for.
        far: seconds from its given time beyond which a word's start is noted in the report.
        sync: measure how late each clip's sound is beside its picture, and move it.
        adapt: learn the talker's own voice and align with it, where there is enough speech.
        limits: what the check-up takes for an outlier.
        speech_valid: share of the frames of speech that must have landmarks.
        rows: the points of a frame that are kept, in their new order; all of them where None.
        task: the file of the nets that find landmarks; None where every recording brings its own.
        lacking: why landmarks that are needed cannot be found.
        told: what the report says of the recordings as a whole, a sentence each.
    """

    info: CorpusInfo
    splits: Mapping[str, list[str]] = field(default_factory=dict)
    stratum: Callable[[str], str] = lambda name: ""
    val: float = 0.05
    test: float = 0.05
    scale: float = 1.0
    rate: str | None = None
    size: tuple[int, int] | None = None
    lexicon: Mapping[str, str] = field(default_factory=dict)
    slack: float = 0.25
    far: float = 0.25
    sync: bool = False
    adapt: bool = True
    limits: checkup.CheckupLimits = field(default_factory=checkup.CheckupLimits)
    speech_valid: float = 0.9
    rows: tuple[int, ...] | None = None
    task: Path | None = None
    lacking: DnnvssError | None = None
    told: tuple[str, ...] = ()


def own_lexicon(given: Mapping[str, Any] | None) -> dict[str, str]:
    """Pronunciations from the settings by word as text is compared: in lower case.

    Raises:
        DnnvssError: one that is no text of known phones.
    """
    found = {}
    for word, phones in (given or {}).items():
        if not isinstance(phones, str):
            raise DnnvssError(f"corpus.importer.lexicon.{word} is {phones!r}", remedy="Give its phones, e.g. 'HH AY1'")
        found[str(word).lower()] = " ".join(check_phones(phones, str(word)))
    return found


@dataclass(frozen=True)
class Preparation:
    """The sources, how to read them, where to work, and what became of each so far.

    Args:
        sources: an utterance each.
        recipe: how they are read.
        shop: where to work.
        outcomes: what became of each.
        found: what is to be said of all of them.
        left_out: parts of long recordings that are not used: recording, start and end in seconds, why.
    """

    sources: list[Source]
    recipe: Recipe
    shop: Workshop
    outcomes: dict[str, Outcome]
    found: list[str] = field(default_factory=list)
    left_out: Sequence[tuple[str, float, float, str]] = ()

    def alive(self) -> list[Source]:
        """Return the sources that were not dropped."""
        return [s for s in self.sources if self.outcomes[s.id].status != "dropped"]

    def drop(self, name: str, reason: str) -> None:
        """Leave an utterance out; with ``strict`` that is an error."""
        self.outcomes[name].drop(reason)
        if self.shop.strict:
            raise DnnvssError(reason, utterance=name, remedy="Mend it, or run with strict=false to leave it out")

    def take(self, results: Results) -> Results:
        """Return the good results; the others drop their utterance."""
        for name, result in results.items():
            if "dropped" in result:
                self.drop(name, result["dropped"])
        return {name: result for name, result in results.items() if "dropped" not in result}

    def nothing_left(self) -> NoReturn:
        """Write the report and say why no recording can be used.

        Raises:
            DnnvssError: always.
        """
        report = write_report(self.shop.out, self.outcomes.values(), self.found, self.left_out)
        name, outcome = next(iter(self.outcomes.items()))
        raise DnnvssError(f"none of the {len(self.outcomes)} utterances can be used; the first one, {name}: "
                          f"{'; '.join(outcome.reasons)}", file=report, remedy="See the report for the others")
