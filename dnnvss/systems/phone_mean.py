"""The mean of each phone: a null model, which a network has to beat."""

import numpy as np

from dnnvss.features import phones_of
from dnnvss.systems.base import Example
from dnnvss.systems.training_mean import TableModel


class PhoneMean(TableModel):
    """The mean of the training frames of the current phone, without context."""

    system = "phone_mean"
    reads = frozenset({"phones"})
    looks_up = frozenset({"phones"})

    def classes(self, example: Example) -> np.ndarray:
        """Return the phone code of every frame."""
        phones = phones_of(example.codes)
        return np.repeat(phones.code, phones.frames)
