"""Landmarks or markers without texture, in the plane or in space, as a few parameters a frame."""

from dnnvss.face.points.code import PointsCode
from dnnvss.face.points.fit import fit_points
from dnnvss.face.points.model import PointsFace
from dnnvss.face.points.settings import PointsSettings

__all__ = ["PointsCode", "PointsFace", "PointsSettings", "fit_points"]
