"""Dynamic visemes of a corpus: its clips, and measurements of gestures and units.

``python -m dnnvss.commands.visemes data/demo --units 40 80 160`` prints what cutting and clustering do with a corpus
that was encoded (by ``train.py``), and, where the corpus knows its true gestures, how well they are found again.
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from omegaconf import OmegaConf

from dnnvss import files
from dnnvss.corpus import Corpus
from dnnvss.errors import DnnvssError
from dnnvss.face.encoding import newest_encoding
from dnnvss.formats.tables import markdown_table
from dnnvss.timing import Alignment, FrameClock
from dnnvss.visemes import (
    RULES,
    Movement,
    Visemes,
    VisemeSettings,
    boundary_scores,
    compare_units,
    label_agreement,
    learn,
    point_view,
)
from dnnvss.visemes.corpus import viseme_clips, viseme_settings

Pairs = list[tuple[Alignment, Movement]]




def gesture_line(visemes: Visemes, pairs: Pairs) -> list[str]:
    """Return number, length and rest of the gestures of clips and, with a tier ``gestures``, how they agree with it."""
    frame = 1 / float(FrameClock(visemes.rate).rate)
    cuts = [visemes.gestures(clip) for _, clip in pairs]
    lengths = np.concatenate([np.diff(c.edges)[~c.rest] for c in cuts]) * frame
    resting = sum(np.diff(c.edges)[c.rest].sum() for c in cuts) / sum(c.edges[-1] for c in cuts)
    cells = [f"{np.mean([(~c.rest).sum() for c in cuts]):.1f}", f"{1000 * np.median(lengths):.0f}", f"{resting:.2f}"]
    tiers = [(visemes.tier(clip), a["gestures"]) for a, clip in pairs if "gestures" in a]
    edges = [(found.edges[1:-1], true.edges[1:-1]) for found, true in tiers]
    cells += [f"{boundary_scores(edges, n * frame).f1:.3f}" if tiers else "" for n in (1, 2, 3)]
    return [*cells, f"{label_agreement(tiers):.3f}" if tiers else ""]


def report(train: Pairs, test: Pairs, clock: FrameClock, settings: VisemeSettings, units: Sequence[int],
           view: np.ndarray) -> str:
    """Return the measurements as Markdown: rules and what they look at, numbers of units."""
    head = ["gestures a clip", "median ms", "rest", "F1 ±1", "F1 ±2", "F1 ±3 frames", "AMI"]
    clips = [clip for _, clip in train]
    lines = [["cut by", *head]]
    for rule in RULES:
        for name, looked in (("points", view), ("coefficients", None), ("first coefficient", np.eye(len(view))[:, :1])):
            chosen = replace(settings, gestures=replace(settings.gestures, rule=rule))
            lines.append([f"{rule} of {name}", *gesture_line(learn(clips, clock, chosen, looked), test)])
    choices = {c.units: c for c in compare_units(clips, clock, settings, units, view)}
    rows = [["units", "made", "fewest members", "held-out nats", "distortion", *head[3:]]]
    for number, choice in choices.items():
        made = learn(clips, clock, replace(settings, units=number), view)
        rows.append([str(number), str(len(made)), str(made.counts[1:].min()), f"{choice.likelihood:.2f}",
                     f"{choice.distortion:.3f}", *gesture_line(made, test)[3:]])
    return f"{markdown_table(lines[0], lines[1:])}\n\n{markdown_table(rows[0], rows[1:])}\n"


def main(arguments: list[str] | None = None) -> int:
    """Print the measurements of a corpus and return 0, or an error and 1."""
    parser = argparse.ArgumentParser(prog="python -m dnnvss.commands.visemes", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("corpus", type=Path, help="folder of a prepared and encoded corpus")
    parser.add_argument("--visemes", type=Path, default=Path("conf/visemes/default.yaml"), help="settings")
    parser.add_argument("--units", type=int, nargs="+", default=[40, 80, 160], help="numbers of units to compare")
    parser.add_argument("--rate", default="100", help="frames a second")
    options = parser.parse_args(arguments)
    try:
        config = files.read(options.visemes, OmegaConf.load, "Give a file of conf/visemes")
        settings, clock = viseme_settings(config), FrameClock(options.rate)
        corpus = Corpus.open(options.corpus)
        encoded = newest_encoding(corpus)
        pairs = {}
        for split in ("train", "test"):
            clips = viseme_clips(corpus.split(split), encoded, clock)
            pairs[split] = [(corpus.utterances[name].alignment, clip) for name, clip in clips.items()]
        print(report(pairs["train"], pairs["test"], clock, settings, options.units, point_view(encoded.face)), end="")
    except DnnvssError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
