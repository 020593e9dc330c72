"""Parts in which a long utterance goes through a network."""

from collections.abc import Iterator

_AT_ONCE, _AT_ONCE_OVER_TIME = 4096, 16384
"""Frames a forward pass at prediction: bounds memory on an hour of text."""


def pieces(count: int, reach: tuple[int, int], alone: int = _AT_ONCE, around: slice | None = None
           ) -> Iterator[tuple[slice, slice]]:
    """Parts in which a long utterance goes through a network.

    Args:
        count: frames of the utterance.
        reach: of the network; (0, 0) where it sees one frame at a time.
        alone: frames at once where each is seen by itself.
        around: the frames that are wanted; all where None.

    Yields:
        The frames that are put in, and which of the outputs count.
    """
    size = alone if reach == (0, 0) else _AT_ONCE_OVER_TIME
    first, last = (0, count) if around is None else (around.start, around.stop)
    for start in range(first, last, size):
        stop, low = min(start + size, last), max(start - reach[0], 0)
        yield slice(low, min(stop + reach[1], count)), slice(start - low, stop - low)
