"""The built-in talker: sentences, their times, the movement of a face, its true landmarks and gestures, and pictures.

Everything follows from a seed; nothing is downloaded, and nothing is recorded from a person.
"""

from dnnvss.corpus.talker.face import film, render_frame
from dnnvss.corpus.talker.geometry import LANDMARK_GROUPS, SHEET, landmark_track, landmarks
from dnnvss.corpus.talker.take import RATE, Take, perform_take, script, unseen_splits
from dnnvss.corpus.talker.targets import SHAPES, TARGETS, Articulators

__all__ = [
    "LANDMARK_GROUPS",
    "RATE",
    "SHAPES",
    "SHEET",
    "TARGETS",
    "Articulators",
    "Take",
    "film",
    "landmark_track",
    "landmarks",
    "perform_take",
    "render_frame",
    "script",
    "unseen_splits",
]
