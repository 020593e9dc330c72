"""``dnnvss outside RUN [RUN ...]``: runs judged from outside.

Test sentences are drawn in the run's own style, and one tracker that knows nothing of the model looks at the talker's
video and at ours: do lips open, spread and close as the talker's do? ``outside.md`` and ``outside.json`` lie in the
run's folder ``evaluation`` afterwards, and ``dnnvss compare`` shows the table.
"""

from collections.abc import Sequence
from pathlib import Path

from dnnvss import files
from dnnvss.commands.flags import Flags, whole
from dnnvss.commands.usage import DONE
from dnnvss.runs.files import RunFiles


def main(arguments: Sequence[str]) -> int:
    """Print the tables and write them as Markdown and JSON."""
    parser = Flags(prog="dnnvss outside", description=__doc__)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder of a finished run")
    parser.add_argument("--sentences", type=whole(2), default=20, help="test sentences at most, drawn at random (20)")
    parser.add_argument("--seed", type=whole(0), default=0, help="of the draw (0)")
    parser.add_argument("--landmarker", type=Path, help="your copy of face_landmarker.task; that of make extras unless "
                                                        "given")
    options = parser.read(arguments)
    from dnnvss.evaluation.cells import number_of
    from dnnvss.evaluation.outside import judge
    from dnnvss.face.landmarker import Landmarker, find_task
    from dnnvss.runs.run import Run

    for run in options.runs:  # the last of them too, before the first is watched
        Run.open(run)
        files.check_writable([RunFiles(run).outside])
    landmarker = Landmarker(find_task(options.landmarker))
    for run in options.runs:
        judged = judge(run, landmarker, count=options.sentences, seed=options.seed)
        path = judged.save(run)
        watched = number_of(len(judged.sentences), "test sentence")
        print(f"{run}: {watched}, style {judged.style}\n{judged.table()}\nwrote {path}")
    return DONE
