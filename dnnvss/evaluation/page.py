"""The report as one HTML file that opens from disk: tables, plots, and faces that move side by side."""

import html
import os
from collections.abc import Iterator, Mapping, Sequence
from importlib import resources
from itertools import cycle
from pathlib import Path
from string import Template
from typing import Any

import numpy as np

from dnnvss import files
from dnnvss.curves import resample
from dnnvss.evaluation.bench import POINTS, Bench, Measure, Sentence, in_unit
from dnnvss.evaluation.cells import number, number_of, p_value
from dnnvss.evaluation.comparison import BETTER, CLASS_METRICS, CLASSES, Comparison, Predictions, left_out
from dnnvss.evaluation.sections import Section
from dnnvss.evaluation.statistics import Estimate, pooled
from dnnvss.face.base import APERTURE, Face
from dnnvss.pages import document, wide
from dnnvss.timing import FrameClock

_COLOURS = ("#2563a8", "#c2410c", "#15803d", "#7c3aed", "#b45309", "#be185d")
_DASHES = ("", "7 3", "2 3", "9 3 2 3")
"""One after the other of them where there are more systems than colours."""
_TRUTH = "var(--truth)"
_SHOWN_RATE = 25
HEAD = ("correlation", "rmse", "gv_ratio", "closure_recall", "landmarks", "lag")
"""Metrics of the first table; all others are folded."""
_WIDTH, _HEIGHT, _LEFT = 1000, 170, 40
_NAMED = 4
"""Systems that the title of a page names; more are counted."""


def write_page(
    path: str | Path, result: Comparison, bench: Bench, systems: Mapping[str, Predictions],
    folders: Mapping[str, Path] | None = None, sections: Sequence[Section] = (),
) -> Path:
    """Write the report and return its path; it needs no network and no other file but the videos that it points to.

    Args:
        path: the ``.html`` file.
        result: from :func:`dnnvss.evaluation.comparison.compare`.
        bench: what was compared on.
        systems: the predictions under test.
        folders: system to run folder; a video ``videos/<sentence>.mp4`` in it is shown above the faces.
        sections: further tables.
    """
    chosen = _chosen(result, bench)
    shown = list(chosen)[len(chosen) // 2]
    moving = [_moving(s, bench, systems) for s in chosen.values()]
    names = list(result.systems)
    title = f"Evaluation: {', '.join(names)}" if len(names) <= _NAMED else f"Evaluation: {len(names)} systems"
    body = Template(_own("page.html")).substitute(
        title=html.escape(title),
        lead=html.escape(" ".join([f"{number_of(len(result.sentences), 'test sentence')}; averages over the first "
                                   f"{result.first} coefficients.", *result.rivals, *result.same, *result.few])),
        head=wide(_values(result, [m for m in result.measures if m.name in HEAD]), "The main metrics"),
        values=wide(_values(result, result.measures), "All metrics"),
        cards="".join(_card(result, m) for m in result.measures),
        tests=_tests(result),
        sections="".join(section.html() for section in sections),
        sentences="".join(_folded(title, _sentence(s, bench, systems, Path(path), folders or {}), title == shown)
                          for title, s in chosen.items()),
        classes=_classes(result),
        definitions="".join(f"<dt>{html.escape(m.title)}</dt><dd>{html.escape(m.definition)} ({BETTER[m.better]})</dd>"
                            for m in result.measures),
    )
    data = files.json_text(moving, separators=(",", ":"))
    return files.write_text(path, document(title, body, _own("page.css"), script(), data))


def script() -> str:
    """The JavaScript of every report; what it draws stands in the page."""
    return _own("page.js")


def _own(name: str) -> str:
    return resources.files("dnnvss.evaluation").joinpath(name).read_text("utf-8")


def _chosen(result: Comparison, bench: Bench) -> dict[str, Sentence]:
    """Return the worst, the middle and the best sentence of the first system by correlation, each by what it is."""
    pairs = result.pairs[result.systems[0]]["correlation"]
    order = [int(i) for i in np.argsort(pairs[:, 0]) if pairs[i, 1] > 0] or [0]
    picks = {"The worst sentence": order[0], "The middle one": order[len(order) // 2], "The best one": order[-1]}
    once = {i: title for title, i in reversed(picks.items())}
    return {title: bench.sentences[i] for title, i in picks.items() if once[i] == title}


def _folded(title: str, content: str, opened: bool) -> str:
    """Return a part of the page under its title, folded unless it is to be seen at once."""
    return f"<details{' open' if opened else ''}><summary>{html.escape(title)}</summary>{content}</details>"


def _table(head: list[str], rows: list[tuple[str, list[str]]]) -> str:
    """Return a table; each row has a class and cells that are HTML already."""
    top = "".join(f"<th>{html.escape(h)}</th>" for h in head)
    body = "".join(f'<tr class="{kind}">' + "".join(f"<td>{c}</td>" for c in cells) + "</tr>" for kind, cells in rows)
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def _kind(result: Comparison, system: str) -> str:
    return "system" if system in result.systems else "anchor"


def _values(result: Comparison, measures: Sequence[Measure]) -> str:
    """Return the values of some metrics, those left out that no system could be measured by."""
    shown = [m for m in measures if any(not np.isnan(result.estimate(s, m.name).value) for s in result.systems)]
    rows = []
    for system in result.pairs:
        cells = [html.escape(name) for name in result.named(system)]
        for m in shown:
            e = result.estimate(system, m.name)
            around = "" if np.isnan(e.low) else f"<small>{number(e.low)} to {number(e.high)}</small>"
            cells.append(number(e.value) + around)
        rows.append((_kind(result, system), cells))
    return _table([*result.head, *[m.title for m in shown]], rows)


def _card(result: Comparison, m: Measure) -> str:
    """Return one metric as a row of dots with their intervals."""
    estimates = {s: result.estimate(s, m.name) for s in result.pairs}
    known = {s: Estimate(e.value, float(np.fmin(e.low, e.value)), float(np.fmax(e.high, e.value)))
             for s, e in estimates.items() if not np.isnan(e.value)}
    if not known:
        return ""
    low = min(e.low for e in known.values())
    high = max(e.high for e in known.values())
    span = high - low or abs(high) or 1.0
    low, high = low - 0.04 * span, high + 0.04 * span

    def x(value: float) -> float:
        return 130 + 180 * (value - low) / (high - low)

    rows = []
    for row, (system, e) in enumerate(known.items()):
        y = 16 + 20 * row
        colour = _colour(result, system)
        label = html.escape(system if len(system) < 22 else system[:9] + "…" + system[-10:])
        label += f" [{result.inputs[system]}]" if result.rivals and system in result.inputs else ""
        rows.append(
            f'<text x="0" y="{y + 4}"{"" if system in result.systems else " class=soft"}>{label}</text>'
            f'<line x1="{x(e.low):.1f}" x2="{x(e.high):.1f}" y1="{y}" y2="{y}" stroke="{colour}" opacity=".45"'
            ' stroke-width="2"/>'
            f'<circle cx="{x(e.value):.1f}" cy="{y}" r="4" fill="{colour}"/>'
            f'<text x="360" y="{y + 4}" text-anchor="end">{number(e.value)}</text>')
    height = 20 * len(known) + 12
    title = html.escape(m.title)
    return (f'<div class="card"><h3>{title}</h3><p>{BETTER[m.better]}</p>'
            f'<svg viewBox="0 0 364 {height}" role="img" aria-label="{title}">{"".join(rows)}</svg></div>')


def _colour(result: Comparison, system: str) -> str:
    return _COLOURS[result.systems.index(system) % len(_COLOURS)] if system in result.systems else _TRUTH


def _tests(result: Comparison) -> str:
    if len(result.systems) < 2:
        return ""
    kept, without = result.telling()
    rows = []
    for title, names, d, p in kept:
        span = number(d.low) if np.isnan(d.low) else f"{number(d.low)} to {number(d.high)}"
        cells = [html.escape(title), html.escape(names), number(d.value), span, html.escape(p_value(d.p)), p_value(p)]
        rows.append(("system", cells))
    head = ["metric", "systems", "difference", "95 % interval", "p (permutation)", "p (Holm)"]
    table = wide(_table(head, rows), "Paired differences") if rows else ""
    said = (*result.few, *result.tested, *left_out(0 if result.few else without))
    note = "".join(f'<p class="note">{text}</p>' for text in said)
    return f"<details><summary>Paired differences</summary>{table}{note}</details>"


def _classes(result: Comparison) -> str:
    parts = []
    for name, title in CLASS_METRICS.items():
        rows = []
        for system, by in result.classes.items():
            if any(name in metrics for metrics in by.values()):
                values = [number(pooled(by[c][name])) if c in by else number(float("nan")) for c in CLASSES]
                rows.append((_kind(result, system), [html.escape(system), *values]))
        if rows:
            table = wide(_table([in_unit(title, result.unit), *CLASSES], rows), f"{title} by phone class")
            parts.append(f'<div style="margin-bottom:16px">{table}</div>')
    return "".join(parts)


def _sentence(
    s: Sentence, bench: Bench, systems: Mapping[str, Predictions], page: Path, folders: Mapping[str, Path]
) -> str:
    faces = [("truth", None), *[(name, folders.get(name)) for name in systems]]
    figures, videos = "", ""
    if POINTS in bench.known:
        figures += "".join('<figure><canvas width="600" height="420"></canvas>'
                           f"<figcaption>{html.escape(name)}</figcaption></figure>" for name, _ in faces)
    for name, folder in faces:
        for video in ([folder / "videos" / f"{s.id}.mp4"] if folder else []):
            if video.is_file():
                source = html.escape(Path(os.path.relpath(video, page.parent)).as_posix())
                videos += (f'<figure class="wide"><video src="{source}" preload="auto" playsinline></video>'
                           f"<figcaption>{html.escape(name)}</figcaption></figure>")
    series = {"truth": s.reference, **{name: predicted[s.id] for name, predicted in systems.items()}}
    keys = "".join(f'<span class="key"><svg width="22" height="8" aria-hidden="true"><line x2="22" y1="4" y2="4" '
                   f'{stroke}/></svg> {html.escape(n)}</span>' for n, stroke in zip(series, _strokes(), strict=False))
    plots = _plot({n: x[:, 0] / bench.scale[0] for n, x in series.items()}, s, bench.clock, "coefficient 1 (sd)")
    if APERTURE in bench.known:
        gauge = bench.gauge(APERTURE)
        plots += _plot({n: gauge(x) for n, x in series.items()}, s, bench.clock, f"aperture ({gauge.unit})",
                       bench.closed)
    controls = ('<div class="controls"><button type="button">Play</button>'
                '<input type="range" min="0" max="1000" value="0" aria-label="time"><output></output></div>')
    return (f'<section class="sentence"><h3>{html.escape(s.id)}</h3><div class="faces">{videos}</div>'
            f'<div class="faces">{figures}</div>{controls}'
            f"<div>{keys}</div>{plots}</section>")


def _strokes() -> Iterator[str]:
    """How the lines of a plot are drawn: the truth, and any number of systems, by colours and dashes."""
    yield f'stroke="{_TRUTH}" stroke-width="1.6"'
    for dash in cycle(_DASHES):
        for colour in _COLOURS:
            yield f'stroke="{colour}" stroke-width="1.6"' + (f' stroke-dasharray="{dash}"' if dash else "")


def _plot(
    series: Mapping[str, np.ndarray], s: Sentence, clock: FrameClock, title: str, level: float | None = None
) -> str:
    """Return tracks over time with phone boundaries and labels."""
    values = np.concatenate(list(series.values()))
    low, high = float(values.min()), float(values.max())
    pad = 0.06 * (high - low or 1.0)
    length = len(s.reference) / float(clock.rate)

    def x(t: float) -> float:
        return _LEFT + (_WIDTH - _LEFT - 8) * t / length

    def y(v: float) -> float:
        return _HEIGHT - 8 - (_HEIGHT - 34) * (v - low + pad) / (high - low + 2 * pad)

    parts = [f'<text x="0" y="11" class="soft">{html.escape(title)}</text>']
    for segment in s.tier:
        a, b = segment.start - s.tier.start, segment.end - s.tier.start
        parts.append(f'<line class="axis" x1="{x(a):.1f}" x2="{x(a):.1f}" y1="18" y2="{_HEIGHT}"/>'
                     f'<text class="soft" x="{x((a + b) / 2):.1f}" y="24" text-anchor="middle" font-size="9">'
                     f"{html.escape(segment.label)}</text>")
    for v in (low, high):
        parts.append(f'<text class="soft" x="{_LEFT - 6}" y="{y(v) + 4:.1f}" text-anchor="end">{v:.1f}</text>')
    if level is not None and not np.isnan(level):
        parts.append(f'<line x1="{_LEFT}" x2="{_WIDTH - 8}" y1="{y(level):.1f}" y2="{y(level):.1f}" stroke="#d92d20" '
                     'stroke-dasharray="4 4" opacity=".6"><title>closed at or below this</title></line>')
    for stroke, track in zip(_strokes(), series.values(), strict=False):
        at = zip(clock.centres(len(track)), track, strict=True)
        points = " ".join(f"{x(t):.1f},{y(float(v)):.1f}" for t, v in at)
        parts.append(f'<polyline points="{points}" fill="none" {stroke}/>')
    parts.append(f'<line class="cursor" x1="{_LEFT}" x2="{_LEFT}" y1="18" y2="{_HEIGHT}" stroke="currentColor"/>')
    return f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{html.escape(title)}">{"".join(parts)}</svg>'


def _moving(s: Sentence, bench: Bench, systems: Mapping[str, Predictions]) -> dict[str, Any]:
    """Return the faces of a sentence as numbers for the page's script, tenths of a pixel at 25 frames a second."""
    shown = FrameClock(_SHOWN_RATE)
    frames = max(1, round(len(s.reference) * _SHOWN_RATE / float(bench.clock.rate)))
    data: dict[str, Any] = {"rate": _SHOWN_RATE, "frames": frames, "left": _LEFT, "right": _WIDTH - 8, "faces": [],
                            "contours": [], "box": [0, 0, 1, 1]}
    if bench.face is None or POINTS not in bench.known:
        return data
    tracks = [s.reference, *[predicted[s.id] for predicted in systems.values()]]
    faces = [bench.face.points(resample(np.asarray(x, float), bench.clock, shown, count=frames))[..., :2]
             for x in tracks]
    low, high = (np.array([bound([f.reshape(-1, 2) for f in faces][k], axis=0) for k in range(len(faces))])
                 for bound in (np.min, np.max))
    low, high = low.min(axis=0), high.max(axis=0)
    centre, half = (low + high) / 2, 0.55 * max(high[0] - low[0], (high[1] - low[1]) * 600 / 420)
    box = [centre[0] - half, centre[1] - half * 0.7, centre[0] + half, centre[1] + half * 0.7]
    data["box"] = [round(float(v), 1) for v in box]
    data["faces"] = [[[round(float(v), 1) for v in frame.ravel()] for frame in f] for f in faces]
    data["contours"] = _contours(bench.face, faces[0].shape[1])
    return data


def _contours(face: Face, count: int) -> list[dict[str, Any]]:
    """Return the lines to draw: the face's own contours where it has any, lips filled."""
    lines = []
    for name, points in (face.contours or {"points": range(count)}).items():
        inner, lips = "inner" in name, "lips" in name
        fill = "#3a1420" if inner else "#d98880" if lips else ""
        lines.append({"rows": list(points), "closed": lips, "fill": fill})
    return lines
