"""``dnnvss unseen RUN [RUN ...]``: how well systems say words that they never heard.

A run's system is fitted anew several times with the run's own settings, each time without some words drawn by chance,
among them all words of one phone. What it then says inside these words, inside the phones that it never heard, and in
the rest of the same sentences is told as the mean over the splits with its interval. The test split is not looked at.
``unseen.md`` and ``unseen.json`` lie in the run's folder ``evaluation`` afterwards; a command that is killed goes on.
"""

from collections.abc import Sequence
from pathlib import Path

from dnnvss import files
from dnnvss.commands.flags import Flags, whole
from dnnvss.commands.usage import DONE
from dnnvss.runs.files import RunFiles
from dnnvss.runs.settings import RunSettings


def main(arguments: Sequence[str]) -> int:
    """Print the tables and write them as Markdown and JSON."""
    parser = Flags(prog="dnnvss unseen", description=__doc__)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder of a finished run")
    parser.add_argument("--splits", type=whole(1), default=4, help="random splits (4)")
    parser.add_argument("--seed", type=whole(0), default=0, help="of the draw of words (0)")
    options = parser.read(arguments)
    from dnnvss.evaluation.unseen import leave_words_out

    for run in options.runs:  # the last of them too, before the first is fitted anew
        RunSettings.load(run)
        files.check_writable([RunFiles(run).unheard])
    for run in options.runs:
        found = leave_words_out(run, options.splits, options.seed)
        print(f"{run}: {options.splits} splits\n{found.table()}\nwrote {found.save(run)}")
    return DONE
