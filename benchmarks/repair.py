"""What the repair of markers is worth: takes of the built-in talker, against their truth.

python benchmarks/repair.py [TAKES]
"""

import argparse

import numpy as np

from data_prep.capture import find_head, jig_of, learn_usual, settled, whole
from data_prep.capture.repair import usual_places
from dnnvss.corpus.similarity import fit_similarity
from dnnvss.corpus.talker.hours import times_of_day
from dnnvss.corpus.talker.session import FACE_MARKERS, RATE, capture


def main() -> None:
    """Print errors in millimetres, and how many swaps were found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("takes", type=int, nargs="?", default=12, metavar="TAKES")
    count = parser.parse_args().takes
    takes = [capture(k, text) for k, text in enumerate(times_of_day(count))]
    face = len(FACE_MARKERS)
    jig = jig_of([t.seen[:, face:] for t in takes])
    still = [find_head(t.seen[:, face:], jig, RATE).taken_out(t.seen[:, :face]) for t in takes]
    rest = usual_places(np.concatenate(still))
    first = [settled(t.seen[:, :face], t.seen[:, face:], jig, rest, RATE, FACE_MARKERS) for t in takes]
    usual = learn_usual([r.points.reshape(len(r.points), -1) for r in first])
    own = np.concatenate([whole(r.points, usual, RATE, FACE_MARKERS).points for r in first])
    true = np.concatenate([t.truth for t in takes])
    middle = np.median(true, axis=0)
    frame = fit_similarity(np.median(own, axis=0)[None], middle, rigid=True)
    off = np.linalg.norm(frame.back(own, middle.mean(axis=0)) - true, axis=-1)
    missing = np.concatenate([~np.isfinite(r.points).all(axis=2) for r in first])
    brow = np.array([name.startswith("forehead") for name in FACE_MARKERS])
    for name, part in (("forehead", off[:, brow]), ("missing", off[missing]), ("all", off)):
        print(f"{name:10s} rms {np.sqrt((part**2).mean()):.3f} mm, largest {part.max():.2f} mm")
    asked, found, false = 0, 0, 0
    for take, done in zip(takes, first, strict=True):
        told = {frozenset(swap[:2]) for swap in done.told["swaps"]}
        real = {frozenset((FACE_MARKERS[a], FACE_MARKERS[b])) for a, b, _, _ in take.swaps}
        asked, found, false = asked + len(real), found + len(real & told), false + len(told - real)
    print(f"swaps: {found} of {asked} found, {false} false; {missing.mean():.1%} missing")


if __name__ == "__main__":
    main()
