"""What is known of recordings after a first look, and what follows from it for all of them."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from data_prep.adapt import LEAST
from data_prep.headers import Header
from data_prep.recipe import Recipe, Source
from data_prep.sample import Sample
from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.media import SPEECH_RATE, Sound, read_audio
from dnnvss.phones import SILENCE, SILENCES
from dnnvss.speech.activity import SPEECH, voice_activity
from dnnvss.text.coverage import Coverage
from dnnvss.text.lexicon import pronunciations
from dnnvss.timing import Alignment, FrameClock


@dataclass(frozen=True)
class Look:
    """What is known of recordings after a first look.

    Args:
        name: of the corpus.
        variant: of English.
        sources: all recordings.
        problems: id to why a recording cannot be used, as far as that is known without reading it.
        kinds: suffix to files, of the folders that the recordings lie in.
        headers: of the recordings, by path; where there are many, of some.
        sample: what was prepared; None where nothing could be.
        coverage: of the sounds in the texts.
        lacking: why landmarks cannot be found, where they are needed and cannot.
        jobs: how many recordings are worked on at a time.
    """

    name: str
    variant: str
    sources: list[Source]
    problems: Mapping[str, str]
    kinds: Mapping[str, int]
    headers: Mapping[Path, Header]
    sample: Sample | None
    coverage: Coverage
    lacking: DnnvssError | None
    jobs: int

    @property
    def usable(self) -> int:
        """How many recordings have no problem that is known by now."""
        return len(self.sources) - len(self.problems)

    @property
    def seconds(self) -> float:
        """Length of all usable recordings, by the mean of those whose headers were read."""
        return self._mean_length() * self.usable

    @property
    def kept(self) -> float:
        """Share of the sample that is kept."""
        outcomes = self.sample.run.outcomes.values() if self.sample else []
        return sum(o.status != "dropped" for o in outcomes) / max(len(outcomes), 1)

    @property
    def speech(self) -> float:
        """Seconds of speech with a face to learn from that the recordings will hold, as the sample does."""
        if self.sample is None:
            return 0.0
        outcomes = self.sample.run.outcomes
        spoken = [_spoken(self.sample, name) for name in self.sample.made
                  if outcomes[name].status != "dropped" and self.sample.made[name].get("audio")]
        said, whole = (sum(each) for each in zip(*spoken, strict=True)) if spoken else (0.0, 0.0)
        return self.seconds * self.kept * said / whole if whole else 0.0

    @property
    def stages(self) -> dict[str, float]:
        """Stage to the seconds that it will take for all recordings, as many as there are cores at a time."""
        if self.sample is None or (new := self.sample.seconds - self.sample.before) <= 0:
            return {}
        share = self.seconds / new / self.jobs
        again = 2 if self.seconds * 0.5 > LEAST else 1  # the talker's own voice aligns them a second time
        return {stage: took * share * (again if stage == "aligning" else 1)
                for stage, took in self.sample.took.items()}

    def _mean_length(self) -> float:
        lengths = [h.seconds for h in self.headers.values() if h.seconds]
        return sum(lengths) / max(len(lengths), 1)


def said(sources: Iterable[Source], recipe: Recipe) -> Coverage:
    """The sounds in the texts of recordings, each word by its first pronunciation, silence at the ends."""
    spoken: dict[str, tuple[str, ...]] = {}
    phones, triphones = Counter[str](), set[str]()
    for source in sources:
        row = [SILENCE]
        for word in source.words:
            if word not in spoken:
                spoken[word] = _phones(word, recipe)
            row += spoken[word]
        row.append(SILENCE)
        phones.update(row[1:-1])
        triphones.update(f"{a}-{b}+{c}" for a, b, c in zip(row, row[1:], row[2:], strict=False))
    return Coverage.of(phones, triphones)


def _phones(word: str, recipe: Recipe) -> tuple[str, ...]:
    try:
        return pronunciations(word, recipe.info.variant, recipe.lexicon)[0]
    except DnnvssError:  # told where the recording is prepared
        return ()


def _spoken(sample: Sample, name: str) -> tuple[float, float]:
    """Seconds of a recording that are speech with a face, and its seconds."""
    made = sample.made[name]
    clock = FrameClock(made["rate"])
    good = ~sample.bad[name] if name in sample.bad else None
    said = 0
    for start, end in _stretches(sample, name):
        first, last = clock.edge(start), clock.edge(end)
        said += last - first if good is None else int(good[first:last].sum())
    return clock.seconds(said), clock.seconds(made["frames"])


def _stretches(sample: Sample, name: str) -> list[tuple[float, float]]:
    """Start and end of speech in a recording: of its phones where they are known, else of what is loud."""
    if name in sample.timed:
        phones = Alignment.from_json(sample.timed[name]["alignment"])["phones"]
        return [(p.start, p.end) for p in phones if p.label not in SILENCES]
    samples = read_audio(files.inside(sample.run.shop.out, sample.made[name]["audio"]))
    return [(s.start, s.end) for s in voice_activity(Sound(samples, SPEECH_RATE)) if s.label == SPEECH]
