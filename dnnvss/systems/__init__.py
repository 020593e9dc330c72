"""Systems that predict the parameters of a face, behind one base class. Knows nothing of files or rendering.

What every system shares is here; each system is in a module of its own, so that who speaks with one loads no other.
"""

from dnnvss.systems.base import READABLE, Example, Prediction, VisualModel

__all__ = ["READABLE", "Example", "Prediction", "VisualModel"]
