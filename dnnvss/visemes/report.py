"""Measurements of gestures and units of a corpus: rules of cutting, what they look at, and numbers of units."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from dnnvss.corpus import Corpus
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
from dnnvss.visemes.corpus import learnt_from, viseme_clips

Pairs = list[tuple[Alignment, Movement]]


def corpus_report(folder: Path, clock: FrameClock, settings: VisemeSettings, units: Sequence[int]) -> str:
    """The measurements of an encoded corpus as Markdown: learnt on its training clips, held to the test clips.

    Raises:
        DnnvssError: no corpus, or one that was not encoded.
    """
    corpus = Corpus.open(folder)
    encoded = newest_encoding(corpus)
    train, test = ([(corpus.utterances[name].alignment, clip) for name, clip in viseme_clips(part, encoded, clock)]
                   for part in (learnt_from(corpus.split("train"), encoded), corpus.split("test")))
    return report(train, test, clock, settings, units, point_view(encoded.face))


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
