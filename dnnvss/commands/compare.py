"""``python -m dnnvss.evaluation RUN [RUN ...] [--out FOLDER]``: all metrics of finished runs, with anchors and
tests."""

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.evaluation.across import Side, compare_faces
from dnnvss.evaluation.comparison import Predictions, compare
from dnnvss.evaluation.page import write_page
from dnnvss.evaluation.runs import by_face, make_bench, read_run

_HASH = re.compile("-[0-9a-f]{8}$")


def main(arguments: list[str] | None = None) -> int:
    """Print the tables, write them as Markdown, JSON and HTML, and return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m dnnvss.evaluation", description=__doc__)
    parser.add_argument("runs", nargs="+", type=Path, metavar="RUN", help="folder of a finished run")
    parser.add_argument("--out", type=Path, help="where to write; the first run's folder `evaluation` unless given")
    parser.add_argument("--first", type=int, default=5, help="leading coefficients in averages (5)")
    parser.add_argument("--seed", type=int, default=0, help="of anchors, bootstrap and permutation tests (0)")
    options = parser.parse_args(arguments)
    try:
        written = compare_runs(options.runs, options.out, first=options.first, seed=options.seed)
    except DnnvssError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"\nwrote {written.parent}/evaluation.md, evaluation.json, and {written}: open it in a browser")
    return 0


def compare_runs(folders: Sequence[Path], out: Path | None = None, names: Sequence[str] | None = None, *,
                 first: int = 5, seed: int = 0) -> Path:
    """Print all metrics of finished runs, write them as Markdown, JSON and HTML, and return the path of the page.

    Runs of different faces are compared by the gauges that they share (:mod:`dnnvss.evaluation.across`).

    Args:
        folders: of the runs.
        out: where to write; ``evaluation`` in the first run's folder unless given.
        names: of the runs; from their folders unless given.
        first: leading coefficients in averages.
        seed: of anchors, bootstrap and permutation tests.

    Raises:
        DnnvssError: a folder of no finished run, runs of other test sentences, or a run that is named twice.
    """
    runs = [read_run(folder) for folder in folders]
    names = names or _names(list(folders))
    sides = {}
    for face, group in by_face(dict(zip(names, runs, strict=True))).items():
        systems: dict[str, Predictions] = {name: run.arrays["predicted"] for name, run in group.items()}
        systems |= {f"{name}, {style}": own for name, run in group.items() for style, own in run.styled.items()}
        sides[face] = Side(make_bench(list(group.values()), first), systems)
    if len(sides) == 1:
        shown = next(iter(sides.values()))
        result = compare(shown.bench, shown.systems, seed)
    else:
        result, shown = compare_faces(sides, seed)
    print(result.table())
    out = out or folders[0] / "evaluation"
    files.write_text(out / "evaluation.md", result.markdown())
    files.write_json(out / "evaluation.json", result.to_json())
    return write_page(out / "evaluation.html", result, shown.bench, shown.systems,
                      dict(zip(names, folders, strict=True)))


def _names(folders: list[Path]) -> list[str]:
    """Return a different name for each folder: its own without the hash, the whole or its path where two agree."""
    if len(set(map(str, folders))) < len(folders):
        raise DnnvssError("the same run is named twice", remedy="Name each run once")
    whole = [folder.resolve().name for folder in folders]
    bare = [_HASH.sub("", name) for name in whole]
    return [b if bare.count(b) == 1 else w if whole.count(w) == 1 else str(folder)
            for b, w, folder in zip(bare, whole, folders, strict=True)]


if __name__ == "__main__":
    sys.exit(main())
