"""What comes of judging a run from outside: a table with intervals, kept in the run's folder."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.cells import interval, number, number_of
from dnnvss.evaluation.outside.scores import MEASURES
from dnnvss.evaluation.statistics import Estimate, estimate
from dnnvss.formats.tables import aligned, markdown_numbers
from dnnvss.records import read_record
from dnnvss.runs.files import RunFiles

VOICE, TEXT = "times from the voice", "text alone"
IN_VOICE, IN_TEXT, IN_STILL = (f"in the recording: {row}" for row in (VOICE, TEXT, "a still mouth"))
OWN, CEILING, LATE, OTHER = "through the face", "recompressed", "40 ms late", "another sentence"
ROWS = {VOICE: "The run's face at the phones' times in the recording.",
        TEXT: "The run's face at the run's own times, laid over the recording word by word.",
        IN_VOICE: "The same mouth drawn into the recording, whose head it shares: what the tracker measures changes "
                  "with a head that turns.",
        IN_TEXT: "The run's mouth at the run's own times, laid over the recording word by word and drawn into it.",
        IN_STILL: "The mean face, at rest in every frame, drawn into the recording: what its head alone tells.",
        OWN: "What was measured in the recording, drawn: what is left of it when nothing has to be predicted.",
        CEILING: "The recording blurred and compressed again: what this tracker can tell at best.",
        LATE: "The recording late: a system should beat it.",
        OTHER: "The recording of another sentence, as long: a system has to beat it."}
"""The rows of the table and what they are."""
OF_A_RUN = (VOICE, TEXT, IN_VOICE, IN_TEXT)
"""The rows that tell of the run's own prediction."""

_REMEDY = "Judge the run again: python -m dnnvss outside RUN"


@dataclass(frozen=True)
class Judged:
    """What comes of it.

    Args:
        sentences: ids.
        style: of the run's faces.
        pairs: row to measure to amount and weight of each sentence.
        left_out: what could not be measured, and why.
    """

    sentences: tuple[str, ...]
    style: str
    pairs: Mapping[str, Mapping[str, tuple[tuple[float, float], ...]]]
    left_out: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        lengths = {len(own) for by in self.pairs.values() for own in by.values()}
        if set(self.pairs) != set(ROWS) or any(set(by) != set(MEASURES) for by in self.pairs.values()) or \
                lengths != {len(self.sentences)}:
            raise DnnvssError("does not hold the rows and measures that are known", remedy=_REMEDY)

    @classmethod
    def load(cls, folder: Path) -> "Judged | None":
        """What a run was judged to be; None where it was not.

        Raises:
            DnnvssError: the file is damaged or of another version.
        """
        path = RunFiles(folder).outside
        return read_record(cls, path, _REMEDY) if path.is_file() else None

    def save(self, folder: Path) -> Path:
        """Write ``outside.json`` and ``outside.md`` into the run's folder ``evaluation`` and return the latter."""
        path = RunFiles(folder).outside
        with files.together(path):
            files.write_text(path.with_suffix(".md"), self.markdown())
            files.write_json(path, asdict(self))
        return path.with_suffix(".md")

    def estimate(self, row: str, measure: str) -> Estimate:
        """A value with its 95 % interval over the sentences."""
        return estimate(np.array(self.pairs[row][measure]))

    def rows(self, row: str) -> list[str]:
        """The values of a row with their intervals, as text."""
        return [interval(self.estimate(row, measure)) for measure in MEASURES]

    def table(self) -> str:
        """The values as text for the screen."""
        return aligned(["", *MEASURES], [[row, *(number(self.estimate(row, m).value) for m in MEASURES)]
                                         for row in ROWS])

    def markdown(self) -> str:
        """The values with their intervals, and what they mean."""
        told = [f"- **{name}**: {definition}" for name, definition in {**ROWS, **MEASURES}.items()]
        return "\n\n".join([
            f"{number_of(len(self.sentences), 'test sentence')} in the style {self.style}, the talker's own video and "
            "ours seen by one tracker that knows nothing of the model. In brackets the 95 % bootstrap interval over "
            "sentences.",
            markdown_numbers(["", *MEASURES], [[row, *self.rows(row)] for row in ROWS]), *self.left_out,
            "\n".join(told)]) + "\n"
