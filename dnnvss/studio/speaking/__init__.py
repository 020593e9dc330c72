"""The page on which one types or speaks and a face answers, and the service under it."""

from dnnvss.studio.speaking.desk import SpeakingDesk
from dnnvss.studio.speaking.saying import Change, Saying

__all__ = ["Change", "Saying", "SpeakingDesk"]
