"""The result of a test as one page, Markdown and JSON; whatever viewers wrote stands in it as text."""

import html
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.evaluation.cells import interval, number_of
from dnnvss.evaluation.viewing.analysis import Analysis
from dnnvss.evaluation.viewing.tables import Score, Table
from dnnvss.formats.tables import markdown_numbers
from dnnvss.pages import document, wide

SHOWN = 200
"""Rows of a table, and lines of a list, that the page shows; the JSON has all."""
_WIDTH, _LEFT, _ROW = 760, 200, 30
_STYLE = """
ul.warnings { border-left: 3px solid var(--bad); background: var(--wash); padding: 10px 12px 10px 32px; }
svg { min-width: 560px; max-width: 760px; } svg .mark { stroke: var(--accent); fill: var(--accent); }
thead th { white-space: normal; } .note { margin-top: 6px; }
"""


@dataclass(frozen=True)
class Written:
    """The files of a result."""

    page: Path
    text: Path
    data: Path


def write_report(result: Analysis, out: Path) -> Written:
    """Write ``viewing.html``, ``viewing.md`` and ``viewing.json`` into a folder."""
    page = files.write_text(out / "viewing.html", html_page(result))
    text = files.write_text(out / "viewing.md", markdown(result))
    return Written(page, text, files.write_json(out / "viewing.json", to_json(result)))


def lead(result: Analysis) -> str:
    """Who answered, in a sentence."""
    refused, left = len(result.received.refused), len(result.left_out)
    more = [f"{left} left out"] if left else []
    more += [f"{number_of(refused, 'file')} refused"] if refused else []
    count = len(result.kept)
    return (f"{number_of(count, 'viewer')}{' (' + ', '.join(more) + ')' if more else ''}; "
            f"{result.sheet.design['kind']} test {result.sheet.id}, seed {result.sheet.design['seed']}, "
            f"dnnvss {result.sheet.version}.")


def markdown(result: Analysis) -> str:
    """The result as Markdown."""
    parts = [f"# {_line(result.sheet.design['title'])}", lead(result)]
    if result.warnings:
        parts.append("\n".join(f"- **{warning}**" for warning in result.warnings))
    for table in result.tables:
        rows = [[_line(cell) for cell in row] for row in table.rows[:SHOWN]]
        parts += [f"## {table.title}", markdown_numbers(list(table.head), rows), *table.notes, *_more(table.rows)]
    return "\n\n".join(parts) + "\n"


def _line(text: str) -> str:
    """A text that stays in a cell of a table."""
    return " ".join(str(text).split()).replace("|", "\\|").replace("<", "&lt;")


def _more(rows: Sequence[object]) -> list[str]:
    return [f"{len(rows) - SHOWN} more are in viewing.json."] if len(rows) > SHOWN else []


def to_json(result: Analysis) -> dict[str, Any]:
    """The result in plain containers; what was refused and left out is named."""
    return {"test": result.sheet.id, "version": result.sheet.version, "design": dict(result.sheet.design),
            "conditions": [asdict(c) for c in result.sheet.conditions], "unit": result.unit,
            "viewers": list(result.kept), "left_out": dict(result.left_out), "refused": result.received.refused,
            "scores": {name: asdict(score) for name, score in result.scores.items()},
            "warnings": list(result.warnings), "tables": [asdict(table) for table in result.tables],
            "comments": {name: answer.comment for name, answer in result.received.answers.items() if answer.comment}}


def html_page(result: Analysis) -> str:
    """The result as one page without a script; its policy lets none run."""
    title = result.sheet.design["title"]
    warnings = "".join(f"<li>{html.escape(w)}</li>" for w in result.warnings)
    said = f'<ul class="warnings">{warnings}</ul>' if warnings else ""
    body = (f'<h1>{html.escape(title)}</h1><p class="lead">{html.escape(lead(result))}</p>{said}'
            f"<h2>Scores: {html.escape(result.unit)}</h2>{wide(plot(result.scores), 'Scores')}"
            '<p class="note">With the 95&nbsp;% interval over viewers.</p>'
            f'{"".join(map(_table, result.tables))}<h2>Who answered</h2>{_people(result)}')
    return document(title, body, _STYLE)


def _table(table: Table) -> str:
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in table.head)
    rows = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>"
                   for row in table.rows[:SHOWN])
    notes = "".join(f'<p class="note">{html.escape(note)}</p>' for note in (*_more(table.rows), *table.notes))
    own = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
    return f"<h2>{html.escape(table.title)}</h2>{wide(own, table.title)}{notes}"


def _people(result: Analysis) -> str:
    answers = result.received.answers
    asked = [question["text"] for question in result.sheet.design.get("questions", ())]
    said = {name: " / ".join(f"{q}: {a}" for q, a in zip(asked, answers[name].questions, strict=False))
            for name in result.kept}
    device = {name: f"{answers[name].device.width} x {answers[name].device.height}"
              + (", phone" if answers[name].device.phone else "")
              + (f", {answers[name].device.tones} of 6 tones" if answers[name].device.tones is not None else "")
              for name in result.kept}
    counted = {name: "; ".join(filter(None, (device[name], said[name]))) for name in result.kept}
    comments = {name: answers[name].comment for name in answers if answers[name].comment}
    return "".join(_list(title, lines) for title, lines in (
        ("Counted", counted), ("Left out", result.left_out), ("Refused", result.received.refused),
        ("What they noticed", comments)) if lines)


def _list(title: str, lines: Mapping[str, str]) -> str:
    items = "".join(f"<li>{html.escape(name)}: {html.escape(text)}</li>" for name, text in list(lines.items())[:SHOWN])
    more = "".join(f"<p class=note>{html.escape(text)}</p>" for text in _more(list(lines)))
    return f"<details><summary>{html.escape(title)} ({len(lines)})</summary><ul>{items}</ul>{more}</details>"


def _ticks(low: float, high: float) -> np.ndarray:
    """Round numbers between two ends."""
    rough = (high - low) / 5
    size = 10.0 ** np.floor(np.log10(rough))
    step = size * next(k for k in (1, 2, 5, 10) if k * size >= rough)
    return np.arange(np.ceil(low / step), np.floor(high / step) + 1) * step


def plot(scores: Mapping[str, Score]) -> str:
    """A dot and a line for each score with its interval, as SVG."""
    ends = [v for s in scores.values() for v in (s.value, s.low, s.high) if not np.isnan(v)]
    low, high = min(ends, default=0.0), max(ends, default=1.0)
    pad = 0.08 * (high - low) if high - low > 1e-6 else 0.5
    low, high = low - pad, high + pad

    def x(value: float) -> float:
        return _LEFT + (_WIDTH - _LEFT - 20) * (value - low) / (high - low)

    height = _ROW * len(scores) + 30
    ticks = _ticks(low, high)
    parts = [f'<line class="axis" x1="{x(t):.1f}" x2="{x(t):.1f}" y1="0" y2="{height - 22}"/>'
             f'<text class="soft" x="{x(t):.1f}" y="{height - 6}" text-anchor="middle">{t:.3g}</text>' for t in ticks]
    for k, (name, score) in enumerate(scores.items()):
        y = _ROW * k + _ROW / 2
        parts.append(f'<text x="0" y="{y + 4:.1f}">{html.escape(name[:26])}</text>'
                     f'<circle class="mark" cx="{x(score.value):.1f}" cy="{y:.1f}" r="4">'
                     f"<title>{html.escape(interval(score))}</title></circle>")
        if not np.isnan(score.low):
            parts.append(f'<line class="mark" x1="{x(score.low):.1f}" x2="{x(score.high):.1f}" y1="{y:.1f}" '
                         f'y2="{y:.1f}" stroke-width="2"/>')
    return f'<svg viewBox="0 0 {_WIDTH} {height}" role="img" aria-label="scores">{"".join(parts)}</svg>'
