"""A voice to the curves of a rig, beside null models: for each curve that moves, and over all of them.

python benchmarks/rig_voice.py RUN

Of a run on a corpus of curves: correlation over speech of the prediction, and of the prediction of
another take in its place, laid from its start. ``mean`` averages over the curves that move in a
take, ``by movement`` weighs each by its variance there, ``large`` averages over those that move by
a tenth of their range.
"""

import argparse
from pathlib import Path

import numpy as np

from dnnvss.archives import read_arrays
from dnnvss.evaluation.metrics import correlation
from dnnvss.face.rig import RigFace
from dnnvss.runs.files import RunFiles


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, metavar="RUN")
    places = RunFiles(parser.parse_args().run)
    face = RigFace.load(places.face)
    said, true, speech = (read_arrays(places.prediction(n)) for n in ("predicted", "reference", "speech"))
    ids, width = sorted(true), np.ptp(face.ranges, axis=1)
    rows: dict[str, list[tuple[float, float, float]]] = {"prediction": [], "another take's": []}
    each: dict[str, list[float]] = {}
    for k, i in enumerate(ids):
        spoken = np.flatnonzero(speech[i])
        other = said[ids[(k + 1) % len(ids)]]
        moved = np.ptp(true[i][spoken], axis=0)
        for name, x in (("prediction", said[i]), ("another take's", np.resize(other, said[i].shape))):
            moves = moved > face.least
            r = correlation(true[i][spoken], x[spoken])
            variance = true[i][spoken].var(axis=0)
            rows[name].append((float(np.nanmean(r[moves])),
                               float(np.nansum((r * variance)[moves]) / variance[moves].sum()),
                               float(np.nanmean(r[moved > 0.1 * width]))))
            if name == "prediction":
                for d in np.flatnonzero(moved > 0.1 * width):
                    each.setdefault(face.names[d], []).append(float(r[d]))
    print(f"{'':16s}{'mean':>8s}{'by movement':>13s}{'large':>8s}")
    for name, own in rows.items():
        print(f"{name:16s}" + "{:8.3f}{:13.3f}{:8.3f}".format(*np.mean(own, axis=0)))
    for name, values in sorted(each.items(), key=lambda item: -float(np.mean(item[1]))):
        print(f"  {name:32s} {np.mean(values):.3f} ({len(values)} takes)")


if __name__ == "__main__":
    main()
