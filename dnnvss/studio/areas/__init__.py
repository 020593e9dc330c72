"""The other pages of the studio: footage, labelling, heads, training, results, viewing tests."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from dnnvss.studio.areas.area import AreaDesk
from dnnvss.studio.areas.footage import footage
from dnnvss.studio.areas.heads import heads
from dnnvss.studio.areas.labels import labels
from dnnvss.studio.areas.results import results
from dnnvss.studio.areas.training import training
from dnnvss.studio.areas.viewing_tests import viewing
from dnnvss.studio.page import Page

__all__ = ["with_areas"]


def with_areas(page: Page, runs: Path, folders: Sequence[Path]) -> Page:
    """A page with the areas of the studio under it, each under the first part of its paths.

    Args:
        page: which has none yet.
        runs: a folder of run folders.
        folders: that corpora, labels, viewing tests and comparisons are looked for in.
    """
    desks = [AreaDesk(footage(folders), folders), AreaDesk(labels(folders), folders),
             AreaDesk(heads(folders), folders),
             AreaDesk(training([runs]), [runs]), AreaDesk(results([runs], folders), [runs, *folders]),
             AreaDesk(viewing(folders), folders)]
    return replace(page, under={desk.area.name: desk.page() for desk in desks}.get)
