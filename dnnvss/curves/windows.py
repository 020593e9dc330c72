"""Delta windows, and the one edge rule that deltas and parameter generation share."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from dnnvss.errors import DnnvssError

if TYPE_CHECKING:
    import torch

Array = TypeVar("Array", np.ndarray, "torch.Tensor")


@dataclass(frozen=True)
class Windows:
    """The streams of a target, each a weighted sum of neighbouring static frames.

    Stream ``w`` of frame ``t`` is ``sum over s of taps[w][s + reach] * x[t + s]``. **Edges are held**: where ``t + s``
    falls before the first or behind the last frame, that frame stands in. The same rule builds the deltas of the
    targets and the equations of :func:`dnnvss.curves.mlpg.mlpg`.

    Args:
        names: the name of each stream; the first is the static one.
        taps: the weights of each stream, an odd number, the middle one for the frame itself.

    Raises:
        DnnvssError: an even number of weights, weights that are not finite, or a first stream that is not ``(1,)``.
    """

    names: tuple[str, ...]
    taps: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        if len(self.names) != len(self.taps) or len(set(self.names)) != len(self.names):
            raise DnnvssError(f"{len(self.taps)} windows have the names {self.names}", remedy="Name each window once")
        if not self.taps or tuple(self.taps[0]) != (1.0,):
            raise DnnvssError(f"the first window is {self.taps[:1]}", remedy="Let the first stream be static: (1.0,)")
        for name, taps in zip(self.names, self.taps, strict=True):
            if len(taps) % 2 == 0 or not np.isfinite(taps).all():
                raise DnnvssError(f"window {name!r} has the weights {taps}", remedy="Give an odd number of finite ones")

    def __len__(self) -> int:
        return len(self.taps)

    def first(self, count: int) -> "Windows":
        """The first streams alone.

        Raises:
            DnnvssError: there are not so many.
        """
        if not 1 <= count <= len(self):
            raise DnnvssError(f"{count} of {len(self)} streams are asked for", remedy=f"Use {', '.join(self.names)}")
        return Windows(self.names[:count], self.taps[:count])

    @classmethod
    def named(cls, name: str) -> "Windows":
        """Return ``static``, ``static_delta`` or ``static_delta_delta2``.

        Raises:
            DnnvssError: another name.
        """
        known = {"_".join(windows.names): windows for windows in (STATIC, STATIC_DELTA, STATIC_DELTA_DELTA2)}
        if name not in known:
            raise DnnvssError(f"no windows are named {name!r}", remedy=f"Use one of: {', '.join(known)}")
        return known[name]

    @property
    def reach(self) -> int:
        """How many frames to each side the widest window looks."""
        return max(len(taps) // 2 for taps in self.taps)

    def weights(self, stream: int) -> list[tuple[int, float]]:
        """Return the offsets in frames and the weights of one stream; weights of zero are left out."""
        taps = self.taps[stream]
        return [(s - len(taps) // 2, weight) for s, weight in enumerate(taps) if weight]


STATIC = Windows(("static",), ((1.0,),))
"""The static stream alone."""

STATIC_DELTA = Windows(("static", "delta"), ((1.0,), (-0.5, 0.0, 0.5)))
"""Static and first derivative (central difference, per frame)."""

STATIC_DELTA_DELTA2 = Windows(("static", "delta", "delta2"), ((1.0,), (-0.5, 0.0, 0.5), (1.0, -2.0, 1.0)))
"""Static, first and second derivative (central differences, per frame and per frame squared)."""


def derivatives(static: Array, windows: Windows = STATIC_DELTA_DELTA2, lengths: Array | None = None) -> Array:
    """Return all streams of a trajectory, shape (..., T, W, D), of the kind and dtype of the input.

    Args:
        static: trajectory (..., T, D), T at least 1; numpy or torch (differentiable).
        windows: the streams.
        lengths: for a padded batch (B, T, D), the number of true frames of each row, shape (B,); the last true frame
            is held.

    Raises:
        DnnvssError: there is no frame.
    """
    if static.ndim < 2 or static.shape[-2] < 1:
        raise DnnvssError(f"a trajectory of shape {tuple(static.shape)} has no frame", remedy="Give at least one frame")
    if not isinstance(static, np.ndarray):
        return _of_tensor(static, windows, lengths)
    x: Any = static
    frames, reach = x.shape[-2], windows.reach
    if not np.issubdtype(x.dtype, np.floating):
        x = x.astype(float)
    index = np.arange(-reach, frames + reach)
    if lengths is None:
        held = x.take(index.clip(0, frames - 1), axis=-2)
    else:
        last = np.asarray(lengths)[:, None] - 1
        held = np.take_along_axis(x, np.minimum(index.clip(0), last)[..., None], axis=-2)
    streams = np.zeros((*x.shape[:-1], len(windows), x.shape[-1]), x.dtype)
    for w in range(len(windows)):
        for s, weight in windows.weights(w):
            streams[..., w, :] += weight * held[..., reach + s : reach + s + frames, :]
    return streams


def _of_tensor(x: "torch.Tensor", windows: Windows, lengths: Any) -> "torch.Tensor":
    """Return the streams of a tensor, with gradients."""
    import torch  # only a tensor brings us here, so torch is loaded already

    frames, reach = x.shape[-2], windows.reach
    index = torch.arange(-reach, frames + reach, device=x.device)
    if lengths is None:
        held = x.index_select(-2, index.clamp(0, frames - 1))
    else:
        last = torch.as_tensor(lengths, device=x.device)[:, None] - 1
        held = torch.take_along_dim(x, torch.minimum(index.clamp(min=0), last)[..., None], dim=-2)
    streams = []
    for w in range(len(windows)):
        shifted = [weight * held.narrow(-2, reach + s, frames) for s, weight in windows.weights(w)]
        streams.append(sum(shifted[1:], shifted[0]) if shifted else torch.zeros_like(x))
    return torch.stack(streams, dim=-2)
