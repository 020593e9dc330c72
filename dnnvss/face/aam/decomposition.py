"""The modes of shape and texture, together or side by side."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.face.aam.config import AAMConfig
from dnnvss.face.aam.parts import Support
from dnnvss.face.pca import components

_CHUNK = 256


@dataclass(frozen=True)
class Modes:
    """Modes of shape (D, 2P) and texture (D, 3N) float32, and what the frames of the fit measure on them.

    Args:
        shape, texture: the modes; ``[shape_weight * shape, texture]`` is orthonormal.
        shape_weight: weight of a shape coordinate against a grey level.
        deviations: standard deviation (D,) of each parameter.
        residuals: RMS grey levels (n,) of texture that the modes leave out, of each frame.
        sizes: RMS of the parameters (n,) in deviations, of each frame.
        parameters: of each frame (n, D).
    """

    shape: np.ndarray
    texture: np.ndarray
    shape_weight: float
    deviations: np.ndarray
    residuals: np.ndarray
    sizes: np.ndarray
    parameters: np.ndarray


def find_modes(rows: np.ndarray, width: int, config: AAMConfig, supports: Sequence[Support] = ()) -> Modes:
    """Return the modes of centred rows (n, width + 3N), the first ``width`` columns shape, the others texture.

    Combined: principal components of shape times ``w`` beside texture, ``w = shape_weight *
    sqrt(texture variance / shape variance)``. Separate: components of each, shape first, and ``w`` is 1. With
    ``supports`` each part has modes of its own, zero outside its columns, one part after the other; they share ``w``.
    ``rows`` is weighted in place.

    Raises:
        DnnvssError: the rows do not differ, so that there is no mode.
    """
    weight = 1.0 if config.kind == "separate" else config.shape_weight * _balance(rows, width)
    rows[:, :width] *= weight
    if supports:
        joint, deviations = _by_parts(rows, width, config, supports)
    else:
        joint, deviations = _joint(rows, width, config, config.modes)
    if not len(joint):
        raise DnnvssError(f"the face model has nothing to learn: its textures were read from {len(rows)} frames, which "
                          "do not differ", remedy="Give more clips or longer ones, or lower aam.texture_every")
    texture = np.ascontiguousarray(joint[:, width:], dtype=np.float32)
    parameters = rows @ joint.T.astype(np.float32)
    residuals = [np.sqrt(((rows[i:i + _CHUNK, width:] - parameters[i:i + _CHUNK] @ texture) ** 2).mean(axis=1))
                 for i in range(0, len(rows), _CHUNK)]
    sizes = np.sqrt(((parameters / deviations) ** 2).mean(axis=1))
    return Modes(joint[:, :width].astype(np.float64) / weight, texture, weight, deviations, np.concatenate(residuals),
                 sizes, parameters)


def _joint(rows: np.ndarray, width: int, config: AAMConfig, modes: float) -> tuple[np.ndarray, np.ndarray]:
    if config.kind == "separate":
        return _side_by_side(rows, width, config)
    both = components(rows, modes, config.seed)
    return both.modes, both.deviations


def _by_parts(rows: np.ndarray, width: int, config: AAMConfig, parts: Sequence[Support]
              ) -> tuple[np.ndarray, np.ndarray]:
    found = []
    for part in parts:
        columns = np.concatenate([part.shape, width + part.texture])
        modes, deviations = _joint(rows[:, columns], len(part.shape), config, part.modes or config.modes)
        spread = np.zeros((len(modes), rows.shape[1]), dtype=np.float32)
        spread[:, columns] = modes
        found.append((spread, deviations))
    return np.concatenate([m for m, _ in found]), np.concatenate([d for _, d in found])


def _balance(rows: np.ndarray, width: int) -> float:
    """Return the square root of the variance of texture over that of shape."""
    shape, texture = (np.einsum("fm,fm->", part, part, dtype=np.float64) for part in (rows[:, :width], rows[:, width:]))
    return float(np.sqrt(texture / max(shape, 1e-12)))


def _side_by_side(rows: np.ndarray, width: int, config: AAMConfig) -> tuple[np.ndarray, np.ndarray]:
    shape = components(rows[:, :width], config.shape_modes, config.seed)
    texture = components(rows[:, width:], config.texture_modes, config.seed)
    joint = np.zeros((len(shape.modes) + len(texture.modes), rows.shape[1]), dtype=np.float32)
    joint[:len(shape.modes), :width], joint[len(shape.modes):, width:] = shape.modes, texture.modes
    return joint, np.concatenate([shape.deviations, texture.deviations])
