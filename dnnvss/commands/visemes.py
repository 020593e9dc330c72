"""``dnnvss visemes data/demo --units 40 80 160``: measurements of gestures and dynamic visemes.

Prints what cutting and clustering do with a corpus that was encoded (by ``dnnvss train``), and, where the corpus knows
its true gestures, how well they are found again.
"""

from collections.abc import Sequence
from pathlib import Path

from dnnvss.commands.conf import conf_folder, read_choice
from dnnvss.commands.flags import Flags, given_as, whole
from dnnvss.commands.usage import DONE
from dnnvss.timing import FrameClock


def main(arguments: Sequence[str]) -> int:
    """Print the measurements of a corpus."""
    parser = Flags(prog="dnnvss visemes", description=__doc__)
    parser.add_argument("corpus", type=Path, metavar="CORPUS", help="folder of a prepared and encoded corpus")
    parser.add_argument("--visemes", type=Path, default=conf_folder() / "visemes" / "default.yaml",
                        help="file of settings (conf/visemes/default.yaml)")
    parser.add_argument("--units", type=whole(2), nargs="+", default=[40, 80, 160],
                        help="numbers of units to compare (40 80 160)")
    parser.add_argument("--rate", type=given_as(FrameClock), default=FrameClock(100), help="frames a second (100)")
    options = parser.read(arguments)
    from dnnvss.visemes.corpus import viseme_settings
    from dnnvss.visemes.report import corpus_report

    settings = viseme_settings(read_choice(options.visemes))
    print(corpus_report(options.corpus, options.rate, settings, options.units), end="")
    return DONE
