"""One recorded sentence: what was said, when, and where its media are."""

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from dnnvss.timing import Alignment, FrameClock


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
    def from_json(cls, value: dict[str, Any]) -> "Utterance":
        """Return the utterance that :meth:`to_json` described."""
        return cls(**{**value, "rate": Fraction(value["rate"]), "alignment": Alignment.from_json(value["alignment"])})
