"""Further tables of a comparison, which other programs have filled: shown in the page and in the Markdown."""

import html
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from dnnvss.evaluation.outside.judged import OF_A_RUN, Judged
from dnnvss.evaluation.outside.scores import MEASURES
from dnnvss.formats.tables import markdown_numbers
from dnnvss.pages import wide


@dataclass(frozen=True)
class Section:
    """A table with a title and a paragraph.

    Args:
        title: of the section.
        note: what its numbers are.
        head: titles of the columns, the first that of the rows' names.
        rows: cells as text.
    """

    title: str
    note: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    def markdown(self) -> str:
        """The section in Markdown."""
        return f"### {self.title}\n\n{self.note}\n\n{markdown_numbers(self.head, self.rows)}\n"

    def html(self) -> str:
        """The section as part of a page."""
        top = "".join(f"<th>{html.escape(cell)}</th>" for cell in self.head)
        body = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>"
                       for row in self.rows)
        table = f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
        return (f'<details><summary>{html.escape(self.title)}</summary><p class="note">{html.escape(self.note)}</p>'
                f"{wide(table, self.title)}</details>")


def seen_from_outside(folders: Mapping[str, Path]) -> Section | None:
    """What a tracker of its own saw of some runs; None where no run was judged so.

    Args:
        folders: name of a run to its folder.
    """
    judged = {name: own for name, folder in folders.items() if (own := Judged.load(folder)) is not None}
    if not judged:
        return None
    first = next(iter(judged.values()))
    rows = [(f"{name}, {row}", *own.rows(row)) for name, own in judged.items() for row in OF_A_RUN]
    rows += [(row, *first.rows(row)) for row in first.pairs if row not in OF_A_RUN]
    missing = [name for name in folders if name not in judged]
    note = (f"One tracker over the talker's video and over that of each run, {len(first.sentences)} test sentences, "
            f"in the style {' or '.join(dict.fromkeys(own.style for own in judged.values()))}; in brackets the 95 % "
            "interval over sentences. Text alone has the run's own times, laid over the recording word by word. In the "
            "recording means: drawn into it, so that the head moves as the talker's does.")
    others = [name for name, own in judged.items() if own.sentences != first.sentences]
    note += f" Other sentences: {', '.join(others)}." if others else ""
    note += f" Not judged yet (dnnvss outside RUN): {', '.join(missing)}." if missing else ""
    return Section("Judged from outside", note, ("", *MEASURES), tuple(rows))
