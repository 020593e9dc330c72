"""Search: the model finds the points of every frame, from about thirty frames labelled by hand."""

from dnnvss.aam.search.choose import Choice, choose_frames

__all__ = ["Choice", "choose_frames"]
