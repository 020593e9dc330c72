"""Further tables of a comparison, which other programs have filled: shown in the page and in the Markdown."""

import html
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from dnnvss.errors import DnnvssError
from dnnvss.evaluation.cells import number_of
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
    judged, stale = dict[str, Judged](), list[str]()
    for name, folder in folders.items():
        try:
            own = Judged.load(folder)
        except DnnvssError:  # told below: what another command kept is no reason to compare nothing
            stale.append(name)
            continue
        if own is not None:
            judged[name] = own
    if not judged and not stale:
        return None
    rows = [(f"{name}, {row}", *own.rows(row)) for name, own in judged.items() for row in OF_A_RUN]
    if first := next(iter(judged.values()), None):
        rows += [(row, *first.rows(row)) for row in first.pairs if row not in OF_A_RUN]
    missing = [name for name in folders if name not in (*judged, *stale)]
    told = {"Not judged yet (dnnvss outside RUN)": missing,
            "To be judged again (dnnvss outside RUN), as what is kept is damaged or of another version": stale}
    notes = [*_watched(judged), *(f"{what}: {', '.join(names)}." for what, names in told.items() if names)]
    return Section("Judged from outside", " ".join(notes), ("", *MEASURES), tuple(rows))


def _watched(judged: Mapping[str, Judged]) -> list[str]:
    """What was watched, and which runs were judged by other sentences; nothing where none was judged."""
    if (first := next(iter(judged.values()), None)) is None:
        return []
    styles = " or ".join(dict.fromkeys(own.style for own in judged.values()))
    others = [name for name, own in judged.items() if own.sentences != first.sentences]
    return [f"One tracker over the talker's video and over that of each run, "
            f"{number_of(len(first.sentences), 'test sentence')}, in the style {styles}; in brackets the 95 % interval "
            "over sentences. Text alone has the run's own times, laid over the recording word by word. In the "
            "recording means: drawn into it, so that the head moves as the talker's does.",
            *([f"Other sentences: {', '.join(others)}."] if others else [])]
