"""Every block that a feature table can hold: those of all feature sources."""

from functools import lru_cache

from dnnvss.features.block import Block, Settings
from dnnvss.features.sources import SOURCES


@lru_cache
def catalogue(settings: Settings) -> dict[str, Block]:
    """Every declared block by name, sized by the settings.

    **Source**: Thangthai 2016, section 4 and Table 1 for the blocks that say so; the others are ours.
    """
    blocks = [block for source in SOURCES.values() for block in source.blocks(settings) if block.columns]
    found = {block.name: block for block in blocks}
    assert len(found) == len(blocks), "two sources have a block of one name"
    return found
