"""Lines of an HTK label file that are states of one phone, made one line."""

import re
from itertools import groupby

Rows = list[tuple[int, str, list[str]]]
"""Number of a line, the line, and its fields: start, end, label, and what follows."""

_STATE = re.compile(r"(.+?)(?:\[(\d{1,2})\]|[_.]s(\d{1,2}))", re.ASCII)
_BARE = re.compile(r"s(\d{1,2})", re.ASCII)
_FEWEST, _RUNS = 3, 3
"""Equal lines of every phone, and phones, from which such lines are taken for states."""


def whole_phones(rows: Rows) -> Rows:
    """The rows of phones: those of states are joined, each with what follows the label of its first state."""
    bare = [_BARE.fullmatch(fields[2]) if len(fields) > 2 else None for *_, fields in rows]
    if rows and all(bare):
        return _named(rows, [int(match[1]) for match in bare if match])
    marked = [_STATE.fullmatch(fields[2]) if len(fields) > 2 else None for *_, fields in rows]
    if any(marked):
        return _marked(rows, marked)
    return _repeated(rows)


def _named(rows: Rows, states: list[int]) -> Rows:
    """Rows of states ``s2``, ``s3``, ...: the phone stands behind the first of them, and behind its score."""
    found: Rows = []
    before: int | None = None
    for (place, line, fields), state in zip(rows, states, strict=True):
        names = [f for f in fields[3:] if not re.fullmatch(r"-?\d+(\.\d*)?(e[-+]?\d+)?", f)]
        if before is not None and state > before and not names:
            found[-1][2][1] = fields[1]
        else:
            found.append((place, line, [*fields[:2], *(names or fields[2:3])]))
        before = state
    return found


def _marked(rows: Rows, marked: list[re.Match[str] | None]) -> Rows:
    """Rows whose labels end in the number of a state."""
    found: Rows = []
    before: tuple[str, int] | None = None
    for (place, line, fields), match in zip(rows, marked, strict=True):
        state = (match[1], int(match[2] or match[3])) if match else None
        if state is not None and before is not None and state[0] == before[0] and state[1] > before[1]:
            found[-1][2][1] = fields[1]
        else:
            found.append((place, line, [*fields[:2], state[0] if state else fields[2], *fields[3:]]
                          if len(fields) > 2 else fields))
        before = state
    return found


def _repeated(rows: Rows) -> Rows:
    """Rows whose labels come as often for every phone, several times: they are its states without numbers."""
    runs = [list(run) for _, run in groupby(rows, lambda row: row[2][2:3])]
    sizes = {len(run) for run in runs}
    count = min(sizes, default=0)
    if count < _FEWEST or len(runs) < _RUNS or any(size % count for size in sizes):
        return rows
    parts = [run[k : k + count] for run in runs for k in range(0, len(run), count)]
    return [(first[0], first[1], [first[2][0], *last[2][1:2], *first[2][2:]]) for first, *_, last in parts]
