"""What became of every utterance: kept, repaired or dropped, and why."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from dnnvss import files
from dnnvss.formats.tables import markdown_table

STATES = ("kept", "repaired", "dropped")


@dataclass
class Outcome:
    """What became of one utterance, and the reasons; notes do not change it.

    Args:
        id: the utterance.
        notes: what is worth knowing of an utterance that is kept.
        reasons: why it was repaired or dropped.
        status: ``kept``, ``repaired`` (some frames are marked as not valid) or ``dropped``.
    """

    id: str
    notes: list[str] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    status: str = "kept"

    def repair(self, reason: str) -> None:
        """Say that part of the utterance was mended or marked as not usable."""
        self.reasons.append(reason)
        self.status = "repaired" if self.status == "kept" else self.status

    def drop(self, reason: str) -> None:
        """Say why the utterance cannot be used."""
        self.reasons.append(reason)
        self.status = "dropped"


def counts(outcomes: Iterable[Outcome]) -> dict[str, int]:
    """Return how many utterances were kept, repaired and dropped."""
    found = Counter(o.status for o in outcomes)
    return {state: found[state] for state in STATES}


def write_report(out: Path, outcomes: Iterable[Outcome], found: Iterable[str] = (),
                 left_out: Sequence[tuple[str, float, float, str]] = ()) -> Path:
    """Write ``report.jsonl`` (a line per utterance) and ``report.md`` (what is not plain), and return the latter.

    Args:
        out: the prepared corpus.
        outcomes: of all utterances.
        found: what holds for the whole corpus, a sentence each.
        left_out: parts of long recordings that are not used: recording, start and end in seconds, why.
    """
    rows = sorted(outcomes, key=lambda o: o.id)
    files.write_text(out / "report.jsonl", "".join(files.json_text(_readable(asdict(o))) + "\n" for o in rows))
    parts = ["# Report of the preparation", markdown_table(["state", "utterances"], counts(rows).items())]
    parts += ["\n".join(f"- {line}" for line in found)] if found else []
    for state in ("dropped", "repaired"):
        chosen = [o for o in rows if o.status == state]
        if chosen:
            told = [(_cell([o.id]), _cell([*o.reasons, *o.notes])) for o in chosen]
            parts += [f"## {state.capitalize()}", markdown_table(["utterance", "reason"], told)]
    noted = [o for o in rows if o.status == "kept" and o.notes]
    if noted:
        told = [(_cell([o.id]), _cell(o.notes)) for o in noted]
        parts += ["## Kept, with a note", markdown_table(["utterance", "note"], told)]
    if left_out:
        lines = [(files.printable(name), _time(a), _time(b), _cell([why])) for name, a, b, why in left_out]
        parts += ["## Not used of long recordings", markdown_table(["recording", "from", "to", "why"], lines)]
    return files.write_text(out / "report.md", "\n\n".join(parts) + "\n")


def _time(seconds: float) -> str:
    """Hours, minutes and seconds, as players show them."""
    minutes, rest = divmod(round(seconds, 1), 60)
    return f"{int(minutes) // 60}:{int(minutes) % 60:02d}:{rest:04.1f}"


def _readable(row: dict[str, Any]) -> dict[str, Any]:
    """A row whose texts can be written, whatever the names of files in them."""
    return {key: files.printable(v) if isinstance(v, str) else [files.printable(text) for text in v]
            for key, v in row.items()}


def _cell(texts: list[str]) -> str:
    return "; ".join(texts).replace("|", "\\|").replace("\n", " ")
