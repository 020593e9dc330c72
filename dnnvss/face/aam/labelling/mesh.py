"""Points of a scheme on the mesh that the landmarker finds: each line laid along a line of the mesh."""

import numpy as np

from dnnvss.face.aam.labelling.schemes import Scheme

_UPPER_LIP, _LOWER_LIP = ((61, 185, 40, 39, 37, 0, 267, 269, 270, 409, 291),
                          (291, 375, 321, 405, 314, 17, 84, 181, 91, 146, 61))
_UPPER_INNER, _LOWER_INNER = ((78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308),
                              (308, 324, 318, 402, 317, 14, 87, 178, 88, 95, 78))
_JAW = (58, 172, 136, 150, 149, 176, 148, 152, 377, 400, 378, 379, 365, 397, 288)

_LINES: dict[str, tuple[tuple[int, ...], ...]] = {
    "lips_outer": (_UPPER_LIP, _LOWER_LIP),
    "lips_inner": (_UPPER_INNER, _LOWER_INNER),
    "jaw": (_JAW,),
    "face_oval": ((234, 93, 132, *_JAW, 361, 323, 454),),
    "right_eye": ((33, 246, 161, 160, 159, 158, 157, 173, 133), (133, 155, 154, 153, 145, 144, 163, 7, 33)),
    "left_eye": ((362, 398, 384, 385, 386, 387, 388, 466, 263), (263, 249, 390, 373, 374, 380, 381, 382, 362)),
    "right_brow": ((70, 63, 105, 66, 107),),
    "left_brow": ((336, 296, 334, 293, 300),),
    "nose_bridge": ((168, 6, 197, 195, 5, 4),),
    "nose_base": ((129, 98, 97, 2, 326, 327, 358),),
}
"""Points of the mesh along each group, from the left of the picture: one line, or over the top and back below."""

_SHORT: dict[tuple[str, int], tuple[tuple[int, ...], ...]] = {
    ("right_eye", 2): ((33, 133),),
    ("left_eye", 2): ((362, 263),),
    ("nose_bridge", 2): ((168, 6, 197),),
    ("nose_base", 5): ((98, 97, 2, 326, 327),),
}
"""Groups of which a scheme has but a part."""


def on_mesh(scheme: Scheme, mesh: np.ndarray) -> np.ndarray:
    """A scheme's points (P, 2) on a face whose mesh (478, 2) is known, evenly spaced along each line."""
    parts = []
    for group in scheme.parts:
        count = len(group.layout)
        lines = _SHORT.get((group.name, count), _LINES[group.name])
        if len(lines) == 1:
            parts.append(_spaced(mesh[list(lines[0])], count))
        else:  # a ring: its corners are points of both halves, and each is given once
            halves = [_spaced(mesh[list(line)], count // 2 + 1)[:-1] for line in lines]
            parts.append(np.concatenate(halves))
    return np.concatenate(parts).astype(float)


def _spaced(line: np.ndarray, count: int) -> np.ndarray:
    """So many points (count, 2) on a line (n, 2), equally far from each other along it, from end to end."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    at = np.linspace(0, along[-1], count)
    return np.column_stack([np.interp(at, along, axis) for axis in line.T])
