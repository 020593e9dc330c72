"""Search: the model finds the points of every frame, from about thirty frames labelled by hand."""

from dnnvss.face.aam.search.bootstrap import Frames, Labelled, gather, retrain
from dnnvss.face.aam.search.choose import ChosenFrame, choose_frames
from dnnvss.face.aam.search.find import Found, detect, search
from dnnvss.face.aam.search.fit import fit_search
from dnnvss.face.aam.search.model import SearchLimits, SearchModel, SearchSettings
from dnnvss.face.aam.search.track import FLAGS, Track, track

__all__ = ["FLAGS", "ChosenFrame", "Found", "Frames", "Labelled", "SearchLimits", "SearchModel", "SearchSettings",
           "Track", "choose_frames", "detect", "fit_search", "gather", "retrain", "search", "track"]
