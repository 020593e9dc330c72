"""The settings of the papers side by side on a prepared corpus.

    OMP_NUM_THREADS=1 python benchmarks/aam_papers.py --corpus data/grid [--aam th07 th03] [--every 13] [--clips 10]

Fits each on every nth training clip and encodes some validation clips: how many parameters there are, and the RMS
distance of the points in pixels and difference of the texture (of the luminance, where that alone is modelled) in grey
levels with each clip's offset.
"""

import argparse
import tempfile
from collections import Counter
from pathlib import Path

import joblib
from aam_reconstruction import settings

from dnnvss.corpus import Corpus
from dnnvss.face.aam import ActiveAppearanceModel
from dnnvss.face.encoding import encode_corpus


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--corpus", type=Path, required=True, help="folder of a prepared corpus")
    parser.add_argument("--aam", nargs="+", default=["grid", "th07", "th03", "c04"], help="settings of conf/aam")
    parser.add_argument("--every", type=int, default=13, help="one training clip in this many")
    parser.add_argument("--clips", type=int, default=10, help="validation clips")
    arguments = parser.parse_args()
    corpus = Corpus.open(arguments.corpus)
    splits = {"train": [u.id for u in corpus.split("train")][::arguments.every],
              "val": [u.id for u in corpus.split("val")][:arguments.clips]}
    print(f"{corpus.info.name}: {len(splits['train'])} training clips, {len(splits['val'])} validation clips\n")
    print("| aam= | points | parameters | pixels | grey levels |\n|---|---|---|---|---|")
    for name in arguments.aam:
        with tempfile.TemporaryDirectory() as folder, joblib.parallel_config(n_jobs=1):
            encoded = encode_corpus(corpus, splits, settings(name), folder, progress=False)
            model, error = encoded.face, encoded.report["reconstruction"]["val"]
            assert isinstance(model, ActiveAppearanceModel)
            kinds = Counter(parameter.rstrip("0123456789") for parameter in model.names)
            counts = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
            print(f"| {name} | {len(model.mean_shape)} | {counts} | {error['pixels']:.3f} | "
                  f"{error['grey_levels']:.2f} |", flush=True)


if __name__ == "__main__":
    main()
