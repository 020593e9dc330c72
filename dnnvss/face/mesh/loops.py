"""Loops of edges in a surface of quadrangles: straight on through every corner of four edges."""

from collections import defaultdict
from collections.abc import Collection, Iterable

import numpy as np


class EdgeLoops:
    """The neighbours of vertices over edges, and the loops that edges form.

    Args:
        faces: corners (N, 4).
    """

    def __init__(self, faces: np.ndarray) -> None:
        self.neighbours: dict[int, set[int]] = defaultdict(set)
        self.of_edge: dict[frozenset[int], set[int]] = defaultdict(set)
        for k, face in enumerate(faces.tolist()):
            for a, b in zip(face, face[1:] + face[:1], strict=True):
                self.neighbours[a].add(b)
                self.neighbours[b].add(a)
                self.of_edge[frozenset((a, b))].add(k)

    def ring(self, start: int, most: int = 200) -> list[int]:
        """The shortest closed loop through a vertex.

        Raises:
            ValueError: none closes within ``most`` edges.
        """
        walks = (self._walk(start, n, most) for n in self.neighbours[start])
        return min((walk for walk in walks if walk), key=len)

    def _walk(self, first: int, second: int, most: int) -> list[int] | None:
        path = [first, second]
        while len(path) < most:
            before, here = path[-2:]
            beside = self.of_edge[frozenset((before, here))]
            ahead = [
                n
                for n in self.neighbours[here]
                if n != before and not self.of_edge[frozenset((here, n))] & beside
            ]
            if len(self.neighbours[here]) != 4 or len(ahead) != 1:
                return None
            if ahead[0] == first:
                return path
            path.append(ahead[0])
        return None

    def inside(self, start: int, border: Collection[int]) -> set[int]:
        """The vertices that are reached from one without crossing a border."""
        found, ahead = {start}, [start]
        while ahead:
            fresh = {n for n in self.neighbours[ahead.pop()] if n not in border} - found
            found |= fresh
            ahead += fresh
        return found

    def behind(self, at: int, towards: int) -> int:
        """The neighbour of a vertex off its ring and on the other side than another vertex."""
        ring = set(self.ring(at))
        off: Iterable[int] = [n for n in self.neighbours[at] if n not in ring]
        return next(n for n in off if towards not in self.inside(n, ring))
