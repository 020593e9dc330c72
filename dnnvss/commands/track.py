"""``dnnvss track LABELS VIDEOS``: the points of every frame, from about thirty labelled ones.

LABELS is the folder that ``dnnvss label`` made, with every label finished; VIDEOS is a folder of videos, or one.
Beside each ``ID.mp4`` is written ``ID.npz`` with ``points`` (F, P, 2), ``valid`` (F,), ``error`` (F,) and ``flag``
(F,), and ``landmarks.json`` with the groups: what ``dnnvss prepare corpus=folder`` reads. ``tracking/`` holds the
search models and the report. A second call tracks only what is new: videos that were added or replaced. With
``--own N`` the second model is kept as long as the labels, the settings and N stay as they are; delete
``tracking/search_own.npz`` to have it learnt anew.
"""

import shlex
from collections.abc import Sequence
from pathlib import Path

from dnnvss.commands.flags import Flags, whole
from dnnvss.commands.usage import DONE


def main(arguments: Sequence[str]) -> int:
    """Track the videos and print the report."""
    parser = Flags(prog="dnnvss track", description=__doc__)
    parser.add_argument("labels", type=Path, metavar="LABELS", help="folder of finished labels")
    parser.add_argument("videos", type=Path, metavar="VIDEOS", help="folder of videos, or one video")
    parser.add_argument("--out", type=Path, help="where to write; beside the videos unless given")
    parser.add_argument("--own", type=whole(0), default=0, metavar="N",
                        help="train again on N confident frames of the model's own, and track again; 0 for not")
    parser.add_argument("--colour", choices=("grey", "rgb"), default="grey", help="what is searched in (grey)")
    parser.add_argument("--jobs", type=whole(-1, nonzero=True), default=-1, help="processes; -1 for all cores")
    options = parser.read(arguments)
    from dnnvss.face.aam.search.model import SearchSettings
    from dnnvss.face.aam.tracking import summary, track_folder

    report = track_folder(options.labels, options.videos, options.out, own=options.own, jobs=options.jobs,
                          settings=SearchSettings(colour=options.colour))
    print(f"{summary(report)}\nwrote {report}")
    if options.out is None and options.videos.is_dir():
        print("now, with the words of each video beside it (ID.txt): "
              f"dnnvss prepare corpus=folder corpus.raw={shlex.quote(str(options.videos))}")
    return DONE
