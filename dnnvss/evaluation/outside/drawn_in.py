"""The recording of a sentence with another mouth drawn into it: the tracker then sees the talker's own head move."""

from dataclasses import dataclass

import numpy as np

from dnnvss.corpus import Corpus, Utterance
from dnnvss.evaluation.outside.lips import Lips, see
from dnnvss.face.base import Face
from dnnvss.face.landmarker import Landmarker
from dnnvss.render import Footage
from dnnvss.render.footage import revoicer
from dnnvss.synthesis.footage import recorded_footage


@dataclass(frozen=True)
class Redrawn:
    """A recording that mouths are drawn into.

    Args:
        face: what draws them.
        footage: the frames that can be drawn into.
        first: number of the first of them.
        frames: of the recording, F.
    """

    face: Face
    footage: Footage
    first: int
    frames: int

    @classmethod
    def open(cls, face: Face, corpus: Corpus, utterance: Utterance) -> "Redrawn":
        """The recording of an utterance.

        Raises:
            DnnvssError: a face without texture, or no five frames in a row with usable landmarks.
        """
        whole = recorded_footage(face, corpus, utterance)
        footage, first = whole.usable()
        return cls(face, footage, first, len(whole))

    def see(self, landmarker: Landmarker, shown: np.ndarray) -> Lips:
        """The lips as parameters (F, D) move them; not seen in frames that cannot be drawn into."""
        part = np.arange(len(self.footage))
        rows = shown[np.minimum(self.first + part, len(shown) - 1)]
        drawn = see(landmarker, revoicer(self.face, self.footage, part).frames(rows))
        tracks, seen = np.zeros((self.frames, drawn.tracks.shape[1])), np.zeros(self.frames, bool)
        tracks[self.first + part], seen[self.first + part] = drawn.tracks, drawn.seen
        return Lips(tracks, seen)
