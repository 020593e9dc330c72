"""The feature table and its blocks; alignments to frame codes. Knows nothing of networks."""

from dnnvss.labels.block import Block, Settings
from dnnvss.labels.catalogue import catalogue
from dnnvss.labels.codes import FrameCodes, expand
from dnnvss.labels.encode import encode
from dnnvss.labels.scaling import NumericScaler
from dnnvss.labels.store import CodeStore
from dnnvss.labels.table import FeatureTable

__all__ = ["Block", "CodeStore", "FeatureTable", "FrameCodes", "NumericScaler", "Settings", "catalogue", "encode",
           "expand"]
