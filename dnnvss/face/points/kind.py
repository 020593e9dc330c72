"""Points as a kind of face."""

from dnnvss.face.clips import Clip
from dnnvss.face.kinds import Encoded, FaceKind
from dnnvss.face.points.code import PointsCode
from dnnvss.face.points.coding import encode_points, point_errors
from dnnvss.face.points.fit import fit_points
from dnnvss.face.points.model import PointsFace
from dnnvss.face.points.report import build_report
from dnnvss.face.points.settings import PointsSettings


def encode(face: PointsFace, clip: Clip) -> Encoded:
    """The code of a clip, and its errors of reconstruction."""
    code, shapes = encode_points(face, clip)
    return Encoded(code, {"errors": point_errors(face, code, shapes)})


LACKS = ("The face is made of points alone: its pictures are drawings of them. Skin, teeth, tongue and light are not "
         "shown, gaze is not known, and render=patch, render=reference and into=FOOTAGE need face=aam.")

KIND = FaceKind(
    PointsFace.kind, version=2, read=PointsSettings.from_dict, plain=PointsSettings.to_dict, fit=fit_points,
    encode=encode, report=build_report, stabilise=PointsFace.stabilise, load=PointsFace.load,
    load_code=PointsCode.load, pictures=False, lacks=LACKS)
