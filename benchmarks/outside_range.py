"""What random sentences look like that nobody recorded: does a face leave what its talker showed, and does it fold?

    python benchmarks/outside_range.py RUN ... [--sentences 1000] [--skip 0] [--style NAME] [--out FOLDER]

Each sentence is a row of random words in random order, at the durations that the run learnt. Counted are pictures with
a turned-over triangle (the ring round the mesh as well), with lips that cross, and with an aperture above 1.1 times the
talker's largest. The frame farthest out of each run is written as ``NAME_worst.png``. ``--skip`` passes over the first
sentences, so that a thousand can be counted in pieces.
"""

import argparse
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import cv2
import numpy as np

from dnnvss.commands.arguments import parse_arguments
from dnnvss.commands.compose import compose
from dnnvss.commands.composed import typed_settings
from dnnvss.commands.speak import COMMAND
from dnnvss.face.aam.mesh import signed_areas
from dnnvss.face.base import APERTURE
from dnnvss.face.lips import lip_pairs
from dnnvss.render.renderer import Renderer
from dnnvss.runs.run import Run
from dnnvss.style.generator import make_style
from dnnvss.synthesis.request import SpeakRequest
from dnnvss.synthesis.speak import speak

VOCABULARY = """
about above again air all among animal answer apple awful baby back beautiful because before
begin better big blue book both boy bring brother build busy buy by call carry cheese child
choose church cloud cold come could cup dark day deep different do dog door down dream each
early earth easy eight every eye face fall far father feather few find fire five fly food foot
forest four fox free friend from full game garden gave girl give go good great green group grow
half hand happy hard head hear heavy help her high home hope horse hour house how huge idea if
important joy judge jump just keep kind king know language large laugh leave left life light
listen little long look love low machine make man many map measure milk mind money moon more
morning mother mouth move much music my name near never new night nine no north nose nothing now
number ocean of off often oil old one open orange other our out over own page paper part people
picture place plain please point poor power pull purple push put queen question quick rain reach
read red right river road room round run same saw say school sea second see seven shape she ship
shoe shop short show six sleep slow small snow some song soon sound south speak spring star
start stay stone stop story street strong such summer sun sure table take talk tell ten thank
that thing think thought three through time to today together too tooth toy tree true try turn
two uncle under up usual valley very visit voice wait walk wall want warm was watch water way
weather week well west what wheel where white who why wide wind winter wish with woman wood word
work world would yellow yes you young zebra zero
"""
WORDS = tuple(VOCABULARY.split())
LARGER = 1.1


@dataclass
class Counts:
    """What was seen of a run's sentences.

    Args:
        frames: how many.
        folded, crossed, gaping: pictures with a turned-over triangle, crossing lips, a mouth too wide open.
        widest: largest aperture over the talker's largest.
        worst: the parameters (D,) of the frame farthest out, and how far that is.
    """

    frames: int = 0
    folded: int = 0
    crossed: int = 0
    gaping: int = 0
    widest: float = 0.0
    worst: tuple[float, np.ndarray] | None = None


def sentences(count: int, words: Sequence[str] = WORDS, seed: int = 1) -> Iterator[str]:
    """Yield random sentences of four to nine words."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield " ".join(rng.choice(words, rng.integers(4, 10)))


def add(counts: Counts, renderer: Renderer, parameters: np.ndarray, span: tuple[float, float], scale: np.ndarray
        ) -> None:
    """Count the pictures of parameters (T, D).

    Args:
        counts: what is added to.
        renderer: that draws them.
        parameters: of the frames.
        span: the talker's least and largest aperture.
        scale: the deviation (D,) of each coefficient.
    """
    model = renderer.model
    meshes = renderer.meshes(parameters)
    areas = signed_areas(meshes, renderer.patch.triangles)
    between = np.zeros(areas.shape[1], bool)
    between[renderer.patch.inner] = True
    upper, lower = lip_pairs(model.mean_shape, model.layout.inner)[0].T
    shown = model.drawn(parameters, renderer.neutral.shape_offset)
    crossed = (shown[:, upper, 1] > shown[:, lower, 1] + 1e-6).any(axis=1)
    aperture = model.gauges[APERTURE](parameters) / span[1]
    counts.frames += len(parameters)
    counts.folded += int((areas[:, ~between] <= 0).any(axis=1).sum())
    counts.crossed += int(crossed.sum())
    counts.gaping += int((aperture > LARGER).sum())
    counts.widest = max(counts.widest, float(aperture.max()))
    size = np.abs(parameters / scale).max(axis=1)
    at = int(size.argmax())
    if counts.worst is None or size[at] > counts.worst[0]:
        counts.worst = (float(size[at]), parameters[at])


def count_run(run: Run, style: str, texts: Iterator[str]) -> tuple[Counts, Renderer]:
    """What random sentences of a run look like in a style of ``conf/style``."""
    counts, renderer = Counts(), list[Renderer]()
    chosen = make_style(compose_style(style), run.face)
    reach = run.generator.talker.reach
    assert reach is not None, "the run was trained before ranges were learnt"
    for text in texts:
        spoken = speak(run, SpeakRequest(text, engine="none", style=chosen))
        if not renderer:
            assert isinstance(spoken.stage.pictures, Renderer)
            renderer.append(spoken.stage.pictures)
        add(counts, renderer[0], spoken.trajectory, reach.spans[APERTURE], run.face.deviations)
    return counts, renderer[0]


def compose_style(name: str):  # type: ignore[no-untyped-def]
    """The settings of a file of ``conf/style``."""
    config = compose(parse_arguments(COMMAND, [f"style={name}"]))
    return typed_settings(COMMAND, config).style


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path)
    parser.add_argument("--sentences", type=int, default=1000)
    parser.add_argument("--skip", type=int, default=0)
    parser.add_argument("--style", default="articulated")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    for path in options.runs:
        texts = islice(sentences(options.skip + options.sentences), options.skip, None)
        counts, renderer = count_run(Run.open(path), options.style, texts)
        print(f"{path.name}: {counts.frames} frames, {counts.folded} folded, {counts.crossed} with crossing lips, "
              f"{counts.gaping} too wide open (widest {counts.widest:.3f} of the talker's)")
        if options.out and counts.worst:
            picture = next(renderer.frames(counts.worst[1][None]))
            cv2.imwrite(str(options.out / f"{path.name}_worst.png"), picture[..., ::-1])


if __name__ == "__main__":
    main()
