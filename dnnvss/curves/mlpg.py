"""Maximum-likelihood parameter generation: the smooth trajectory that the predicted streams make most likely."""

from typing import Any

import numpy as np

from dnnvss.curves.equations import NormalEquations, precision_of
from dnnvss.curves.windows import STATIC_DELTA_DELTA2, Array, Windows
from dnnvss.errors import DnnvssError


def mlpg(
    mean: Array,
    variance: Array | float,
    windows: Windows = STATIC_DELTA_DELTA2,
    lengths: Array | list[int] | None = None,
    equations: NormalEquations | None = None,
) -> Array:
    """Return the most likely trajectory, shape (..., T, D), of the kind, dtype and device of ``mean``.

    Each column ``d`` is solved on its own from the normal equations

    ``(W' V^-1 W) x = W' V^-1 m``,

    where ``W`` stacks the windows with held edges (:class:`Windows`), ``m`` the means and ``V`` the diagonal of
    variances. The matrix has twice the windows' reach in bands beside its diagonal, so time and memory are linear in
    T. The equations are solved in float64 whatever the dtype. Gradients flow to means and variances (first order).

    Args:
        mean: predicted streams (..., T, W, D), numpy or torch.
        variance: variances that broadcast to ``mean``, e.g. (W, D), (T, W, D) or (B, 1, W, D); infinite means "says
            nothing".
        windows: the streams, W of them.
        lengths: for a padded batch (B, T, W, D), the number of true frames of each row, shape (B,). Frames behind it
            may hold anything and come back as zeros; each row equals its solution alone.
        equations: of the same variances, where several solves share them; arrays alone.

    Raises:
        DnnvssError: shapes that do not fit, no frames, means that are not finite, variances that are NaN, zero or
            negative, or so many infinite variances that a frame is not determined.

    **Source**: Tokuda et al., Speech parameter generation algorithms for HMM-based speech synthesis (2000), section
    3.1, equation 13; Thangthai et al. 2016, section 2.
    """
    given: Any = mean
    _check_shapes(given, windows)
    shape = tuple(given.shape)
    batched = given.reshape(-1, *shape[-3:])
    counts = _check_lengths(lengths, batched) if lengths is not None else None
    made: Any
    if isinstance(given, np.ndarray):
        if equations is None:
            equations = NormalEquations(precision_of(variance, shape, counts), windows, counts, batched.shape)
        made = equations.trajectory(batched).reshape(*shape[:-2], shape[-1]).astype(given.dtype)
    else:
        from dnnvss.curves import tensors

        made = tensors.mlpg(given, variance, windows, counts).reshape(*shape[:-2], shape[-1]).to(given.dtype)
    return made


def _check_shapes(mean: Any, windows: Windows) -> None:
    if mean.ndim < 3 or mean.shape[-2] != len(windows) or 0 in mean.shape:
        raise DnnvssError(
            f"means have the shape {tuple(mean.shape)}, not (frames, {len(windows)} streams, parameters)",
            remedy=f"Give one frame or more of the streams {', '.join(windows.names)}, or other windows",
        )
    if "float" not in str(mean.dtype):
        raise DnnvssError(f"means are {mean.dtype}", remedy="Give floating-point means")


def _check_lengths(lengths: Any, mean: Any) -> np.ndarray:
    counts = np.asarray(lengths.cpu() if hasattr(lengths, "cpu") else lengths)
    if counts.shape != tuple(mean.shape[:1]) or ((counts < 1) | (counts > mean.shape[1])).any():
        raise DnnvssError(f"lengths {counts.tolist()} do not fit {mean.shape[0]} rows of {mean.shape[1]} frames",
                          remedy="Give each row a length between 1 and the padded number of frames")
    return counts.astype(np.int64)
