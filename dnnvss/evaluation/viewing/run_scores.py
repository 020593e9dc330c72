"""Viewers' scores beside what is measured: left in the runs that were seen, and shown where runs are compared."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from scipy import stats

from dnnvss import files
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.evaluation.cells import interval, number, p_value
from dnnvss.evaluation.comparison import Comparison
from dnnvss.evaluation.sections import Section
from dnnvss.evaluation.viewing.analysis import Analysis
from dnnvss.evaluation.viewing.sheet import CHANGED, KEY, Sheet
from dnnvss.evaluation.viewing.tables import Score, Table
from dnnvss.records import read_record
from dnnvss.runs.files import RunFiles
from dnnvss.settings import setting

METRICS = ("correlation", "gv_ratio", "closure_recall")
"""What viewers' scores stand beside."""
FEWEST = 3
"""Systems from which ranks can be compared."""
_REMEDY = "Analyse the test again: dnnvss viewing analyse FOLDER"


@dataclass(frozen=True)
class Seen:
    """What viewers gave a run in one test.

    Args:
        test, title: of the test.
        unit: of the score, in words.
        viewers: who counted.
        style: of the movement that they saw.
        score, low, high: with the 95 % interval over viewers; None where there is none.
        digest: of what the run had learnt.
    """

    test: str
    title: str
    unit: str
    viewers: int = setting(least=1)
    style: str = "plain"
    score: float = 0.0
    low: float | None = None
    high: float | None = None
    digest: str = ""


@dataclass(frozen=True)
class SeenBy:
    """The file in a run folder.

    Args:
        tests: what viewers gave the run in each test.
        made: digests of the keys of the tests that were made of it here: no other key leaves scores.
    """

    tests: tuple[Seen, ...] = ()
    made: tuple[str, ...] = ()


def note_test(sheet: Sheet, folder: Path) -> list[Path]:
    """Note in every run of a test in ``folder`` that it was made of it; return the runs that cannot be written."""
    key, closed = files.digest(folder / KEY), []
    for run in sorted({condition.run for condition in sheet.conditions if condition.shows == "run"}):
        places = RunFiles(Path(run))
        if not places.model.is_file():
            continue
        try:
            with files.locked(places.viewing):
                kept = _kept(places)
                made = tuple(dict.fromkeys((*kept.made, key)))
                files.write_json(places.viewing, asdict(replace(kept, made=made)))
        except ShortageError:
            raise
        except DnnvssError:
            closed.append(places.folder)
    return closed


def leave_scores(result: Analysis, key: str) -> list[Path]:
    """Write viewers' scores into the runs that they saw, and return the files.

    A run that has moved, or has been trained anew, one of which this test was not made here (:func:`note_test`: a key
    that somebody sends names no file to be written), and a condition that no comparison measures are passed over; an
    older result of the same test is replaced.

    Args:
        result: of the test.
        key: digest of its key.
    """
    written = []
    for condition in result.sheet.conditions:
        score = result.scores.get(condition.name)
        places = RunFiles(Path(condition.run or "."))
        if condition.shows != "run" or condition.style == CHANGED or score is None or not places.model.is_file():
            continue
        if files.digest(places.model)[:16] != condition.digest:
            continue
        low, high = (None if np.isnan(v) else v for v in (score.low, score.high))
        own = Seen(result.sheet.id, result.sheet.design["title"], result.unit, len(result.kept), condition.style,
                   score.value, low, high, condition.digest)
        with files.locked(places.viewing):
            kept = _kept(places)
            if key not in kept.made:
                continue
            others = [s for s in kept.tests if s.digest == own.digest and (s.test, s.style) != (own.test, own.style)]
            written.append(files.write_json(places.viewing, asdict(SeenBy((*others, own), kept.made))))
    return sorted(set(written))


def _kept(places: RunFiles) -> SeenBy:
    """What a run keeps of viewers; nothing where there is no file."""
    return read_record(SeenBy, places.viewing, _REMEDY) if places.viewing.is_file() else SeenBy()


def read_scores(folder: Path) -> tuple[Seen, ...]:
    """What viewers gave a run; nothing where nobody saw it, or it has been trained anew since.

    Raises:
        DnnvssError: the file is damaged.
    """
    places = RunFiles(folder)
    if not places.viewing.is_file() or not places.model.is_file():
        return ()
    own = files.digest(places.model)[:16]
    return tuple(s for s in _kept(places).tests if s.digest == own)


def viewers_sections(result: Comparison, folders: Mapping[str, Path], styles: Mapping[str, Sequence[str]]
                     ) -> list[Section]:
    """Viewers' scores of the systems of a comparison beside what was measured, for each test.

    Args:
        result: of the comparison.
        folders: of the runs, by system.
        styles: names of the styles in which each run was measured besides plain.
    """
    tests: dict[str, dict[str, Seen]] = {}
    for name, folder in folders.items():
        for seen in read_scores(folder):
            row = name if seen.style == "plain" else f"{name}, {seen.style}"
            if row in result.pairs and (seen.style == "plain" or seen.style in styles.get(name, ())):
                tests.setdefault(seen.test, {})[row] = seen
    return [Section(table.title, " ".join(table.notes), table.head, table.rows)
            for rows in tests.values() for table in _tables(result, rows)]


def _tables(result: Comparison, rows: Mapping[str, Seen]) -> list[Table]:
    first, measures = next(iter(rows.values())), [m for m in result.measures if m.name in METRICS]
    values = {m.name: {row: result.estimate(row, m.name).value for row in rows} for m in measures}
    cells = [(row, interval(Score(s.score, *(float("nan") if v is None else v for v in (s.low, s.high)))),
              str(s.viewers), *(number(values[m.name][row]) for m in measures)) for row, s in rows.items()]
    head = ("system", "viewers' score", "viewers", *(m.title for m in measures))
    table = Table(f"What viewers saw: {first.title}", head, tuple(cells),
                  (f"Viewers' score: {first.unit}, with the 95 % interval over viewers. Test {first.test}.",))
    ranks = _ranks(result, rows, measures)
    return [table, ranks] if ranks else [table]


def _ranks(result: Comparison, rows: Mapping[str, Seen], measures: Sequence[object]) -> Table | None:
    """Whether what is measured puts the systems in the viewers' order."""
    if len(rows) < FEWEST:
        return None
    scores, cells = [s.score for s in rows.values()], []
    for m in result.measures:
        if m not in measures:
            continue
        good = np.array([_goodness(result, row, m.name, m.better) for row in rows])
        if np.isnan(good).any() or len(set(good)) < 2 or len(set(scores)) < 2:
            continue
        tau = stats.kendalltau(scores, good)
        cells.append((m.title, number(float(stats.spearmanr(scores, good).statistic), 2),
                      number(float(tau.statistic), 2), p_value(float(tau.pvalue)), str(len(rows))))
    if not cells:
        return None
    head = ("measure", "Spearman's rho", "Kendall's tau", "p of tau", "systems")
    return Table("Ranks of viewers and of measures", head,
                 tuple(cells), ("1: the measure, taken as better the nearer it is to its best, puts the systems in the "
                                "viewers' order. Of few systems even a perfect order may be chance: p says.",))


def _goodness(result: Comparison, row: str, metric: str, better: str) -> float:
    """A value that is greater the better, whichever way the metric runs."""
    value = result.estimate(row, metric).value
    if better == "high":
        return value
    if better == "low":
        return -value
    best = {"zero": 0.0, "one": 1.0}.get(better)
    if best is None:
        best = result.estimate("truth", metric).value if "truth" in result.pairs else float("nan")
    return -abs(value - best)
