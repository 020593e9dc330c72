"""``dnnvss figure RUN [RUN ...]``: coefficients of a test sentence, measured and predicted.

With a run of ``labels=ph_b`` and one of ``labels=ph_c`` this is Figure 1 of Thangthai et al. 2016: without and with the
phonetic window. With a run of ``model=cca aam=th07`` and ``--coefficient shape01 texture01`` it is Figure 6 of Theobald
and Wilkinson 2007.
"""

from collections.abc import Sequence
from pathlib import Path

from dnnvss.commands.flags import Flags
from dnnvss.commands.usage import DONE


def main(arguments: Sequence[str]) -> int:
    """Write the plot."""
    parser = Flags(prog="dnnvss figure", description=__doc__)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder of a finished run")
    parser.add_argument("--coefficient", nargs="+", default=["5"],
                        help="each by its name or its number, counted from 1 (5)")
    parser.add_argument("--utterance", help="a test sentence; the first one unless given")
    parser.add_argument("--out", type=Path, default=Path("figure1.png"), help="the picture (figure1.png)")
    options = parser.read(arguments)
    from dnnvss.evaluation.figure import draw

    print(f"wrote {draw(options.runs, options.out, options.coefficient, options.utterance)}")
    return DONE
