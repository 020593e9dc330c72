"""``dnnvss units RUN``: what the dynamic visemes of a run look like.

Writes ``units.png``, a strip of pictures of each unit's mean gesture, and ``units.mp4``, in which all of a page move at
once, at half speed and again and again.
"""

from collections.abc import Sequence
from pathlib import Path

from dnnvss.commands.flags import Flags
from dnnvss.commands.usage import DONE


def main(arguments: Sequence[str]) -> int:
    """Write the picture book."""
    parser = Flags(prog="dnnvss units", description=__doc__)
    parser.add_argument("run", type=Path, metavar="RUN", help="folder of a run with dynamic visemes")
    parser.add_argument("--out", type=Path, help="where to write; the run's folder `units` unless given")
    options = parser.read(arguments)
    from dnnvss.evaluation.picture_book import draw_book
    from dnnvss.runs.run import Run

    print("wrote " + ", ".join(map(str, draw_book(Run.open(options.run), options.out or options.run / "units"))))
    return DONE
