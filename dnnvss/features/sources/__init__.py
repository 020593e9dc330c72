"""The kinds of input that a feature table can hold beside each other. A new one is a module here and a row below."""

from collections.abc import Iterable, Mapping
from functools import lru_cache

from dnnvss.features.block import Settings
from dnnvss.features.fields import WHOLE, Field
from dnnvss.features.sources.base import FeatureSource
from dnnvss.features.sources.encoder import ENCODER_SOURCE
from dnnvss.features.sources.phones import PHONE_SOURCE, PhoneSegments, phones_of
from dnnvss.features.sources.sound import SOUND_SOURCES
from dnnvss.features.sources.visemes import VISEME_SOURCE, VisemeSegments, visemes_of

__all__ = ["SOURCES", "FeatureSource", "PhoneSegments", "VisemeSegments", "array_fields", "phones_of", "visemes_of"]

SOURCES: Mapping[str, FeatureSource] = {source.name: source for source in
                                        (PHONE_SOURCE, VISEME_SOURCE, *SOUND_SOURCES, ENCODER_SOURCE)}
"""Every source by name, in the order in which they are encoded."""


def array_fields(sources: Iterable[str], settings: Settings) -> Mapping[str, Field]:
    """The arrays of some sources by name, with those that belong to none."""
    return _array_fields(tuple(sources), settings)


@lru_cache
def _array_fields(sources: tuple[str, ...], settings: Settings) -> Mapping[str, Field]:
    found = dict(WHOLE)
    for name in sources:
        declared = SOURCES[name].fields(settings)
        assert not found.keys() & declared.keys(), f"two sources have an array of one name: {name}"
        found |= declared
    return found
