"""Labels by hand: named schemes of points, starting guesses, folders of labelled frames, other tools' files."""

from dnnvss.face.aam.labelling.schemes import SCHEMES, Scheme
from dnnvss.face.aam.labelling.sheet import Label, Sheet

__all__ = ["SCHEMES", "Label", "Scheme", "Sheet"]
