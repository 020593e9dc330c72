"""The feature table and its blocks; alignments to frame codes. Knows nothing of networks."""

from dnnvss.features.block import Block, Settings
from dnnvss.features.catalogue import catalogue
from dnnvss.features.codes import FrameCodes, expand
from dnnvss.features.encode import encode
from dnnvss.features.scaling import NumericScaler
from dnnvss.features.store import CodeStore
from dnnvss.features.table import FeatureTable

__all__ = ["Block", "CodeStore", "FeatureTable", "FrameCodes", "NumericScaler", "Settings", "catalogue", "encode",
           "expand"]
