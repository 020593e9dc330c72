"""Pictures of the talking face, and plots."""

from dnnvss.render.footage import Footage, Revoicer, revoicer, walk
from dnnvss.render.neutral import Neutral, choose_neutral
from dnnvss.render.renderer import Renderer

__all__ = ["Footage", "Neutral", "Renderer", "Revoicer", "choose_neutral", "revoicer", "walk"]
