"""Dynamic visemes: gestures cut from trajectories, the units that they fall into. Knows nothing of the network."""

from dnnvss.visemes.clusters import METHODS, Partition, partition
from dnnvss.visemes.decoding import DecodingSettings, Evidence, sample, viterbi
from dnnvss.visemes.gestures import RULES, Gestures, GestureSettings, cut, reference_speed, silence_mask
from dnnvss.visemes.grammar import Grammar
from dnnvss.visemes.measure import BoundaryScores, UnitScores, boundary_scores, label_agreement, unit_scores
from dnnvss.visemes.selection import UnitCount, compare_units
from dnnvss.visemes.units import (
    REST,
    TIER,
    Movement,
    Visemes,
    VisemeSettings,
    aligned_clip,
    gesture_view,
    learn,
    point_view,
    viseme_tier,
)

__all__ = [
    "METHODS",
    "REST",
    "RULES",
    "TIER",
    "BoundaryScores",
    "DecodingSettings",
    "Evidence",
    "GestureSettings",
    "Gestures",
    "Grammar",
    "Movement",
    "Partition",
    "UnitCount",
    "UnitScores",
    "VisemeSettings",
    "Visemes",
    "aligned_clip",
    "boundary_scores",
    "compare_units",
    "cut",
    "gesture_view",
    "label_agreement",
    "learn",
    "partition",
    "point_view",
    "reference_speed",
    "sample",
    "silence_mask",
    "unit_scores",
    "viseme_tier",
    "viterbi",
]
