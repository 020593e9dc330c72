"""The systems of :mod:`dnnvss.curves.banded` on an accelerator, in torch."""

import torch

from dnnvss.curves.padding import SINGULAR, inner, undetermined


class CyclicReduction:
    """Block cyclic reduction in torch: log2(T) steps, each parallel over frames and columns, for accelerators.

    Frames are taken K at a time, so that the matrix is block tridiagonal with K x K blocks. Each level removes every
    second block.

    **Source**: Buzbee, Golub and Nielson, On direct methods for solving Poisson's equations (1970), section 2, for
        blocks that vary.
    """

    def __init__(self, bands: torch.Tensor) -> None:
        self.reach = len(bands) - 1
        self.size = max(self.reach, 1)
        self.shape = bands.shape[1:]
        diagonal, lower = _blocks(bands, self.size)
        self.levels = []
        while diagonal.shape[0] > 1:
            odd, even = diagonal[1::2], diagonal[::2].clone()
            inverse = self._inverse(odd)
            # `left` couples an odd block to the even one before it, `right` to the even one behind it.
            left, right = lower[1::2], lower[2::2].transpose(-1, -2)
            to_left, to_right = inverse @ left, inverse[: len(right)] @ right
            even[: len(odd)] -= left.transpose(-1, -2) @ to_left
            even[1 : len(right) + 1] -= right.transpose(-1, -2) @ to_right
            coupling = torch.zeros_like(even)
            coupling[1 : len(right) + 1] = -right.transpose(-1, -2) @ to_left[: len(right)]
            self.levels.append((inverse, to_left, to_right))
            diagonal, lower = even, coupling
        self.last = self._inverse(diagonal)

    def _inverse(self, blocks: torch.Tensor) -> torch.Tensor:
        factor, info = torch.linalg.cholesky_ex(blocks)
        own = torch.diagonal(blocks, dim1=-2, dim2=-1)
        weak = torch.diagonal(factor, dim1=-2, dim2=-1) ** 2 < SINGULAR * own
        if bool(info.any() | weak.any()):
            block, b, d = (torch.nonzero(info > 0) if info.any() else torch.nonzero(weak)[:, :3])[0].tolist()
            raise undetermined((block * self.size, b, d))
        return torch.cholesky_inverse(factor)

    def solve(self, padded: torch.Tensor) -> torch.Tensor:
        """Return the solutions (T, B, D)."""
        rhs = inner(padded, self.reach)
        frames, batch, columns = rhs.shape
        count = -(-frames // self.size)
        r = rhs.new_zeros(count * self.size, batch, columns)
        r[:frames] = rhs
        r = r.view(count, self.size, batch, columns).permute(0, 2, 3, 1)[..., None]
        kept = []
        for _, to_left, to_right in self.levels:
            odd, even = r[1::2], r[::2].clone()
            even[: len(odd)] -= to_left.transpose(-1, -2) @ odd
            even[1 : len(to_right) + 1] -= to_right.transpose(-1, -2) @ odd[: len(to_right)]
            kept.append(odd)
            r = even
        x = self.last @ r
        for (inverse, to_left, to_right), odd in zip(reversed(self.levels), reversed(kept), strict=True):
            between = inverse @ odd - to_left @ x[: len(odd)]
            between[: len(to_right)] -= to_right @ x[1 : len(to_right) + 1]
            merged = x.new_empty(len(x) + len(between), *x.shape[1:])
            merged[::2], merged[1::2] = x, between
            x = merged
        return x[..., 0].permute(0, 3, 1, 2).reshape(count * self.size, batch, columns)[:frames]


def _blocks(bands: torch.Tensor, size: int) -> tuple[torch.Tensor, torch.Tensor]:
    """Return diagonal blocks and the blocks left of them, each (blocks, B, D, K, K), of the padded matrix."""
    width, frames, batch, columns = bands.shape
    count = -(-frames // size)
    padded = bands.new_zeros(width, (count + 1) * size, batch, columns)
    padded[:, size : size + frames] = bands  # one empty block in front: the first block has nothing to its left
    padded[0, size + frames :] = 1.0
    grid = padded.view(width, count + 1, size, batch, columns)
    diagonal = bands.new_zeros(count, batch, columns, size, size)
    lower = torch.zeros_like(diagonal)
    for i in range(size):
        for j in range(size):
            if abs(i - j) < width:
                diagonal[..., i, j] = grid[abs(i - j), 1:, min(i, j)]
            if size + i - j < width:
                lower[..., i, j] = grid[size + i - j, :-1, j]
    return diagonal, lower
