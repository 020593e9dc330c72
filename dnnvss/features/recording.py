"""What feature sources read: an utterance's times, its text and its sound, each where there is one."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.media import Sound
from dnnvss.text.tree import LinguisticTree, linguistic_tree
from dnnvss.timing import Alignment, FrameClock, Tier


@dataclass(frozen=True)
class Recording:
    """An utterance before it is encoded.

    Args:
        alignment: its tiers; None where only the sound is known.
        text: the words as written.
        sound: time 0 is that of the alignment; None where there is none.

    Raises:
        DnnvssError: there is neither alignment nor sound.
    """

    alignment: Alignment | None
    text: str = ""
    sound: Sound | None = None

    def __post_init__(self) -> None:
        if self.alignment is None and self.sound is None:
            raise DnnvssError("nothing to encode: there is neither alignment nor sound", remedy="Give one of them")

    def tier(self, name: str) -> Tier:
        """The tier of a name.

        Raises:
            DnnvssError: there is none.
        """
        if self.alignment is None:
            raise DnnvssError(f"there are no times of {name!r}", remedy=f"Give an alignment with a tier {name!r}")
        return self.alignment[name]

    def edges(self, name: str, clock: FrameClock, frames: int) -> np.ndarray:
        """The frame edges (S + 1,) of a tier from 0 to ``frames``, wherever its own last edge rounds to.

        Raises:
            DnnvssError: there is no such tier, or a segment of it is longer than 65,535 frames.
        """
        if (name, clock) not in self._edges:
            edges = self.tier(name).frame_edges(clock)
            edges = np.minimum(edges - edges[0], frames)
            edges[-1] = frames
            if (longest := int(np.diff(edges).max())) > np.iinfo(np.uint16).max:
                raise DnnvssError(f"tier {name!r} has a segment of {longest} frames",
                                  remedy="Cut the recording into sentences")
            self._edges[name, clock] = edges
        return self._edges[name, clock]

    @cached_property
    def _edges(self) -> dict[tuple[str, FrameClock], np.ndarray]:
        """What several sources ask for."""
        return {}

    def span(self, clock: FrameClock) -> tuple[int, int]:
        """The first frame and the one after the last, those of the alignment where there is one.

        Raises:
            DnnvssError: the recording is shorter than half a frame.
        """
        what, start, end = "sound", 0.0, 0.0
        if self.alignment is not None:
            what, start, end = "alignment", self.alignment.start, self.alignment.end
        elif self.sound is not None:
            end = self.sound.seconds
        first, last = clock.edges(np.array([start, end])).tolist()
        if first == last:
            raise DnnvssError(f"the {what} ({end - start:.4f} s) is shorter than half a frame at {clock} frames a "
                              "second", remedy="Leave the utterance out, or choose a higher frame rate")
        return first, last

    @cached_property
    def tree(self) -> LinguisticTree:
        """The linguistic tree of alignment and text."""
        self.tier("phones")
        assert self.alignment is not None
        return linguistic_tree(self.alignment, self.text)
