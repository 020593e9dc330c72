"""The feature table and its blocks; alignments to frame codes. Knows nothing of networks."""

from dnnvss.features.block import Block, Settings
from dnnvss.features.catalogue import catalogue
from dnnvss.features.codes import FrameCodes, expand
from dnnvss.features.encode import encode, encode_recording
from dnnvss.features.recording import Recording
from dnnvss.features.scaling import NumericScaler
from dnnvss.features.sources import (
    SOURCES,
    FeatureSource,
    PhoneSegments,
    VisemeSegments,
    phones_of,
    visemes_of,
)
from dnnvss.features.store import CodeStore
from dnnvss.features.table import FeatureTable

__all__ = ["SOURCES", "Block", "CodeStore", "FeatureSource", "FeatureTable", "FrameCodes", "NumericScaler",
           "PhoneSegments", "Recording", "Settings", "VisemeSegments", "catalogue", "encode", "encode_recording",
           "expand", "phones_of", "visemes_of"]
