"""How well a run's face moves the packaged head: what its shapes do not reach, lips that part and touch, and speed.

``OMP_NUM_THREADS=1 python benchmarks/rigs.py runs/RUN --clips 50`` takes measured clips of the test split.
"""

import argparse
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from dnnvss.commands.arguments import parse_arguments
from dnnvss.commands.compose import compose
from dnnvss.commands.composed import typed_settings
from dnnvss.commands.speak import COMMAND
from dnnvss.corpus import Corpus
from dnnvss.face.encoding import find_encoding
from dnnvss.face.mesh.bezier import BezierSurface
from dnnvss.face.mesh.deformer import bind
from dnnvss.face.mesh.net import packaged_net
from dnnvss.face.mesh.tongue import speaking_head
from dnnvss.render.solid import Solid, whole_head
from dnnvss.runs.files import RunFiles
from dnnvss.runs.run import Run
from dnnvss.style.generator import make_style
from dnnvss.synthesis.head import on_head
from dnnvss.synthesis.request import SpeakRequest
from dnnvss.synthesis.speak import speak
from dnnvss.timing import FrameClock, Tier

CLOSED, OPEN = frozenset("PBM"), frozenset({"AA", "AE", "AY", "AW", "EH"})
WORKED = 60


def measure(run: Run, folder: Path, count: int) -> None:
    """Print what the shapes reach and how far the lips part, on measured clips and on what the run says of them."""
    corpus = Corpus.open(run.settings.corpus_folder)
    encoded = find_encoding(corpus, RunFiles(folder).face)
    assert encoded is not None, "the corpus was encoded with another face"
    chosen = make_style(typed_settings(COMMAND, compose(parse_arguments(COMMAND, []))).style, run.face)
    found: dict[str, list[tuple[np.ndarray, FrameClock, Tier]]] = {"measured": [], "said": []}
    for utterance in corpus.split("test")[:count]:
        phones = utterance.alignment["phones"]
        found["measured"].append((encoded.clip(utterance.id).parameters, FrameClock(utterance.rate), phones))
        request = SpeakRequest(utterance.text, alignment=utterance.alignment, engine="none", style=chosen)
        found["said"].append((speak(run, request).movement, run.task.clock, phones))
    for what, takes in found.items():
        print(f"{what}: {reached(run, takes)}")


def reached(run: Run, takes: Sequence[tuple[np.ndarray, FrameClock, Tier]]) -> str:
    """What is left of the points' movement, and the gap between the lips in phones, in words."""
    on = on_head(run, speaking_head())
    ring = on.head.curves["lips_inner"]
    upper, lower = ring[len(ring) // 4], ring[-(len(ring) // 4)]
    errors, closed, opened = [], [], []
    for parameters, clock, phones in takes:
        fitted = on.fit(run.face.points(parameters))
        errors.append(fitted.errors)
        vertices = on.head.vertices(fitted.weights)
        gap = 1000 * (vertices[:, upper, 1] - vertices[:, lower, 1])
        for segment in phones:
            inside = gap[clock.edge(segment.start) : clock.edge(segment.end)]
            if len(inside) and segment.label in CLOSED:
                closed.append(inside.min())
            if len(inside) and segment.label in OPEN:
                opened.append(inside.max())
    every = np.concatenate(errors)
    lips = [f"{name} {', '.join(f'{v:.1f}' for v in np.percentile(values, (5, 50, 95)))} mm ({len(values)})"
            for name, values in (("least gap on p, b, m", closed), ("largest on open vowels", opened))]
    return (f"{len(takes)} clips, {np.sqrt((every**2).mean()):.2%} of the mouth's width RMS not reached, at most "
            f"{every.max():.2%}; 5, 50 and 95 % of the {lips[0]}, {lips[1]}")


def speed() -> None:
    """Print how fast the head is deformed and drawn, on one core."""
    head, net = speaking_head(), packaged_net()
    deformer = bind(head.mesh, BezierSurface(net.triangles, len(net.names)), net.at(head.mesh.vertices))
    weights = np.zeros((WORKED, len(head.names)))
    weights[:, head.position("jawOpen")] = np.linspace(0, 0.6, WORKED)
    points = net.at(head.vertices(weights))
    solid = Solid(head.mesh, whole_head(head.mesh, 480))
    both = {"deformation": lambda k: deformer.vertices(points[k]),
            "deformation and picture": lambda k: solid.picture(deformer.vertices(points[k]))}
    for name, rate in _rates(both).items():
        print(f"{name} of {len(head.mesh.vertices)} vertices: {rate:.0f} frames a second of a core")


def _rates(work: Mapping[str, Callable[[int], object]]) -> dict[str, float]:
    made = {}
    for name, each in work.items():
        each(0)
        start = time.process_time()
        for k in range(WORKED):
            each(k)
        made[name] = WORKED / (time.process_time() - start)
    return made


def main() -> None:
    """Measure what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--clips", type=int, default=50)
    options = parser.parse_args()
    measure(Run.open(options.run), options.run, options.clips)
    speed()


if __name__ == "__main__":
    main()
