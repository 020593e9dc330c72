"""Visual speech synthesis: text to a talking face.

The rooms of the package stand in the order in which data walks through them; see ``docs/design.md``.
"""

from dnnvss.errors import DnnvssError

__all__ = ["DnnvssError"]
__version__ = "0.2.0"
