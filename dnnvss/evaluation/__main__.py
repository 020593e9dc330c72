"""``python -m dnnvss.evaluation RUN [RUN ...] [--out FOLDER]``: all metrics of finished runs, with anchors and
tests."""

import argparse
import sys
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.comparison import compare
from dnnvss.evaluation.page import write_page
from dnnvss.evaluation.runs import make_bench, read_run


def main(arguments: list[str] | None = None) -> int:
    """Print the tables, write them as Markdown, JSON and HTML, and return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m dnnvss.evaluation", description=__doc__)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder of a finished run")
    parser.add_argument("--out", type=Path, help="where to write; the first run's folder `evaluation` unless given")
    parser.add_argument("--first", type=int, default=5, help="leading coefficients in averages (5)")
    parser.add_argument("--seed", type=int, default=0, help="of anchors, bootstrap and permutation tests (0)")
    options = parser.parse_args(arguments)
    try:
        runs = [read_run(folder) for folder in options.runs]
        bench = make_bench(runs, options.first)
        names = _names([run.folder for run in runs])
        systems = {name: run.arrays["predicted"] for name, run in zip(names, runs, strict=True)}
        systems |= {f"{name}, {style}": own for name, run in zip(names, runs, strict=True)
                    for style, own in run.styled.items()}
        result = compare(bench, systems, options.seed)
        print(result.table())
        out = options.out or options.runs[0] / "evaluation"
        files.write_text(out / "evaluation.md", result.markdown())
        files.write_json(out / "evaluation.json", result.to_json())
        page = write_page(out / "evaluation.html", result, bench, systems, dict(zip(names, options.runs, strict=True)))
    except DnnvssError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"\nwrote {out}/evaluation.md, evaluation.json, and {page}: open it in a browser")
    return 0


def _names(folders: list[Path]) -> list[str]:
    """Return a different name for each folder: its own, or its path where two agree."""
    short = [folder.resolve().name for folder in folders]
    if len(set(map(str, folders))) < len(folders):
        raise DnnvssError("the same run is named twice", remedy="Name each run once")
    return [name if short.count(name) == 1 else str(folder) for name, folder in zip(short, folders, strict=True)]


if __name__ == "__main__":
    sys.exit(main())
