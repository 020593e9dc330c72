"""Points on faces without hand labels: a detector for everybody.

The nets are in ``face_landmarker.task``, which the user names or a package brings; see :func:`find_task`.
"""

from dnnvss.face.landmarker.engines import engine
from dnnvss.face.landmarker.follow import SURE, Track, as_arrays, follow, talker
from dnnvss.face.landmarker.layout import ROWS, mesh_groups
from dnnvss.face.landmarker.nets import Landmarker, Region
from dnnvss.face.landmarker.task import find_task

__all__ = ["ROWS", "SURE", "Landmarker", "Region", "Track", "as_arrays", "engine", "find_task", "follow",
           "mesh_groups", "talker"]
