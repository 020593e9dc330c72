"""Several runs in one table: ``python -m dnnvss.pipeline.compare RUN RUN ... [out=FOLDER]``."""

import sys
from pathlib import Path

import numpy as np

from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.evaluation import Report, evaluate
from dnnvss.pipeline.cli import command

Arrays = dict[str, np.ndarray]


def read_predictions(run: Path) -> dict[str, Arrays]:
    """Return ``predicted``, ``reference``, ``speech`` and ``valid`` of the test sentences of a finished run."""
    remedy = "Name finished runs, folders written by train.py"
    return {kind: files.read_arrays(run / "predictions" / f"{kind}.npz", remedy)
            for kind in ("predicted", "reference", "speech", "valid")}


def compare(runs: list[Path]) -> Report:
    """Return one table of several runs on the same test sentences.

    Raises:
        DnnvssError: a run is not finished, or was tested on other sentences or another AAM.
    """
    loaded = {run.name: read_predictions(run) for run in runs}
    first = next(iter(loaded.values()))
    for name, data in loaded.items():
        same = data["reference"].keys() == first["reference"].keys() and all(
            np.array_equal(data["reference"][i], first["reference"][i]) for i in first["reference"])
        if not same:
            raise DnnvssError("was tested on other sentences or another AAM than the first run", file=name,
                              remedy="Compare runs of one corpus, split and aam setting")
    return evaluate({name: data["predicted"] for name, data in loaded.items()}, first["reference"],
                    speech=first["speech"], valid=first["valid"])


@command
def main(arguments: list[str]) -> None:
    """Print the table, and write it where ``out=`` says."""
    options = dict(a.split("=", 1) for a in arguments if a.startswith("out="))
    runs = [Path(a) for a in arguments if not a.startswith("out=")]
    if not runs:
        raise DnnvssError("no run named", remedy="python -m dnnvss.pipeline.compare runs/A runs/B")
    report = compare(runs)
    print(report.table())
    if "out" in options:
        folder = Path(options["out"])
        files.write_json(folder / "compare.json", report.to_json())
        print(f"\nwrote {files.write_text(folder / 'compare.md', report.markdown() + chr(10))}")


if __name__ == "__main__":
    main(sys.argv[1:])
