"""A sample of recordings, prepared as all would be, in a folder of its own: what is found, and how long it takes."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from data_prep.alignments import aligned
from data_prep.checks import examined, found
from data_prep.headers import Header, cut, spread
from data_prep.landmarks import read_all
from data_prep.recipe import Preparation, Recipe, Results, Source
from data_prep.recordings import brought, recorded, usual
from data_prep.report import Outcome
from data_prep.sounds import sounds
from data_prep.stages import Workshop
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.formats import Landmarks, write_npz

Made = TypeVar("Made")

LONG = 40.0
"""Seconds from which a recording is too long to be looked at as a whole."""

PART = 8.0
"""Seconds of a long recording that are looked at: a third of the way in, where somebody will be talking."""

MOST = 8
"""Recordings that are looked at."""


@dataclass
class Sample:
    """Recordings that were prepared as far as that went.

    Args:
        sources: the recordings; of a long one a part.
        cut: ids of those that are parts.
        run: what became of each.
        made: what is known of pictures and sounds.
        bad: frames (F,) that are not of the face; none where that was not looked at.
        timed: phone times.
        took: stage to seconds.
        before: seconds of those that had been looked at already and cost no time.
    """

    sources: list[Source]
    cut: set[str]
    run: Preparation
    made: Results = field(default_factory=dict)
    bad: Mapping[str, np.ndarray] = field(default_factory=dict)
    timed: Results = field(default_factory=dict)
    took: dict[str, float] = field(default_factory=dict)
    before: float = 0.0

    @property
    def wordless(self) -> set[str]:
        """Ids of what is not aligned: parts, and recordings whose words are not known yet."""
        return self.cut | {s.id for s in self.sources if not s.words and s.alignment is None}

    @property
    def seconds(self) -> float:
        """Seconds of recording that were looked at."""
        return sum(m["frames"] / float(Fraction(m["rate"])) for m in self.made.values())

    def step(self, name: str, work: Callable[..., Made], *arguments: Any) -> Made:
        """Do a step and remember how long it took."""
        began = time.monotonic()
        try:
            return work(*arguments)
        finally:
            self.took[name] = time.monotonic() - began


def sampled(sources: Sequence[Source], known: Mapping[Path, Header], recipe: Recipe, folder: Path,
            budget: float) -> Sample | None:
    """So many recordings as can be looked at in a time, prepared; None where none can be used.

    The first one tells how many.

    Args:
        sources: those without a problem.
        known: headers by path.
        recipe: how they are read.
        folder: where to work.
        budget: seconds.
    """
    order = spread(sources, MOST)
    if not order:
        return None
    first = _prepared(order[:1], known, recipe, folder)
    count = int(budget / max(sum(first.took.values()), 0.1))
    if count < 2 or len(order) < 2:
        return first
    more = _prepared(order[:count], known, recipe, folder)
    more.before = first.seconds
    return more


def _prepared(sources: Sequence[Source], known: Mapping[Path, Header], recipe: Recipe, folder: Path) -> Sample:
    parts: set[str] = set()
    short = [_shortened(s, known, recipe, folder, parts) for s in sources]
    shop = Workshop(folder / "sample", jobs=1, backend="threading")
    plain = replace(recipe, splits={}, sync=False, adapt=False)
    outcomes = {s.id: Outcome(s.id, list(s.notes)) for s in short}
    sample = Sample(short, parts, Preparation(list(short), plain, shop, outcomes))
    try:
        _walk(sample)
    except ShortageError:
        raise
    except DnnvssError as error:  # none of them is left: what became of them says why
        sample.run.found.append(str(error))
    return sample


def _walk(sample: Sample) -> None:
    run = sample.run
    sample.made = sample.step("reading", recorded, run)
    with_points = run.recipe.lacking is None
    if with_points:
        sample.step("finding faces", found, run, sample.made)
    size, rate = usual(run, sample.made)
    sample.made = sample.step("bringing to one size and rate", brought, run, sample.made, size, rate)
    if with_points:
        sample.bad = sample.step("checking", examined, run, sample.made, size)
    late = dict.fromkeys(sample.made, 0.0)
    sample.made = sounds(run, sample.made, late)
    whole = replace(run, sources=[s for s in run.sources if s.id not in sample.wordless])
    sample.timed = sample.step("aligning", aligned, whole, sample.made, late)


def _shortened(source: Source, known: Mapping[Path, Header], recipe: Recipe, folder: Path, parts: set[str]) -> Source:
    """A recording, or a part of it where it is long."""
    video = source.video
    if video is None or video not in known or known[video].seconds <= LONG:
        return source
    parts.add(source.id)
    short, marks = folder / "parts" / f"{source.id}.mp4", folder / "parts" / f"{source.id}.npz"
    if not short.exists():
        short.parent.mkdir(exist_ok=True)
        start = 0.0 if source.landmarks else known[video].seconds / 3
        count = cut(video, source.sound if not known[video].sound else None, start, PART, short)
        if source.landmarks:
            whole = read_all(source.landmarks, 1.0, recipe.info.dimensions)
            write_npz(marks, Landmarks(whole.points[:count], whole.valid[:count]))
    return replace(source, video=short, sound=None, bounds=(), alignment=None,
                   landmarks=(marks,) if source.landmarks else ())
