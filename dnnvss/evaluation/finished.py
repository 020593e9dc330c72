"""Finished runs compared: one table of all their metrics, as text, Markdown, JSON and a page."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.across import Side, compare_faces
from dnnvss.evaluation.comparison import Predictions, compare
from dnnvss.evaluation.page import write_page
from dnnvss.evaluation.runs import RunData, by_face, make_bench, on_one_clock, read_run
from dnnvss.evaluation.sections import Section, seen_from_outside
from dnnvss.evaluation.viewing.run_scores import viewers_sections
from dnnvss.systems.registry import driven_by, read_system

PLAIN = "plain"
"""The style of a run's headline: parameter generation alone."""
_HASH = re.compile("-[0-9a-f]{8}$")


@dataclass(frozen=True)
class Compared:
    """What comes of a comparison: the table as text, and the path of the page."""

    table: str
    page: Path


def compare_runs(folders: Sequence[Path], out: Path | None = None, names: Sequence[str] | None = None, *,
                 first: int = 5, seed: int = 0) -> Compared:
    """All metrics of finished runs, written as ``evaluation.md``, ``.json`` and ``.html``.

    Runs of different faces are compared by the gauges that they share (:mod:`dnnvss.evaluation.across`), runs of
    different frame rates on the finest clock among theirs (:func:`dnnvss.evaluation.runs.on_one_clock`).

    Args:
        folders: of the runs.
        out: where to write; ``evaluation`` in the first run's folder unless given.
        names: of the runs; from their folders unless given.
        first: leading coefficients in averages.
        seed: of anchors, bootstrap and permutation tests.

    Raises:
        DnnvssError: a folder of no finished run, runs of other test sentences, or a run that is named twice.
    """
    out = out or folders[0] / "evaluation"
    runs = [read_run(folder) for folder in folders]
    files.check_writable(out / f"evaluation.{kind}" for kind in ("md", "json", "html"))
    names = names or run_titles(list(folders))
    by_name = dict(zip(names, runs, strict=True))
    sides: dict[str, Side] = {}
    origins: dict[str, tuple[str, str]] = {}
    for face, group in by_face(on_one_clock(by_name)).items():
        systems: dict[str, Predictions] = {name: run.arrays["predicted"] for name, run in group.items()}
        systems |= {f"{name}, {style}": own for name, run in group.items() for style, own in run.styled.items()}
        origins |= {name: (name, PLAIN) for name in group}
        origins |= {f"{name}, {style}": (name, style) for name, run in group.items() for style in run.styled}
        sides[face] = Side(make_bench(list(group.values()), first), systems)
    if len(sides) == 1:
        told = next(iter(sides.values()))
        result = compare(told.bench, told.systems, seed)
    else:
        result, told = compare_faces(sides, seed)
    result = result.with_inputs({row: driven(by_name[name]) for row, (name, _) in origins.items()}, origins)
    named = dict(zip(names, folders, strict=True))
    styles = {name: tuple(run.styled) for name, run in by_name.items()}
    sections = [*filter(None, [_rates(by_name)]), *viewers_sections(result, named, styles),
                *filter(None, [seen_from_outside(named)])]
    files.write_text(out / "evaluation.md", "\n".join([result.markdown(), *(s.markdown() for s in sections)]))
    files.write_json(out / "evaluation.json", result.to_json())
    page = write_page(out / "evaluation.html", result, told.bench, told.systems, named, sections)
    return Compared(result.table(), page)


def _rates(runs: Mapping[str, RunData]) -> Section | None:
    """The frame rates of runs where they differ."""
    clocks = {name: run.clock for name, run in runs.items()}
    if len(set(clocks.values())) < 2:
        return None
    finest = max(clocks.values(), key=lambda clock: clock.rate)
    note = (f"These runs predict at different rates. All were measured at {finest} frames a second: predictions of "
            "other rates were brought there by the cubic spline that brings recordings to a clock.")
    return Section("Frame rates", note, ("system", "frames a second"),
                   tuple((name, str(clock)) for name, clock in clocks.items()))


def driven(run: RunData) -> str:
    """What drives the system of a run: text, a voice, both or nothing."""
    cls, _ = read_system(run.settings.model_name, run.settings.model)
    return driven_by(cls, run.settings.task.table)


def run_titles(folders: list[Path]) -> list[str]:
    """A different name for each folder: its own without the hash, the whole or its path where two agree."""
    if len(set(map(str, folders))) < len(folders):
        raise DnnvssError("the same run is named twice", remedy="Name each run once")
    whole = [folder.resolve().name for folder in folders]
    bare = [_HASH.sub("", name) for name in whole]
    return [b if bare.count(b) == 1 else w if whole.count(w) == 1 else str(folder)
            for b, w, folder in zip(bare, whole, folders, strict=True)]
