"""Times of a prepared corpus: what the aligner made of it, and how well durations are predicted from text.

    python benchmarks/timing.py data/grid               # or with --split unseen, --run runs/RUN_OF_THE_HSMM

Word starts are compared with the word times that came with the corpus, where there are any, as the preparation kept
them; the duration model is learnt from the training split and scored on the test split beside two null models, and the
durations that the model of a run has learnt.
"""

import argparse
import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from data_prep.stages import FOLDER
from dnnvss.corpus import Corpus
from dnnvss.runs.run import Run
from dnnvss.speech.durations import DurationModel
from dnnvss.speech.durations_scores import score_durations
from dnnvss.synthesis.plan import model_durations

STAGES = {"own voice": "the talker's own voice", "alignment": "the aligner for everybody"}


def heard(root: Path, stage: str) -> list[dict[str, Any]]:
    """Return what a stage of the preparation kept for each utterance that it aligned."""
    kept = (json.loads(path.read_text("utf-8")) for path in sorted((root / FOLDER / stage).glob("*.json")))
    return [record["result"] for record in kept if "late" in record.get("result", {})]


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpus", type=Path)
    parser.add_argument("--split", default="", help="variant of the split, e.g. unseen")
    parser.add_argument("--run", type=Path, help="a run whose model has learnt durations (model=hsmm)")
    chosen = parser.parse_args()
    corpus = Corpus.open(chosen.corpus)
    for stage, name in STAGES.items():
        results = heard(chosen.corpus, stage)
        if not results:
            continue
        attempts = ", ".join(f"{n} by {a!r}" for a, n in Counter(r["attempt"] for r in results).most_common())
        print(f"{name}: {len(results)} utterances aligned, {attempts}")
        late = 1000 * np.array([x for r in results for x in r["late"]])
        if len(late):
            apart = np.abs(late)
            print(f"  {len(late)} word starts against the given times: median difference {np.median(apart):.1f} ms, "
                  f"90 % under {np.percentile(apart, 90):.0f} ms; in the median {np.median(late):+.1f} ms later")
    train, test = (corpus.split(name, chosen.split) for name in ("train", "test"))
    print(f"durations, {len(test)} test utterances: RMSE in ms / correlation a phone")
    others = {chosen.run.name: model_durations(Run.open(chosen.run))} if chosen.run else {}
    for score in score_durations(DurationModel.fit(train), train, test, others):
        print(f"  {score.system}: {score.rmse:.1f} / {score.correlation:.3f}")


if __name__ == "__main__":
    main()
