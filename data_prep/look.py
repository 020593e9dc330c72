"""A first look at recordings before hours of work: a sample is prepared, and a page tells what the whole will be."""

import os
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from data_prep.headers import headers
from data_prep.look_page import page
from data_prep.looked import Look, said
from data_prep.pipeline import unfit_id
from data_prep.recipe import Recipe, Source
from data_prep.sample import sampled
from data_prep.stages import Workshop
from dnnvss import files
from dnnvss.media.folders import is_visible
from dnnvss.staging import scratch

HEADERS, SAMPLE = 8.0, 25.0
"""Seconds in which headers are read, and in which a sample is prepared."""

_CLUTTER = ("thumbs.db", "desktop.ini")  # what a system leaves in folders
NAME = "look.html"
"""The page, in the folder of the corpus that is to be."""


def first_look(sources: Iterable[Source], recipe: Recipe, shop: Workshop) -> Path:
    """Write the page of a first look into the folder of the corpus that is to be, and return its path.

    It takes less than a minute: what files say of themselves is read as far as there is time, and so many recordings
    are prepared, spread over all of them, in a folder that is removed again. Of long ones a part is.

    Raises:
        DnnvssError: the page cannot be written.
    """
    began = time.monotonic()
    sources = list(sources)
    problems = {s.id: problem for s in sources if (problem := s.problem or unfit_id(s.id))}
    good = [s for s in sources if s.id not in problems]
    known, unread = headers({s.id: p for s in good if (p := s.video or s.sound) is not None}, began + HEADERS)
    problems |= unread
    good = [s for s in good if s.id not in unread]
    jobs = shop.jobs if shop.jobs > 0 else max(1, (os.cpu_count() or 1) + 1 + shop.jobs)
    with scratch() as folder:
        sample = sampled(good, known, recipe, folder, SAMPLE)
        look = Look(recipe.info.name, recipe.info.variant, sources, problems, _kinds(sources), known, sample,
                    said(good, recipe), recipe.lacking, jobs)
        path = files.write_text(shop.out / NAME, page(look, time.monotonic() - began))
    print(f"First look, {time.monotonic() - began:.0f} s: {path}")
    return path


def _kinds(sources: Iterable[Source]) -> dict[str, int]:
    """Suffix to files in the folders that recordings lie in, those that a user sees."""
    folders = {p.parent for s in sources for p in (s.video, s.sound, *s.landmarks[:1], s.alignment) if p is not None}
    found = Counter(p.suffix.lower() or "no suffix" for folder in folders for p in folder.iterdir()
                    if is_visible(p) and p.name.lower() not in _CLUTTER)
    return dict(found.most_common())
