"""The mouth's gauges of a face whose points are linear in its parameters."""

import numpy as np

from dnnvss.face.base import APERTURE, LOWER_LIP, WIDTH, Gauge


def mouth_gauges(
    mean: np.ndarray, modes: np.ndarray, outer: np.ndarray, inner: np.ndarray, unit: str = "px"
) -> dict[str, Gauge]:
    """Aperture, lower lip and width of a mouth, by name.

    ``aperture`` is the distance between the centres of the inner lips, negative where they cross. ``lower_lip`` is the
    y of the lower lip's inner edge in the reference frame, larger is lower: the frame stands still against the upper
    teeth, so this tells contact on f and v better than the aperture, which the upper lip moves too. ``width`` is the
    horizontal distance between the corners.

    Args:
        mean: points (P, 2 or 3) at parameters of zero, an upright mouth with y downward.
        modes: how they move with each parameter (D, P, 2 or 3).
        outer, inner: positions of the lips' contours among the P points, in order round the mouth.
        unit: of the points.
    """
    pairs, middle = lip_pairs(mean, inner)
    upper, lower = (int(i) for i in pairs[middle])
    x = mean[outer, 0]
    corners = int(outer[x.argmin()]), int(outer[x.argmax()])

    def between(name: str, first: int, second: int, axis: int) -> Gauge:
        vector = modes[:, second, axis] - modes[:, first, axis]
        return Gauge(name, vector, float(mean[second, axis] - mean[first, axis]), unit)

    lip = Gauge(LOWER_LIP, modes[:, lower, 1], float(mean[lower, 1]), unit)
    return {APERTURE: between(APERTURE, upper, lower, 1), LOWER_LIP: lip, WIDTH: between(WIDTH, *corners, 0)}


def lip_pairs(shape: np.ndarray, inner: np.ndarray) -> tuple[np.ndarray, int]:
    """Pairs (n, 2) of inner-lip points, upper and the lower one under it, and which pair is in the middle.

    Args:
        shape: points (P, 2 or 3) with an upright mouth.
        inner: positions of the inner contour among the P points, in order round the mouth.
    """
    contour = shape[inner]
    first, second = sorted((int(contour[:, 0].argmin()), int(contour[:, 0].argmax())))
    ring = np.arange(len(inner))
    chains = [ring[(ring > first) & (ring < second)], ring[(ring < first) | (ring > second)]]
    upper, lower = sorted(chains, key=lambda chain: contour[chain, 1].mean())
    across = np.abs(contour[upper, 0][:, None] - contour[lower, 0]).argmin(axis=1)
    middle = int(np.abs(contour[upper, 0] - contour[[first, second], 0].mean()).argmin())
    return np.column_stack([inner[upper], inner[lower[across]]]), middle


def parted(shapes: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Shapes (..., P, 2) in which lips that would pass through each other meet half way.

    Args:
        shapes: points with y downward.
        pairs: upper and lower points (n, 2) that face each other (see :func:`lip_pairs`).
    """
    shapes = shapes.copy()
    for upper, lower in pairs:
        crossed = np.maximum(shapes[..., upper, 1] - shapes[..., lower, 1], 0) / 2
        shapes[..., upper, 1] -= crossed
        shapes[..., lower, 1] += crossed
    return shapes
