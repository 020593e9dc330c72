"""The active appearance model: shape and texture of a talking mouth as a few parameters a frame."""

from dnnvss.aam.clips import Clip, ClipCode, corpus_clips
from dnnvss.aam.coding import encode_clip, reconstruct
from dnnvss.aam.config import AAMConfig
from dnnvss.aam.encoding import EncodedCorpus, encode_corpus
from dnnvss.aam.fit import fit_aam
from dnnvss.aam.mesh import Warp, triangulate
from dnnvss.aam.model import ActiveAppearanceModel, Functional
from dnnvss.aam.points import Layout, PointSet

__all__ = ["AAMConfig", "ActiveAppearanceModel", "Clip", "ClipCode", "EncodedCorpus", "Functional", "Layout",
           "PointSet", "Warp", "corpus_clips", "encode_clip", "encode_corpus", "fit_aam", "reconstruct", "triangulate"]
