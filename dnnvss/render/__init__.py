"""Pictures and sound: the talking face, video files, and plots."""

from dnnvss.render.footage import Footage, Revoicer, walk
from dnnvss.render.neutral import Neutral, choose_neutral
from dnnvss.render.renderer import Renderer
from dnnvss.render.video import write_video

__all__ = ["Footage", "Neutral", "Renderer", "Revoicer", "choose_neutral", "walk", "write_video"]
