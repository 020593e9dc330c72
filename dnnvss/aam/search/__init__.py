"""Search: the model finds the points of every frame, from about thirty frames labelled by hand."""

from dnnvss.aam.search.bootstrap import Frames, Labelled, gather, retrain
from dnnvss.aam.search.choose import Choice, choose_frames
from dnnvss.aam.search.find import Found, detect, search
from dnnvss.aam.search.fit import fit_search
from dnnvss.aam.search.model import Limits, SearchModel, SearchSettings
from dnnvss.aam.search.track import FLAGS, Track, track

__all__ = ["FLAGS", "Choice", "Found", "Frames", "Labelled", "Limits", "SearchModel", "SearchSettings", "Track",
           "choose_frames", "detect", "fit_search", "gather", "retrain", "search", "track"]
