"""Training on what is shown: the error of the generated trajectory, with parameter generation inside the loss."""

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from dnnvss.errors import DnnvssError
from dnnvss.training.settings import FitSettings

CLIPS = 8
"""Utterances a step."""

Join = Callable[..., Tensor]
"""``join(mean (B, T, W, D), variance, lengths=(B,)) -> trajectory (B, T, D)``, differentiable."""


@dataclass(frozen=True)
class Clip:
    """An utterance: active columns (T, A), numeric inputs (T, N), measured trajectory (T, D), measured frames (T,)."""

    active: Tensor
    numeric: Tensor
    static: Tensor
    valid: Tensor


def refine(network: nn.Module, train: Sequence[Clip], val: Sequence[Clip], decode: Callable[[Tensor], tuple],
           join: Join, scale: Tensor, settings: FitSettings) -> list[float]:
    """Train a fitted network further on its generated trajectories; keep the weights of the best pass.

    The loss is the mean squared error between generated and measured trajectory over measured frames, each
    coefficient divided by its deviation.

    Args:
        network: fitted frame by frame, changed in place.
        train, val: utterances; ``val`` chooses the pass.
        decode: from outputs (frames, outputs) to means and variances (frames, W, D) in parameter units.
        join: parameter generation.
        scale: deviations (D,).
        settings: ``refine`` passes at ``refine_rate``, ``clip`` and ``seed``.

    Returns:
        The loss on ``val`` before the first pass and after each.

    Raises:
        DnnvssError: the loss diverged.

    **Source**: Wu and Wang, Minimum generation error training for HMM-based speech synthesis (2006).
    """
    def errors(clips: Sequence[Clip]) -> Tensor:
        """Return the squared errors (N, D) of all measured frames."""
        outputs = network(torch.cat([c.active for c in clips]), torch.cat([c.numeric for c in clips]))
        counts = [len(c.static) for c in clips]
        mean, variance = (nn.utils.rnn.pad_sequence(list(part.split(counts)), batch_first=True, padding_value=1.0)
                          for part in decode(outputs))
        x = join(mean, variance, lengths=torch.tensor(counts))
        return torch.cat([((x[b, : len(c.static)] - c.static) / scale)[c.valid].square() for b, c in enumerate(clips)])

    def validation() -> float:
        network.eval()
        with torch.no_grad():
            found = torch.cat([errors(val[i : i + CLIPS]) for i in range(0, len(val), CLIPS)])
        network.train()
        return found.mean().item()

    optimizer = torch.optim.AdamW(network.parameters(), settings.refine_rate, weight_decay=settings.weight_decay)
    losses, best = [validation()], copy.deepcopy(network.state_dict())
    for number in range(settings.refine):
        order = np.random.default_rng([settings.seed, number]).permutation(len(train))
        torch.manual_seed(settings.seed * 1_000_003 + number)
        for start in range(0, len(order), CLIPS):
            found = errors([train[i] for i in order[start : start + CLIPS]])
            if not len(found):
                continue
            value = found.mean()
            if not torch.isfinite(value):
                raise DnnvssError(f"training on trajectories diverged in pass {number}: loss {value.item()}",
                                  remedy="Lower trainer.refine_rate")
            optimizer.zero_grad()
            value.backward()
            nn.utils.clip_grad_norm_(network.parameters(), settings.clip)
            optimizer.step()
        losses.append(validation())
        if losses[-1] <= min(losses):
            best = copy.deepcopy(network.state_dict())
    network.load_state_dict(best)
    return losses
