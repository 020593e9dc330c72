"""The clips of an encoded corpus, as gestures are learnt from them."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from dnnvss.corpus import Utterance
from dnnvss.curves import resample
from dnnvss.face.encoding import EncodedCorpus
from dnnvss.timing import FrameClock
from dnnvss.visemes.units import Movement, VisemeSettings, aligned_clip

MOST = 3600.0
"""Seconds of recordings that dynamic visemes are learnt from; of a longer corpus every so-many-th clip, so that the
memory of learning them has a bound."""
_NOT_LEARNING = ("name", "source", "training", "samples", "predictor")


def viseme_settings(config: Mapping[str, Any]) -> VisemeSettings:
    """Return how units are learnt, from a file of ``conf/visemes``."""
    return VisemeSettings.from_config({key: value for key, value in config.items() if key not in _NOT_LEARNING})


def learnt_from(utterances: Iterable[Utterance], encoded: EncodedCorpus) -> list[Utterance]:
    """The utterances of a training split that units are learnt from: all that were encoded, of long ones a part.

    They last :data:`MOST` seconds at most and are spread evenly over the split.
    """
    kept = [u for u in utterances if u.id not in encoded.dropped]
    return kept[:: max(1, math.ceil(sum(u.frames / float(u.clock.rate) for u in kept) / MOST))]


def viseme_clips(utterances: Iterable[Utterance], encoded: EncodedCorpus,
                 clock: FrameClock) -> Iterator[tuple[str, Movement]]:
    """The id and the clip of each utterance that was encoded, its parameters brought to the trajectory clock.

    They come one after the other: the trajectories of many hours would fill the memory.
    """
    for utterance in utterances:
        if utterance.id not in encoded.dropped:
            edges = utterance.alignment["phones"].frame_edges(clock)
            code, count = encoded.clip(utterance.id), int(edges[-1] - edges[0])
            trajectory = resample(code.parameters.astype(float), utterance.clock, clock, count=count)
            nearest = (clock.centres(count) * float(utterance.clock.rate)).astype(int)
            valid = code.valid[np.minimum(nearest, len(code.valid) - 1)]
            yield utterance.id, replace(aligned_clip(trajectory, utterance.alignment, clock), valid=valid)
