"""A rig as a kind of face."""

from dnnvss.face.clips import Clip
from dnnvss.face.kinds import Encoded, FaceKind
from dnnvss.face.rig.code import RigCode
from dnnvss.face.rig.fit import build_report, encode_rig, fit_rig, stabilise
from dnnvss.face.rig.model import RigFace
from dnnvss.face.rig.settings import RigSettings


def encode(face: RigFace, clip: Clip) -> Encoded:
    """The code of a take."""
    return Encoded(encode_rig(face, clip))


LACKS = (
    "The face is a rig: its curves are what is predicted and measured, in their own units. Its pictures are "
    "bars; a mesh with the rig's shapes shows a head."
)

KIND = FaceKind(
    RigFace.kind,
    version=1,
    read=RigSettings.from_dict,
    plain=RigSettings.to_dict,
    fit=fit_rig,
    encode=encode,
    report=build_report,
    stabilise=stabilise,
    load=RigFace.load,
    load_code=RigCode.load,
    pictures=False,
    lacks=LACKS,
)
