"""The look of all pages: one palette for light and dark, and the style of those that are read."""

import base64
import hashlib
import html
from collections.abc import Iterable
from importlib import resources

PALETTE = "palette.css"
"""The file of the colours by name, which every page has; the studio serves it beside its own files."""
_NONE = "'none'"


def style(name: str) -> str:
    """The text of a style sheet of this room."""
    return resources.files(__package__).joinpath(name).read_text("utf-8")


def document(title: str, body: str, own: str = "", script: str = "", data: str = "") -> str:
    """A page that opens from disk and needs no other file.

    Args:
        title: as text.
        body: what stands in its ``main``, as HTML.
        own: style that this page adds.
        script: JavaScript behind the body; none but this runs, wherever it may come from.
        data: JSON that the script finds as the text of the element ``data``.
    """
    sheet = style(PALETTE) + style("document.css") + own
    given = data.replace("<", "\\u003c")
    block = f'<script type="application/json" id="data">{given}</script>\n' if data else ""
    code = f"<script>{_inline(script)}</script>\n" if script else ""
    return ('<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            f'<meta http-equiv="Content-Security-Policy" content="{only(script)}">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{html.escape(title)}</title>\n<style>\n{sheet}</style>\n</head>\n"
            f"<body>\n<main>\n{body}\n</main>\n{block}{code}</body>\n</html>\n")


def only(*scripts: str) -> str:
    """The part of a content policy by which no script runs in a document but these, each as it was given to it."""
    hashes = [hashlib.sha256(_inline(script).encode()).digest() for script in scripts if script]
    allowed = [f"'sha256-{base64.b64encode(each).decode()}'" for each in hashes]
    return f"script-src {' '.join(allowed) or _NONE}"


def _inline(script: str) -> str:
    """A script as it stands in a document."""
    return f"\n{script}"


def wide(content: str, label: str, kind: str = "scroll") -> str:
    """What may be wider than the page, so that it scrolls by itself; the keyboard reaches it.

    Args:
        content: as HTML.
        label: what it is, as text.
        kind: its class.
    """
    return f'<div class="{kind}" tabindex="0" role="region" aria-label="{html.escape(label)}">{content}</div>'


def bars(rows: Iterable[tuple[str, str, int]]) -> str:
    """Counts as bars, those of nothing marked: each row a label, what explains it, and its count."""
    rows = list(rows)
    most = max([*(count for _, _, count in rows), 1])
    kinds = ("" if count else ' class="never"' for _, _, count in rows)
    return '<div class="phones">' + "".join(
        f'<div{kind}><b>{html.escape(label)}</b><span>{html.escape(told)}</span>'
        f'<i style="width:{100 * count / most:.0f}%"></i><em>{count}</em></div>'
        for kind, (label, told, count) in zip(kinds, rows, strict=True)) + "</div>"
