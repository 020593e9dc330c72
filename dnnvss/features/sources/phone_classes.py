"""Blocks of what phones are like: the questions that they answer with yes, and phones far away."""

import hashlib
from functools import partial
from typing import Any

import numpy as np

from dnnvss.features.block import Block, at_offsets, binary, numeric, table_1
from dnnvss.features.sources.segments import Units, track, window_of
from dnnvss.features.view import View
from dnnvss.phones import ANSWERS, QUESTIONS, SILENCE, phone_id

_READS = ("phones",)
_NEIGHBOURS = (-2, -1, 1, 2)
_CLASS_FRAMES = (-12, -8, -4, -2, 2, 4, 8, 12)
_WIDE_FRAMES = (-64, -48, -40, -32, -28, -24, -20, 20, 24, 28, 32, 40, 48, 64)
_CLASSES = tuple(q.name for q in QUESTIONS)
_MOST_CLASSES = int(ANSWERS.sum(1).max())
_ANSWERS_ID = f"answers {hashlib.sha256(ANSWERS.tobytes()).hexdigest()[:8]}"


def class_blocks() -> list[Block]:
    """The acoustic classes of the paper."""
    return [binary("acoustic_class", "frame", _READS, table_1("frame: acoustic class"),
                   f"questions that the phone answers with yes ({_ANSWERS_ID})", _CLASSES, _MOST_CLASSES, answers)]


def class_context_blocks(phones: Units) -> list[Block]:
    """Phones and classes further around, which the paper does not have."""
    return [
        binary("phone_window_wide", "frame", _READS, "ours", "the phone at frames beyond the window, far apart",
               at_offsets(_WIDE_FRAMES, phones.names), len(_WIDE_FRAMES), partial(window_of, phones, _WIDE_FRAMES)),
        binary("class_window", "frame", _READS, "ours", f"acoustic class at a few frames around ({_ANSWERS_ID})",
               at_offsets(_CLASS_FRAMES, _CLASSES), len(_CLASS_FRAMES) * _MOST_CLASSES,
               partial(answers_around, _CLASS_FRAMES, False)),
        binary("class_context", "segment", _READS, "ours",
               f"acoustic class of the two phones before and after ({_ANSWERS_ID})",
               at_offsets(_NEIGHBOURS, _CLASSES), len(_NEIGHBOURS) * _MOST_CLASSES,
               partial(answers_around, _NEIGHBOURS, True)),
        numeric("neighbour_frames", "segment", _READS, "frames", "ours",
                "frames in the two phones before and after; 0 outside the utterance",
                at_offsets(_NEIGHBOURS, ("frames",)), partial(neighbour_frames, _NEIGHBOURS)),
    ]


def answers(view: View, start: int, pad: int) -> Any:
    """The questions that the phone of this frame answers with yes."""
    return view.constant(("answers", start, pad), lambda: _answer_columns(start, pad))[track(view, "phone").code]


def answers_around(offsets: tuple[int, ...], segments: bool, view: View, start: int, pad: int) -> Any:
    """The questions answered with yes by the phones at some frames, or segments, around this one."""
    at = track(view, "phone")
    index, bounds, name = ((at.segment, at.segment_bounds, "phone_code") if segments else
                           (view.frames, at.frame_bounds, "phone"))
    codes = view.put(*view.around(name, index, offsets, bounds), phone_id(SILENCE))

    def build() -> np.ndarray:
        width = ANSWERS.shape[1]
        return np.stack([_answer_columns(start + place * width, pad) for place in range(len(offsets))])

    tables = view.constant(("answers around", start, pad, offsets), build)
    place = view.constant(("places", len(offsets)), lambda: np.arange(len(offsets), dtype=np.int64))
    return tables[place, codes].reshape(len(codes), -1)


def neighbour_frames(offsets: tuple[int, ...], view: View, start: int, pad: int) -> Any:
    """The numbers of frames of neighbouring phones; 0 outside the utterance."""
    at = track(view, "phone")
    return view.put(*view.around("phone_frames", at.segment, offsets, at.segment_bounds), 0)


def _answer_columns(start: int, pad: int) -> np.ndarray:
    """For each phone the columns of the questions answered with yes (41, most answers), filled up by ``pad``."""
    table = np.full((len(ANSWERS), _MOST_CLASSES), pad, dtype=np.int32)
    for row, answered in zip(table, ANSWERS, strict=True):
        yes = np.flatnonzero(answered)
        row[: len(yes)] = start + yes
    return table
