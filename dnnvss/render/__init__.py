"""Pictures and sound: the talking face, video files, and plots."""

from dnnvss.render.neutral import Neutral, choose_neutral
from dnnvss.render.renderer import Renderer
from dnnvss.render.video import write_video

__all__ = ["Neutral", "Renderer", "choose_neutral", "write_video"]
