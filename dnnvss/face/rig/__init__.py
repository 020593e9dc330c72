"""A rig: a face whose parameters are the curves that an artist knows by name, with their ranges."""

from dnnvss.face.rig.code import RigCode
from dnnvss.face.rig.fit import encode_rig, fit_rig
from dnnvss.face.rig.model import RigFace
from dnnvss.face.rig.settings import RigSettings

__all__ = ["RigCode", "RigFace", "RigSettings", "encode_rig", "fit_rig"]
