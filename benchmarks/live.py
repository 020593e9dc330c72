"""How well and how quickly a run follows a voice as it comes, on its test sentences.

``python benchmarks/live.py RUN``: correlation and variance of the first five coefficients over
speech, of what a live face gives out (fixed-lag generation, its dial) beside the whole sentence's
(MLPG over all of it); the lag; and the share of one core without and with pictures.
"""

import argparse
import time
from pathlib import Path

import numpy as np
import torch

from dnnvss.corpus import Corpus
from dnnvss.curves import mlpg
from dnnvss.evaluation.metrics import correlation, global_variance_ratio
from dnnvss.runs.fitting import encode
from dnnvss.runs.run import Run
from dnnvss.synthesis.live import LiveFace, LiveSettings
from dnnvss.systems.examples import make_examples, speech_frames

_FIRST = 5
_BLOCK = 320
"""Samples that come at a time: 20 ms."""


def live(run: Run, samples: np.ndarray, articulation: float | None) -> np.ndarray:
    """The trajectory (T, D) on the run's clock that a live face gives of a sound."""
    face = LiveFace(run, LiveSettings(articulation=articulation, pictures=run.task.clock))
    parts = [face.push(samples[k : k + _BLOCK]) for k in range(0, len(samples), _BLOCK)]
    return np.concatenate([*parts, face.finish()])


def share_of_core(run: Run, samples: np.ndarray, pictures: bool) -> float:
    """Processor time over the duration of the sound."""
    face, drawer = LiveFace(run), run.pictures()
    begun = time.process_time()
    for k in range(0, len(samples), _BLOCK):
        rows = face.push(samples[k : k + _BLOCK])
        if pictures and len(rows):
            for _ in drawer.frames(rows):
                pass
    return (time.process_time() - begun) / (len(samples) / 16000)


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, metavar="RUN")
    run = Run.open(parser.parse_args().run)
    torch.set_num_threads(1)
    corpus = Corpus.open(run.settings.corpus_folder)
    utterances = corpus.split("test", run.settings.split)
    examples = list(make_examples(run.task, corpus, utterances, encode(run.settings, corpus)))
    found: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    for example in examples:
        samples = np.asarray(corpus.sound(corpus.utterances[example.id]).samples, np.float32)
        prediction = run.model.predict(example)
        rows = {"whole sentence": mlpg(prediction.mean, prediction.variance, run.task.windows),
                "live, plain": live(run, samples, None), "live, dial at 1": live(run, samples, 1.0)}
        targets, valid = example.measured
        for name, x in rows.items():
            count = min(len(x), len(targets))
            at = (speech_frames(example.alignment, run.task.clock) & valid)[:count]
            pair = targets[:count, 0, :_FIRST][at], np.asarray(x)[:count, :_FIRST][at]
            found.setdefault(name, []).append((correlation(*pair), global_variance_ratio(*pair)))
    for name, pairs in found.items():
        r, ratio = (np.array(part) for part in zip(*pairs, strict=True))
        print(f"{name}: correlation {r.mean():.4f}, variance "
              f"{np.round(np.exp(np.log(ratio).mean(0)), 2).tolist()}")
    face = LiveFace(run)
    print(f"lag {1000 * face.lag:.0f} ms: " + ", ".join(f"{k} {1000 * v:.0f}" for k, v in face.parts.items()))
    sound = np.concatenate([corpus.sound(corpus.utterances[e.id]).samples for e in examples[:10]]).astype(np.float32)
    for pictures in (False, True):
        share_of_core(run, sound[:32000], pictures)
        print(f"{'with' if pictures else 'without'} pictures: {share_of_core(run, sound, pictures):.1%} of one core")


if __name__ == "__main__":
    main()
