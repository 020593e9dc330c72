"""Frame classification: which class a frame belongs to, and whether something begins with it."""

from collections.abc import Callable, Mapping

from torch import Tensor, nn

from dnnvss.errors import DnnvssError
from dnnvss.training.batches import Batch
from dnnvss.training.objective import Measured, Network, Objective


class FrameClassification(Objective):
    """The cross-entropy of the class of each frame plus that of whether a segment begins with the frame.

    Outputs are the logits of U classes and, last, of a beginning; targets (B, 2) are the class and 0 or 1.

    Args:
        error: makes the error of a fit that has diverged, see :meth:`Objective.diverged`.
    """

    watched, title = "val/loss", "loss"

    def __init__(self, error: Callable[[str, float], DnnvssError]) -> None:
        super().__init__()
        self.told = error

    def loss(self, network: Network, batch: Batch) -> Tensor:
        """The loss of a batch of frames."""
        logits, target = network(batch[0], batch[1]), batch[2]
        unit = nn.functional.cross_entropy(logits[:, :-1], target[:, 0].long())
        return unit + nn.functional.binary_cross_entropy_with_logits(logits[:, -1], target[:, 1])

    def measures(self, network: Network, batch: Batch) -> Mapping[str, Measured]:
        """The loss; every batch counts alike."""
        return {"val/loss": Measured(self.loss(network, batch), 1)}

    def diverged(self, where: str, value: float) -> DnnvssError:
        """The error of whoever fits."""
        return self.told(where, value)
