"""How well few clips tell how late their own sound is, beside what all clips of their corpus tell.

    OMP_NUM_THREADS=1 python benchmarks/sync_few.py --corpus data/grid --clips 10 20

The corpus was prepared with ``corpus.importer.sync=true``; its lags are taken for the truth. Parts of it are measured
as if they were all there is, as distributed, and with their sound moved by the truth (nothing is to be found then).
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from data_prep import sync
from data_prep.heard_lips import SyncClip
from data_prep.stages import FOLDER, Workshop
from dnnvss import files
from dnnvss.corpus import Corpus

MOST = 120
"""Clips that are dealt out to the parts."""


def main() -> None:
    """Print the errors in milliseconds over the parts of each size."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--corpus", type=Path, default=Path("data/grid"))
    parser.add_argument("--clips", type=int, nargs="+", default=[10, 20])
    given = parser.parse_args()
    kept = sorted((given.corpus / FOLDER / "sync").glob("*.json"), key=lambda p: p.stat().st_mtime)
    truth = files.read_json(kept[-1], "Prepare the corpus with corpus.importer.sync=true")["late"]
    names = [str(n) for n in np.random.default_rng(0).permutation(sorted(truth))[:MOST]]
    clips = read(Corpus.open(given.corpus), names)
    for size in given.clips:
        parts = [names[k : k + size] for k in range(0, MOST - size + 1, size)]
        found = [measured({n: clips[n] for n in part}) for part in parts]
        true = [centred([truth[n] for n in part]) for part in parts]
        still = [measured({n: in_step(clips[n], truth[n]) for n in part}) for part in parts]
        r = np.mean([np.corrcoef(a, b)[0, 1] if a.any() else 0.0 for a, b in zip(found, true, strict=True)])
        left = [a - b for a, b in zip(found, true, strict=True)]
        print(f"{size} clips, {len(parts)} parts: out of step by {ms(true)} ms, after moving by {ms(left)} ms "
              f"(correlation with the truth {r:.2f}); clips in step are moved by {ms(still)} ms")


def read(corpus: Corpus, names: Sequence[str]) -> dict[str, SyncClip]:
    """Clips of a corpus with their sound as distributed."""
    seen = {n: corpus.landmarks(corpus.utterances[n]) for n in names}
    sounds = {n: f"{FOLDER}/sound/{n}.wav" for n in names}
    return sync.read_clips(Workshop(corpus.root, jobs=1), sounds, seen, corpus.info.landmark_groups,
                           float(corpus.utterances[names[0]].rate))


def in_step(clip: SyncClip, late: float) -> SyncClip:
    """A clip whose lips are seen so many seconds later."""
    return replace(clip, lips=lambda t: clip.lips(t - late))


def measured(clips: Mapping[str, SyncClip]) -> np.ndarray:
    """By how many seconds the clips (N,) would be moved, about their mean."""
    found = sync.shrunk(list(clips), *sync.lags(clips, sync.crossfitted(clips)))
    return centred(list(found.late.values()))


def centred(values: Sequence[float]) -> np.ndarray:
    """Values about their mean."""
    return np.array(values) - np.mean(values)


def ms(parts: Sequence[np.ndarray]) -> str:
    """The root mean square of parts of seconds, in milliseconds."""
    return f"{1000 * np.sqrt(np.mean(np.concatenate(parts) ** 2)):.1f}"


if __name__ == "__main__":
    main()
