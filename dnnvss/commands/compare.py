"""``dnnvss compare RUN [RUN ...]``: all metrics of finished runs in one table, with anchors and tests."""

from collections.abc import Sequence
from pathlib import Path

from dnnvss.commands.flags import Flags, whole
from dnnvss.commands.usage import DONE


def main(arguments: Sequence[str]) -> int:
    """Print the tables and write them as Markdown, JSON and HTML."""
    parser = Flags(prog="dnnvss compare", description=__doc__)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder of a finished run")
    parser.add_argument("--out", type=Path, help="where to write; the first run's folder `evaluation` unless given")
    parser.add_argument("--first", type=whole(1), default=5, help="leading coefficients in averages (5)")
    parser.add_argument("--seed", type=whole(0), default=0, help="of anchors, bootstrap and permutation tests (0)")
    options = parser.read(arguments)
    from dnnvss.evaluation.finished import compare_runs

    made = compare_runs(options.runs, options.out, first=options.first, seed=options.seed)
    print(f"{made.table}\n\nwrote {made.page.parent}/evaluation.md, evaluation.json, and {made.page}: "
          "open it in a browser")
    return DONE
