"""How each block finds the columns that are 1, or its values, for a batch of frames.

A binary fill takes ``(view, start, pad)`` and returns columns (B, slots) counted from ``start``, ``pad`` for none; a
numeric one returns values (B, slots). They index and calculate only: arrays or tensors of any device will do.
"""

from typing import Any

import numpy as np

from dnnvss.features.fields import COUNTS, NOWHERE, POSITIONS, thirds
from dnnvss.features.view import View
from dnnvss.phones import ANSWERS, SILENCE, phone_id


def centre(track: str, view: View, start: int, pad: int) -> Any:
    """Return the unit of this frame."""
    return view.track(track).code[:, None] + start


def position(track: str, view: View, start: int, pad: int) -> Any:
    """Return the third of the segment in which this frame lies."""
    return thirds(view.track(track).elapsed, view.track(track).frames)[:, None] + start


def window(track: str, offsets: tuple[int, ...], width: int, view: View, start: int, pad: int) -> Any:
    """Return the unit at each frame of the window; outside the utterance silence, or nothing for dynamic visemes."""
    at = view.track(track)
    return _spread(view, *view.around(track, view.frames, offsets, at.frame_bounds), width, track, start, pad)


def context(track: str, offsets: tuple[int, ...], width: int, view: View, start: int, pad: int) -> Any:
    """Return the unit of the neighbouring segments; outside the utterance as in :func:`window`."""
    at = view.track(track)
    around = view.around(f"{track}_code", at.segment, offsets, at.segment_bounds)
    return _spread(view, *around, width, track, start, pad)


def _spread(view: View, codes: Any, outside: Any, width: int, track: str, start: int, pad: int) -> Any:
    """Return ``start + place * width + code``, in places outside the column of silence or, for visemes, ``pad``."""
    places = codes.shape[1]
    base = view.constant(("base", start, places, width), lambda: np.arange(places, dtype=np.int32) * width + start)
    return view.put(codes + base, outside, base + phone_id(SILENCE) if track == "phone" else pad)


def _answer_columns(start: int, pad: int) -> np.ndarray:
    """Return for each phone the columns of the questions answered with yes (41, most answers), filled up by ``pad``."""
    table = np.full((len(ANSWERS), int(ANSWERS.sum(1).max())), pad, dtype=np.int32)
    for row, answers in zip(table, ANSWERS, strict=True):
        yes = np.flatnonzero(answers)
        row[: len(yes)] = start + yes
    return table


def answers(view: View, start: int, pad: int) -> Any:
    """Return the questions that the phone of this frame answers with yes."""
    return view.constant(("answers", start, pad), lambda: _answer_columns(start, pad))[view.phone.code]


def answers_around(offsets: tuple[int, ...], segments: bool, view: View, start: int, pad: int) -> Any:
    """Return the questions answered with yes by the phones at some frames, or segments, around this one."""
    index, bounds, name = ((view.phone.segment, view.phone.segment_bounds, "phone_code") if segments else
                           (view.frames, view.phone.frame_bounds, "phone"))
    codes = view.put(*view.around(name, index, offsets, bounds), phone_id(SILENCE))

    def build() -> np.ndarray:
        width = ANSWERS.shape[1]
        return np.stack([_answer_columns(start + place * width, pad) for place in range(len(offsets))])

    tables = view.constant(("answers around", start, pad, offsets), build)
    place = view.constant(("places", len(offsets)), lambda: np.arange(len(offsets), dtype=np.int64))
    return tables[place, codes].reshape(len(codes), -1)


def tree_position(name: str, view: View, start: int, pad: int) -> Any:
    """Return the third of the larger unit in which the smaller one lies; none in silence."""
    third = view.phone.of_segment("positions")[:, POSITIONS.index(name)][:, None]
    return view.xp.where(third == NOWHERE, pad, third + start)


def syllable_viseme_position(view: View, start: int, pad: int) -> Any:
    """Return the third of the syllable's dynamic visemes in which this one lies; none in silence."""
    count = view.phone.of_segment("syllable_visemes")
    index = view.viseme.segment - view.phone.of_segment("syllable_viseme_start")
    return view.xp.where(count == 0, pad, thirds(index, count + (count == 0)) + start)[:, None]


def frames(track: str, view: View, start: int, pad: int) -> Any:
    """Return the number of frames in the segment."""
    return view.track(track).frames[:, None]


def span(track: str, view: View, start: int, pad: int) -> Any:
    """Return the number of frames until the unit changes, this one included: 1 in the last frame."""
    return (view.track(track).frames - view.track(track).elapsed)[:, None]


def fraction(track: str, view: View, start: int, pad: int) -> Any:
    """Return where in its segment the centre of this frame lies, between 0 and 1."""
    return ((view.track(track).elapsed + 0.5) / view.track(track).frames)[:, None]


def tree_count(name: str, view: View, start: int, pad: int) -> Any:
    """Return how many smaller units the larger one has; 0 in silence."""
    return view.phone.of_segment("counts")[:, COUNTS.index(name)][:, None]


def of_segment(track: str, name: str, view: View, start: int, pad: int) -> Any:
    """Return a count that belongs to the segment."""
    return view.track(track).of_segment(name)[:, None]


def neighbour_frames(offsets: tuple[int, ...], view: View, start: int, pad: int) -> Any:
    """Return the numbers of frames of neighbouring phones; 0 outside the utterance."""
    return view.put(*view.around("phone_frames", view.phone.segment, offsets, view.phone.segment_bounds), 0)
