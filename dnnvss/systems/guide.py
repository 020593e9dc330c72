"""A system that leads another: its trajectory, stretched to the talker's movement, chooses recorded pieces."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from dnnvss.features import FeatureTable
from dnnvss.systems.base import Example, VisualModel, pooled
from dnnvss.systems.plain_network import PlainNetwork
from dnnvss.systems.registry import check_inputs, read_system
from dnnvss.timing import FrameClock
from dnnvss.training.settings import FitSettings

_WHERE = "model.guide"


def check_guide(guide: Mapping[str, Any]) -> None:
    """Refuse settings of no system.

    Raises:
        DnnvssError: no such system, or a setting that it refuses.
    """
    read_system("", guide, _WHERE, f"{_WHERE}.fit")


def make_guide(guide: Mapping[str, Any], table: FeatureTable, clock: FrameClock,
               fit: FitSettings | None = None) -> VisualModel:
    """The untrained system that settings describe, as a file of ``conf/model`` says it.

    Args:
        guide: the settings.
        table, clock: of labels and trajectories.
        fit: how networks are fitted, where the settings do not say so.

    Raises:
        DnnvssError: no such system, a setting that it refuses, or labels that it does not read.
    """
    cls, settings = read_system("", guide, _WHERE, f"{_WHERE}.fit")
    if fit is not None and "fit" in {f.name for f in fields(cls.Settings)} and "fit" not in guide:
        settings = replace(settings, fit=fit)
    check_inputs(f"guided with {_WHERE}.system={cls.system}", cls, table)
    return cls(table, clock, settings)


def opened_guide(guide: Mapping[str, Any], made: Callable[[], VisualModel], table: FeatureTable, clock: FrameClock,
                 state: Mapping[str, Any]) -> VisualModel:
    """The system that settings describe, with what it learnt: a feed-forward network without torch.

    Args:
        guide: the settings.
        made: gives the untrained system.
        table, clock: of labels and trajectories.
        state: what :meth:`VisualModel.state` gave.
    """
    if PlainNetwork.serves(guide) and (plain := PlainNetwork.of(guide, table, clock, state)) is not None:
        return plain
    leader = made()
    leader.load_state(dict(state))
    return leader


def stretch_of(leader: VisualModel, examples: Sequence[Example]) -> tuple[np.ndarray, np.ndarray]:
    """The mean (D,) of what a fitted system predicts, and by how much (D,) it moves less than the talker.

    Args:
        leader: the system.
        examples: validation examples.
    """
    predicted = np.concatenate([leader.predict(e).mean[e.measured[1], 0] for e in examples]).astype(np.float64)
    measured = pooled(examples)[:, 0].std(axis=0, dtype=np.float64)
    return predicted.mean(axis=0), measured / np.maximum(predicted.std(axis=0), 1e-12)
