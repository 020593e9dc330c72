"""Feature tables as Markdown: one configuration, or the whole page ``docs/features.md``."""

from collections.abc import Mapping

import numpy as np

from dnnvss.features.block import Settings
from dnnvss.features.catalogue import catalogue
from dnnvss.features.sources import SOURCES
from dnnvss.features.table import FeatureTable
from dnnvss.formats.tables import markdown_table
from dnnvss.phones import ANSWERS, PHONES, QUESTIONS
from dnnvss.timing import FrameClock

_INTRODUCTION = """# Features

This page is written by `python -m dnnvss features > docs/features.md`; a test compares it with the code.

A feature table is a list of blocks, chosen by name in `conf/labels/*.yaml`. Widths, slices, column names and the
hash that a checkpoint carries derive from the blocks. `python -m dnnvss features ph` prints one table with
its slices.

What the paper leaves open, and what we chose:

- **Position** (start, middle, end) is the third in which the centre of the smaller unit lies: `floor(3 (k + 1/2) /
  n)` for unit k of n. One of one is the middle, two are start and end. The rule is the same for a frame in its
  phone and for a word in its phrase, and it is exact in whole numbers.
- **Number of frames** is that of the whole phone (or dynamic viseme); **forward span** counts the current frame: 1
  in the last frame of the phone.
- **Windows and contexts** end with the utterance. Outside it phones are silence; dynamic visemes have no bit.
- **Syllable, word, phrase and utterance** blocks are zero in silence.
- **Dynamic visemes of a syllable** are those from the syllable's first frame to its last, so a viseme across a
  border belongs to both syllables; **phones of a dynamic viseme** likewise, silences not counted.
- A segment too short to own a frame keeps its place: its neighbours see it in their context, and counts include it.
- **Sound.** Frame k holds the sound around the centre of frame k of the trajectory. Where a window would reach beyond
  the sound, the nearest whole one takes its place; frames beyond the utterance hold its first or last frame. With
  `causal: true` the window ends with the frame, and before the sound there is silence. Sounds of other rates are
  brought to 16 kHz. What each analysis is made of stands in the [API](api/acoustics.md).
- Numeric columns are scaled to zero mean and unit variance over the training frames; binary columns are left as
  they are.
"""


def table_page(name: str, table: FeatureTable, clock: FrameClock) -> str:
    """Return one feature table as Markdown, each block with its level, width, slice and source."""
    rows = [(str(n), f"`{b.name}`", b.level, b.kind, b.width, f"{at.start}:{at.stop}", b.paper)
            for n, (b, at) in enumerate(zip(table.blocks, table.slices.values(), strict=True), 1)]
    facts = (f"{table.width} columns: {table.binary_width} binary, of which at most {table.active_width} are 1 in a "
             f"frame, and {table.numeric_width} numeric. Hash `{table.hash}`.\n")
    facts += " ".join(SOURCES[name].facts(table.settings, clock) for name in table.sources)
    return "\n".join([f"## {name}", "", facts, "",
                      markdown_table(("", "block", "level", "kind", "width", "slice", "source"), rows)]) + "\n"


def features_page(tables: Mapping[str, FeatureTable]) -> str:
    """Return the page of all blocks, of the tables that the configurations make of them, and of the questions."""
    known = catalogue(Settings())
    blocks = [(f"`{b.name}`", " + ".join(b.reads), b.level, b.kind, b.width, b.unit, b.meaning, b.paper)
              for b in known.values()]
    names = list(tables)
    used = [(f"`{block}`", *("x" if block in tables[n].names else "" for n in names)) for block in known]
    sums = [("columns", *(tables[n].width for n in names)), ("1 at most", *(tables[n].active_width for n in names))]
    return "\n".join([
        _INTRODUCTION,
        "## Blocks", "",
        "What a block reads is a source of features: `phones`, `visemes`, or one of the analyses of the sound.",
        "Widths are those of 16 frames of window on each side, 160 dynamic visemes, 40 mel bands at 10 frames around,",
        "and the other analyses at the frames beside.", "",
        markdown_table(("block", "reads", "level", "kind", "width", "unit", "columns", "source"), blocks), "",
        "## Configurations", "",
        "`labels=NAME` of `train.py`. `ph_a` to `ph_e` are the systems of Thangthai 2016, Table 2.", "",
        markdown_table(("block", *names), [*used, *sums]), "",
        "## The 57 questions", "",
        "The paper takes 57 questions from the HTS toolkit and does not print them. This list is ours: it asks first",
        "for what is seen. Every two questions and every two phones differ. The weight is a question's share in the",
        "distance between phones by which a phone that the talker never spoke is replaced.", "",
        markdown_table(("", "name", "question", "weight", "phones that answer yes"), _questions()),
    ]) + "\n"  # fmt: skip


def _questions() -> list[tuple]:
    return [(n + 1, f"`{q.name}`", q.asks, f"{q.weight:g}", " ".join(PHONES[p] for p in np.flatnonzero(ANSWERS[:, n])))
            for n, q in enumerate(QUESTIONS)]
