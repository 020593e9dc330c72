"""One recorded sentence: what was said, when, and where its media are."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.settings import read_settings, setting
from dnnvss.timing import Alignment, FrameClock

_MOST = 100_000_000  # frames of a recording


@dataclass(frozen=True)
class Utterance:
    """A sentence of a corpus, or one to be synthesised (then without media).

    Args:
        id: unique in the corpus; also the stem of its files.
        text: the words as written, punctuation included.
        alignment: tiers ``phones`` and ``words`` (``visemes`` where known), in seconds from the start of the recording.
        video, audio, landmarks: paths relative to the corpus folder, or None where there is none.
        rate: source frame rate of the video.
        frames: number of video frames.
        digest: of the content of video, audio and landmarks; empty where it is not known.
    """

    id: str
    text: str
    alignment: Alignment
    video: str | None = None
    audio: str | None = None
    landmarks: str | None = None
    rate: Fraction = Fraction(25)
    frames: int = 0
    digest: str = ""

    @property
    def clock(self) -> FrameClock:
        """The clock of the source video."""
        return FrameClock(self.rate)

    def to_json(self) -> dict[str, Any]:
        """Return plain containers, one line of ``utterances.jsonl``."""
        digest = {"digest": self.digest} if self.digest else {}
        return {
            "id": self.id,
            "text": self.text,
            "video": self.video,
            "audio": self.audio,
            "landmarks": self.landmarks,
            "rate": str(self.rate),
            "frames": self.frames,
            **digest,
            "alignment": self.alignment.to_json(),
        }

    @classmethod
    def from_json(cls, value: Any) -> "Utterance":
        """The utterance that :meth:`to_json` described.

        Raises:
            DnnvssError: names, types or values that no utterance has; its id and its files are names inside the corpus.
        """
        line = read_settings(_Line, value, "")
        media = (line.video, line.audio, line.landmarks)
        for name in (line.id, *(name for name in media if name is not None)):
            files.check_name(name, Path("utterances.jsonl"))
        if "/" in line.id:
            raise DnnvssError(f"the id {line.id!r} is no name of a file")
        clock, alignment = FrameClock.from_setting(line.rate, "rate"), Alignment.from_json(line.alignment)
        return cls(line.id, line.text, alignment, *media, clock.rate, line.frames, line.digest)


@dataclass(frozen=True)
class _Line:
    """A line of ``utterances.jsonl``."""

    id: str
    text: str
    alignment: Mapping[str, Any]
    video: str | None
    audio: str | None
    landmarks: str | None
    rate: str
    frames: int = setting(least=0, most=_MOST)
    digest: str = ""


def read_utterances(path: Path, remedy: str) -> dict[str, Utterance]:
    """The utterances of a file of lines that :meth:`Utterance.to_json` described, by id.

    Raises:
        DnnvssError: the file cannot be read, or a line is no utterance, or one that was there before; names the line.
    """
    found: dict[str, Utterance] = {}
    for number, line in enumerate(files.read_text(path, remedy).split("\n"), start=1):
        if not line.strip():
            continue
        try:
            utterance = Utterance.from_json(json.loads(line))
            if utterance.id in found:
                raise DnnvssError(f"utterance {utterance.id} is there twice")
        except (DnnvssError, ValueError, RecursionError) as error:
            problem = error.problem if isinstance(error, DnnvssError) else f"is no JSON ({error})"
            raise DnnvssError(f"line {number}: {problem}", file=path, remedy=remedy) from error
        found[utterance.id] = utterance
    return found
