"""Names of the points of the face mesh: which ones run round the lips, the eyes, the brows and the face."""

from itertools import pairwise

import numpy as np

RIGHT_CORNER, LEFT_CORNER = 33, 263
"""The outer corners of the talker's right and left eye."""

UPPER_LIP, LOWER_LIP = 13, 14
"""The middle of the inner lips."""

_MESH: dict[str, tuple[int, ...]] = {
    "face_oval": (10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152, 148,
                  176, 149, 150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109),
    "lips_outer": (61, 185, 40, 39, 37, 0, 267, 269, 270, 409, 291, 375, 321, 405, 314, 17, 84, 181, 91, 146),
    "lips_inner": (78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308, 324, 318, 402, 317, 14, 87, 178, 88, 95),
    "nose_base": (129, 98, 97, 2, 326, 327, 358),
    "nose_bridge": (168, 6, 197, 195, 5, 4, 1),
    "nostril_wings": (48, 64, 278, 294),
    "right_eye": (33, 7, 163, 144, 145, 153, 154, 155, 133, 173, 157, 158, 159, 160, 161, 246),
    "left_eye": (362, 382, 381, 380, 374, 373, 390, 249, 263, 466, 388, 387, 386, 385, 384, 398),
    "right_brow": (46, 53, 52, 65, 55, 70, 63, 105, 66, 107),
    "left_brow": (276, 283, 282, 295, 285, 300, 293, 334, 296, 336),
}
"""Group to points of the mesh, along the contour."""

ROWS = np.concatenate([np.array(points) for points in _MESH.values()])
"""The points (146,) that a corpus keeps of the mesh, in the order of their groups."""


def mesh_groups() -> dict[str, tuple[int, int]]:
    """Group to the half-open range of its rows, once :data:`ROWS` are taken of the mesh."""
    ends = np.cumsum([0, *map(len, _MESH.values())]).tolist()
    return dict(zip(_MESH, pairwise(ends), strict=True))
