"""How weights move: the optimiser, the schedule of its rate, clipping, and where dropout has its chance from."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import cast

import torch
from torch import nn
from torch.optim.lr_scheduler import LambdaLR, LRScheduler, OneCycleLR

from dnnvss.training.clipping import clip_as_torch, clip_each, clip_quickly
from dnnvss.training.settings import FitSettings


@dataclass(frozen=True)
class Moment:
    """Where a fit stands: the epoch, whether this is its first step, and the steps taken in all."""

    epoch: int
    first: bool
    taken: int


@dataclass(frozen=True)
class Recipe:
    """How the weights of a fit move.

    Args:
        optimizer: makes the optimiser of a network's weights.
        schedule: makes the schedule of its rate, which goes on with every step, for so many steps in all.
        clip: scales gradients that are too large.
        seed: the seed that a step sets torch's generator to, None where that runs on. Every checkpoint keeps the
            generator, so that a fit which is resumed draws what one that was not would.
    """

    optimizer: Callable[[nn.Module], torch.optim.Optimizer]
    schedule: Callable[[torch.optim.Optimizer, int], LRScheduler]
    clip: Callable[[Sequence[nn.Parameter]], None]
    seed: Callable[[Moment], int | None]


def descent(settings: FitSettings, members: int = 1) -> Recipe:
    """SGD or AdamW as the settings say; dropout is seeded by the step.

    Args:
        settings: of the fit.
        members: networks that are stacked; the gradients of each are clipped by themselves.
    """
    clip = clip_each if members > 1 else clip_quickly
    return Recipe(partial(_optimizer, settings), partial(_risen, settings), partial(clip, most=settings.clip),
                  lambda moment: settings.seed * 1_000_003 + moment.taken)


def one_cycle(settings: FitSettings) -> Recipe:
    """AdamW whose rate rises over the share ``warmup`` of the steps and falls to nothing; dropout runs on."""
    return Recipe(partial(_alike, settings, fused=True), partial(_one_cycle, settings),
                  partial(clip_as_torch, most=settings.clip), lambda moment: None)


def steady(settings: FitSettings) -> Recipe:
    """AdamW with one rate throughout; dropout is seeded by the epoch."""
    def seed(moment: Moment) -> int | None:
        return settings.seed * 1_000_003 + moment.epoch if moment.first else None

    return Recipe(partial(_alike, settings, fused=False), _constant, partial(clip_as_torch, most=settings.clip), seed)


def _alike(settings: FitSettings, network: nn.Module, fused: bool) -> torch.optim.Optimizer:
    """AdamW with one rate for all weights."""
    return torch.optim.AdamW(network.parameters(), settings.learning_rate, weight_decay=settings.weight_decay,
                             fused=fused)


def _optimizer(settings: FitSettings, network: nn.Module) -> torch.optim.Optimizer:
    if settings.optimizer == "sgd":
        return torch.optim.SGD(network.parameters(), settings.learning_rate, settings.momentum,
                               weight_decay=settings.weight_decay, fused=True)
    rates = dict.fromkeys(network.parameters(), settings.learning_rate)
    for weight, inputs in _matrices(network).items():
        if inputs > settings.base_width > 0:
            rates[weight] *= settings.base_width / inputs
    groups = [{"params": [weight for weight, own in rates.items() if own == rate], "lr": rate}
              for rate in sorted(set(rates.values()), reverse=True)]
    return torch.optim.AdamW(groups, weight_decay=settings.weight_decay, fused=True)


def _matrices(network: nn.Module) -> dict[nn.Parameter, int]:
    """The weights of linear layers and how many inputs their units have.

    A step of AdamW changes every weight by as much, whatever the gradient, and so a unit the more the more inputs it
    has: the rate falls with them (Yang et al. 2021, Tensor Programs V).
    """
    stacked: Mapping[nn.Parameter, int] = getattr(network, "matrices", {})
    own = [layer for layer in network.modules() if isinstance(layer, nn.Linear)]
    return {**stacked, **{cast(nn.Parameter, layer.weight): layer.in_features for layer in own}}


def _constant(optimizer: torch.optim.Optimizer, steps: int) -> LRScheduler:
    del steps
    return LambdaLR(optimizer, lambda step: 1.0)


def _risen(settings: FitSettings, optimizer: torch.optim.Optimizer, steps: int) -> LRScheduler:
    """A rate that rises from nothing and stays, or falls along a cosine."""
    warmup = max(1, int(settings.warmup * steps))

    def factor(step: int) -> float:
        rise = min(1.0, (step + 1) / warmup)
        if settings.schedule == "constant":
            return rise
        return rise * 0.5 * (1 + math.cos(math.pi * min(1.0, step / steps)))

    return LambdaLR(optimizer, factor)


def _one_cycle(settings: FitSettings, optimizer: torch.optim.Optimizer, steps: int) -> LRScheduler:
    total, rise = steps + 1, settings.warmup
    if abs(rise * total - 1) < 1e-6:  # a rise that ends where it begins is divided by
        rise += 1e-3 / total
    return OneCycleLR(optimizer, settings.learning_rate, total_steps=total, pct_start=rise)
