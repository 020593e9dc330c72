"""The active appearance model: shape and texture of a talking mouth as a few parameters a frame."""

from dnnvss.face.aam.code import ClipCode
from dnnvss.face.aam.coding import encode_clip, reconstruct
from dnnvss.face.aam.config import AAMConfig
from dnnvss.face.aam.fit import fit_aam
from dnnvss.face.aam.mesh import Warp, triangulate
from dnnvss.face.aam.model import ActiveAppearanceModel
from dnnvss.face.point_set import Layout, PointSet

__all__ = ["AAMConfig", "ActiveAppearanceModel", "ClipCode", "Layout", "PointSet", "Warp", "encode_clip", "fit_aam",
           "reconstruct", "triangulate"]
