"""``python -m dnnvss.export RUN --out model.onnx``: a run's network as a file, or all of the run as a bundle."""

import argparse
import sys
from pathlib import Path

from dnnvss.commands.entry import command


@command
def main(arguments: list[str] | None = None) -> int:
    """Export what the command line asks for; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m dnnvss.export", description=__doc__)
    parser.add_argument("run", type=Path, help="a run folder")
    parser.add_argument("--out", type=Path, required=True,
                        help="FILE.onnx or FILE.pt2 (torch.export); a name without suffix is a bundle for synth.py")
    parser.add_argument("--network", choices=("onnx", "pt2"), default="onnx", help="how a bundle keeps the network")
    options = parser.parse_args(arguments)
    from dnnvss.runs.bundling import export_run, write_bundle
    from dnnvss.runs.run import Run

    run = Run.open(options.run)
    if options.out.suffix:
        print(f"wrote {export_run(run, options.out)}")
    else:
        print(f"wrote {write_bundle(run, options.out, f'model.{options.network}')}: python synth.py run={options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
