"""A head as a surface in space: the one that ships, others from files, and what moves them."""

from dnnvss.face.mesh.head import Head, packaged_head
from dnnvss.face.mesh.surface import Mesh

__all__ = ["Head", "Mesh", "packaged_head"]
