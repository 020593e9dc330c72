"""``dnnvss face-figures FOLDER``: what a face model has learnt, and how well it sees its talker.

FOLDER is a run, or an encoding of a corpus (``data/NAME/face/KEY``). Writes into FOLDER/face, or where --out says:

- ``modes.png``: the first modes at -2, 0 and +2 standard deviations (Theobald et al. 2007, Figures 1 and 2);
- ``reconstruction.png``: frames of an utterance as recorded, as the model draws them, and the difference;
- ``residual.png``: what the model leaves out of each frame, over time, with the phones;
- ``tracked.mp4``: the utterance with the mesh drawn on it.

Of a face without texture there are no ``reconstruction.png`` and ``tracked.mp4``.
"""

from collections.abc import Sequence
from pathlib import Path

from dnnvss.commands.flags import Flags, whole
from dnnvss.commands.usage import DONE


def main(arguments: Sequence[str]) -> int:
    """Write the figures."""
    parser = Flags(prog="dnnvss face-figures", description=__doc__)
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="a run, or an encoding of a corpus")
    parser.add_argument("--corpus", type=Path, help="the prepared corpus, where it has moved")
    parser.add_argument("--utterance", help="whose frames are shown; the first of the validation split unless given")
    parser.add_argument("--modes", type=whole(1), default=6, help="how many modes (6)")
    parser.add_argument("--out", type=Path, help="where to write; FOLDER/face unless given")
    options = parser.read(arguments)
    from dnnvss.evaluation.face_figures import write_face_figures

    written = write_face_figures(options.folder, options.out or options.folder / "face", options.corpus,
                                 options.utterance, options.modes)
    print("wrote " + ", ".join(map(str, written)))
    return DONE
