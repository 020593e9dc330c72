"""``dnnvss export RUN --out model.onnx``: a run's network as a file, or all of the run as a bundle."""

import shlex
from collections.abc import Sequence
from pathlib import Path

from dnnvss.commands.flags import Flags
from dnnvss.commands.usage import DONE


def main(arguments: Sequence[str]) -> int:
    """Export what the command line asks for."""
    parser = Flags(prog="dnnvss export", description=__doc__)
    parser.add_argument("run", type=Path, metavar="RUN", help="a run folder")
    parser.add_argument("--out", type=Path, required=True,
                        help="FILE.onnx or FILE.pt2 (torch.export); a name without suffix is a bundle to speak with")
    parser.add_argument("--network", choices=("onnx", "npz"), default="onnx",
                        help="how a bundle keeps a network: as ONNX, or its weights as arrays, as all else is kept")
    options = parser.read(arguments)
    from dnnvss.runs.bundling import export_run, write_bundle
    from dnnvss.runs.run import Run

    run = Run.open(options.run)
    if options.out.suffix:
        print(f"wrote {export_run(run, options.out)}")
    else:
        made = write_bundle(run, options.out, f"model.{options.network}")
        print(f"wrote {made}: dnnvss speak {shlex.quote(f'run={options.out}')}")
    return DONE
