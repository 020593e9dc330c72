"""The clips of an encoded corpus, as gestures are learnt from them."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from dnnvss.corpus import Utterance
from dnnvss.curves import resample
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.timing import FrameClock
from dnnvss.visemes.units import Movement, VisemeSettings, aligned_clip

_NOT_LEARNING = ("name", "source", "training", "samples", "predictor")


def viseme_settings(config: Mapping[str, Any]) -> VisemeSettings:
    """Return how units are learnt, from a file of ``conf/visemes``."""
    return VisemeSettings.from_config({key: value for key, value in config.items() if key not in _NOT_LEARNING})


def viseme_clips(utterances: Iterable[Utterance], encoded: EncodedCorpus, clock: FrameClock) -> dict[str, Movement]:
    """Return the clip of each utterance that was encoded, by id, its parameters brought to the trajectory clock."""
    clips = {}
    for utterance in utterances:
        if utterance.id not in encoded.dropped:
            edges = utterance.alignment["phones"].frame_edges(clock)
            code, count = encoded.clip(utterance.id), int(edges[-1] - edges[0])
            trajectory = resample(code.parameters.astype(float), utterance.clock, clock, count=count)
            nearest = (clock.centres(count) * float(utterance.clock.rate)).astype(int)
            valid = code.valid[np.minimum(nearest, len(code.valid) - 1)]
            clips[utterance.id] = replace(aligned_clip(trajectory, utterance.alignment, clock), valid=valid)
    return clips
