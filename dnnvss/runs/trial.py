"""A system that was opened, tried on a second of speech before anybody relies on it."""

import numpy as np

from dnnvss.corpus import Utterance
from dnnvss.errors import DnnvssError
from dnnvss.media import SPEECH_RATE, Sound
from dnnvss.systems import Prediction, VisualModel
from dnnvss.systems.examples import Task
from dnnvss.timing import Alignment, Tier
from dnnvss.visemes import TIER

_PHONES = Tier("phones", [(0, 0.3, "sil"), (0.3, 0.5, "M"), (0.5, 0.7, "AA"), (0.7, 1, "sil")])
_WORDS = Tier("words", [(0, 0.3, ""), (0.3, 0.7, "ma"), (0.7, 1, "")])
_VISEMES = Tier(TIER, [(0, 0.4, "0"), (0.4, 1, "1")])


def trial(model: VisualModel, task: Task) -> Prediction | None:
    """What a system predicts of a second of speech; None where it refuses so short an utterance.

    Files that were damaged or made up may hold arrays of other shapes than the system goes on to use; no list of them
    has to be kept in step with the systems where they are used once.

    Raises:
        ValueError: the prediction has another shape than streams of every frame, or numbers that are not finite.
        Exception: what the system trips over.
    """
    sound = Sound(np.zeros(SPEECH_RATE, np.float32), SPEECH_RATE) if "sound" in task.table.needs else None
    alignment = Alignment([_PHONES, _WORDS, _VISEMES] if "visemes" in task.table.needs else [_PHONES, _WORDS])
    try:
        example = task.example(Utterance("trial", "ma", alignment), sound=sound)
        found = model.predict(example)
    except DnnvssError:
        return None
    mean, variance = np.asarray(found.mean), np.asarray(found.variance)
    if mean.ndim != 3 or mean.shape[:2] != (len(example.codes), len(task.windows.taps)):
        raise ValueError(f"it predicts an array of {mean.shape}")
    if not np.isfinite(mean).all() or not (np.broadcast_to(variance, mean.shape) > 0).all():
        raise ValueError("it predicts numbers that are not finite, or variances that are not positive")
    return found
