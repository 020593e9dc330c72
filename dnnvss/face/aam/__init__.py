"""The active appearance model: shape and texture of a talking mouth as a few parameters a frame."""

from dnnvss.face.aam.clips import Clip, ClipCode, corpus_clips
from dnnvss.face.aam.coding import encode_clip, reconstruct
from dnnvss.face.aam.config import AAMConfig
from dnnvss.face.aam.encoding import EncodedCorpus, encode_corpus
from dnnvss.face.aam.fit import fit_aam
from dnnvss.face.aam.mesh import Warp, triangulate
from dnnvss.face.aam.model import ActiveAppearanceModel
from dnnvss.face.aam.points import Layout, PointSet

__all__ = ["AAMConfig", "ActiveAppearanceModel", "Clip", "ClipCode", "EncodedCorpus", "Layout", "PointSet",
           "Warp", "corpus_clips", "encode_clip", "encode_corpus", "fit_aam", "reconstruct", "triangulate"]
