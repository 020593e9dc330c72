"""The active appearance model as a kind of face."""

from dnnvss.face.aam.code import ClipCode
from dnnvss.face.aam.coding import clip_errors, measure_clip
from dnnvss.face.aam.config import AAMConfig
from dnnvss.face.aam.fit import fit_aam
from dnnvss.face.aam.model import ActiveAppearanceModel
from dnnvss.face.aam.report import build_report
from dnnvss.face.clips import Clip
from dnnvss.face.kinds import Encoded, FaceKind


def encode(model: ActiveAppearanceModel, clip: Clip) -> Encoded:
    """The code of a clip, and its errors of reconstruction."""
    measured = measure_clip(model, clip)
    return Encoded(measured.code, {"errors": clip_errors(model, measured)})


KIND = FaceKind(
    ActiveAppearanceModel.kind, version=6, read=AAMConfig.from_dict, plain=AAMConfig.to_dict, fit=fit_aam,
    encode=encode, report=build_report, stabilise=ActiveAppearanceModel.stabilise, load=ActiveAppearanceModel.load,
    load_code=ClipCode.load)
