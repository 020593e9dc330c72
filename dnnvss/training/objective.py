"""What a fit makes small: a loss over batches, and what tells the best epoch."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NamedTuple

from torch import Tensor, nn

from dnnvss.errors import DnnvssError

Network = Callable[..., Tensor]
"""Anything that is called with the inputs of a batch: a module, or its compiled form."""


class Measured(NamedTuple):
    """A mean over part of the validation data, and how much that part counts."""

    value: Tensor
    weight: int


class Objective(nn.Module, ABC):
    """A loss; its buffers go to the device of the network.

    Frame regression, frame classification and the error of generated trajectories are objectives of one loop
    (:mod:`dnnvss.training.fit`).
    """

    watched: ClassVar[str]
    """The measure by which an epoch is the best, and by which a fit stops early."""
    title: ClassVar[str]
    """What is watched, in words."""
    most: ClassVar[float] = math.inf
    """The value of what is watched beyond which a fit has diverged, in units of :attr:`null` where that is above 1."""
    null: ClassVar[str] = ""
    """The measure of what saying nothing costs on the validation data; none where empty."""

    @abstractmethod
    def loss(self, network: Network, batch: Any) -> Tensor | None:
        """The loss of a batch, None where the batch says nothing and no step is to be taken."""

    @abstractmethod
    def measures(self, network: Network, batch: Any) -> Mapping[str, Measured]:
        """What is measured of a validation batch, by the names under which it is logged."""

    @abstractmethod
    def diverged(self, where: str, value: float) -> DnnvssError:
        """The error that ends a fit which has diverged.

        Args:
            where: what was measured, and when.
            value: what it came to.
        """
