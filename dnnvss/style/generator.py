"""How the commands generate trajectories: the style of a configuration, what the talker shows, an artist's keys."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from weakref import ref

import numpy as np

from dnnvss.curves import Constraints, mlpg
from dnnvss.curves.passages import LONG, in_passages
from dnnvss.errors import DnnvssError
from dnnvss.face.base import Face, Gauge
from dnnvss.settings import setting
from dnnvss.style import Style, Talker, coefficients
from dnnvss.style.generation import Dials, generate_in_passages
from dnnvss.style.keys import Key, key_constraints
from dnnvss.systems import Example, Prediction, VisualModel
from dnnvss.systems.examples import Task
from dnnvss.timing import Tier

PLAIN = Style()
_LATELY = 4
"""Predictions that are held."""


@dataclass(frozen=True, kw_only=True)
class StyleSettings(Dials):
    """A file of ``conf/style``: a :class:`Style` whose groups hold the names of coefficients.

    Args:
        name: of the file.
        groups: names for groups of coefficients, for ``by_group``.
    """

    name: str
    groups: Mapping[str, tuple[str, ...]] = setting({})


def make_style(settings: StyleSettings, face: Face) -> Style:
    """The style that a file of ``conf/style`` describes.

    Args:
        settings: in that file.
        face: whose parameters are grouped; its own groups (``face.groups``) are there beside those of the settings.

    Raises:
        DnnvssError: a coefficient or a group that the face does not have.
    """
    groups: dict[str, Sequence[int]] = dict(face.groups)
    names = face.names
    for group, members in settings.groups.items():
        if unknown := [m for m in members if m not in names]:
            raise DnnvssError(f"style.groups.{group}: no coefficient is named {unknown[0]!r}",
                              remedy=f"Use names from {names[0]} to {names[-1]}")
        groups[group] = [names.index(m) for m in members]
    if unknown := sorted(set(settings.by_group) - set(groups)):
        raise DnnvssError(f"style.by_group: no group is named {unknown[0]!r}", remedy=f"Use one of {sorted(groups)}")
    same = {f.name: getattr(settings, f.name) for f in fields(Dials)}
    return Style(groups=groups, **same)


def all_gauges(face: Face) -> dict[str, Gauge]:
    """What keys may hold and curves show, by name: the face's gauges, and every coefficient."""
    return {**face.gauges, **coefficients(face.names)}


def learn_talker(task: Task, model: VisualModel, examples: Mapping[str, list[Example]],
                 face: Face) -> Talker:
    """What the training utterances show of the talker, and how much less the model moves on the validation ones."""
    def measured(split: str) -> tuple[list[np.ndarray], list[Tier], list[np.ndarray]]:
        known = [(e.measured[0][:, 0], e.alignment["phones"], e.measured[1]) for e in examples[split]]
        return [x for x, _, _ in known], [tier for _, tier, _ in known], [valid for _, _, valid in known]

    references, tiers, valid = measured("train")
    talker = Talker.of(references, tiers, task.clock, face, valid)
    generator = Generator(task, model, talker)
    references, tiers, valid = measured("val")
    return talker.knowing([generator(e, PLAIN) for e in examples["val"]], references, tiers, task.clock, valid)


@dataclass(frozen=True)
class Generator:
    """A trained model and its talker: examples in, trajectories out."""

    task: Task
    model: VisualModel
    talker: Talker
    _lately: "list[tuple[ref[Example], Prediction]]" = field(default_factory=list, repr=False, compare=False)

    def __call__(self, example: Example, style: Style, keys: Sequence[Key] = (),
                 held: Mapping[str, Gauge] | None = None, tier: Tier | None = None) -> np.ndarray:
        """Return the trajectory (T, D) of an example.

        Args:
            example: the utterance.
            style: the settings; the default of :class:`Style` is plain MLPG, bit for bit.
            keys: an artist's, to be held.
            held: what the keys name.
            tier: the phones as they are said, where the example has other phones stand in for some; the example's own
                where None.
        """
        task, frames = self.task, len(example.codes)
        predicted = self.model.predictor(example) if frames > LONG else self._predicted(example).part
        phones = tier or example.alignment["phones"]
        if style.plain and not keys:
            return in_passages(frames, lambda around: np.asarray(mlpg(*predicted(around), task.windows)))
        constraints: Constraints | None = None
        if keys:
            constraints = key_constraints(keys, held or {}, task.clock, frames, phones)
        return generate_in_passages(predicted, frames, phones, task.clock, self.talker, style, task.windows,
                                    constraints)

    def _predicted(self, example: Example) -> Prediction:
        """The prediction of an example. That of the last few is at hand: who drags a key waits for the solve alone."""
        held = [(known, prediction) for known, prediction in self._lately if known() is not None]
        for known, prediction in held:
            if known() is example:
                return prediction
        prediction = self.model.predict(example)
        self._lately[:] = [*held[1 - _LATELY:], (ref(example), prediction)]
        return prediction
