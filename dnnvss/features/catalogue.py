"""Every block that a feature table can hold: Table 1 of the paper, and a few of our own."""

import hashlib
from functools import lru_cache, partial

from dnnvss.features import fills
from dnnvss.features.block import Block, Settings
from dnnvss.features.fields import COUNTS, POSITIONS
from dnnvss.phones import ANSWERS, PHONES, QUESTIONS

_THIRDS = ("start", "middle", "end")
_SEGMENTS = (-2, -1, 0, 1, 2)
_NEIGHBOURS = (-2, -1, 1, 2)
_CLASS_FRAMES = (-12, -8, -4, -2, 2, 4, 8, 12)
_WIDE_FRAMES = (-64, -48, -40, -32, -28, -24, -20, 20, 24, 28, 32, 40, 48, 64)
_CLASSES = tuple(q.name for q in QUESTIONS)
_MOST_CLASSES = int(ANSWERS.sum(1).max())
_ANSWERS_ID = f"answers {hashlib.sha256(ANSWERS.tobytes()).hexdigest()[:8]}"


def _paper(row: str) -> str:
    return f"Thangthai 2016, Table 1, {row}"


def _at(offsets: tuple[int, ...], names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{offset:+d}:{name}" for offset in offsets for name in names)


@lru_cache
def catalogue(settings: Settings) -> dict[str, Block]:
    """Return every declared block by name, sized by the settings.

    **Source**: Thangthai 2016, section 4 and Table 1 for the blocks that say so; the others are ours.
    """
    blocks = [*_unit_blocks("phone", "phoneme", PHONES, settings),
              *_unit_blocks("viseme", "dynamic viseme", tuple(str(u) for u in range(settings.units)), settings),
              *_class_blocks(), *_linguistic_blocks(), *_own_blocks()]
    return {block.name: block for block in blocks if block.columns}


def _unit_blocks(unit: str, paper: str, names: tuple[str, ...], settings: Settings) -> list[Block]:
    """Return the blocks that phones and dynamic visemes have in common."""
    family, offsets, width = "ph" if unit == "phone" else "dv", settings.offsets, len(names)
    outside = "silence" if unit == "phone" else "nothing"
    window = "phonetic window context" if unit == "phone" else "dynamic viseme window context"

    number = _paper(f"frame: position and number of frames in {paper}")
    return [
        Block(f"centre_{unit}", "frame", family, "binary", _paper(f"frame: centre {paper}"),
              f"the {unit} of this frame", names, 1, partial(fills.centre, unit)),
        Block(f"{unit}_window", "frame", family, "binary", _paper(f"frame: {window}"),
              f"the {unit} at each frame around; {outside} outside the utterance", _at(offsets, names),
              max(len(offsets), 1), partial(fills.window, unit, offsets, width)),
        Block(f"{unit}_position", "frame", family, "binary", number,
              f"the third of the {unit} in which this frame has its centre", _THIRDS, 1, partial(fills.position, unit)),
        Block(f"{unit}_frames", "frame", family, "numeric", number,
              f"frames in the {unit}", ("frames",), 1, partial(fills.frames, unit)),
        Block(f"{unit}_span", "frame", family, "numeric", _paper(f"frame: forward {paper} span"),
              f"frames until the {unit} changes, this one included", ("frames",), 1, partial(fills.span, unit)),
        Block(f"{unit}_context", "segment", family, "binary", _paper(f"segment: {paper} context"),
              f"the {unit}, two before and two after; {outside} outside the utterance", _at(_SEGMENTS, names),
              len(_SEGMENTS), partial(fills.context, unit, _SEGMENTS, width)),
    ]


def _class_blocks() -> list[Block]:
    number = _paper("syllable: position and number of dynamic visemes in syllable")
    return [
        Block("acoustic_class", "frame", "ph", "binary", _paper("frame: acoustic class"),
              f"questions that the phone answers with yes ({_ANSWERS_ID})", _CLASSES, _MOST_CLASSES, fills.answers),
        Block("viseme_phones", "segment", "dv", "numeric", _paper("segment: number of phonemes in dynamic viseme"),
              "spoken phones from the viseme's first frame to its last", ("phones",), 1,
              partial(fills.of_segment, "viseme", "viseme_phones")),
        Block("syllable_viseme_position", "syllable", "dv", "binary", number,
              "the third of the syllable's visemes, from its first frame to its last; none in silence", _THIRDS, 1,
              fills.syllable_viseme_position),
        Block("syllable_visemes", "syllable", "dv", "numeric", number,
              "visemes from the syllable's first frame to its last; 0 in silence", ("visemes",), 1,
              partial(fills.of_segment, "phone", "syllable_visemes")),
    ]


def _linguistic_blocks() -> list[Block]:
    """Return the positions and counts of the linguistic tree, from the syllable to the utterance."""
    blocks = []
    for name in POSITIONS:
        part, _, whole = name.partition("_in_")
        count, family = f"{part}s_in_{whole}", "ph" if part == "phone" else "both"
        row = f"{part}s".replace("phones", "phonemes")
        source = _paper(f"utterance: position of {part} in utterance" if whole == "utterance" else
                        f"{whole}: position and number of {row} in {whole}")
        blocks.append(Block(f"{whole}_{part}_position", whole, family, "binary", source,
                            f"the third of the {whole} in which the {part} lies; none in silence", _THIRDS, 1,
                            partial(fills.tree_position, name)))
        if count in COUNTS:
            blocks.append(Block(f"{whole}_{part}s", whole, family, "numeric", source,
                                f"{part}s in the {whole}; 0 in silence", (f"{part}s",), 1,
                                partial(fills.tree_count, count)))
    return blocks


def _own_blocks() -> list[Block]:
    """Return blocks that the paper does not have."""
    return [
        Block("phone_fraction", "frame", "ph", "numeric", "ours", "where in the phone this frame's centre lies, 0 to 1",
              ("fraction",), 1, partial(fills.fraction, "phone")),
        Block("viseme_fraction", "frame", "dv", "numeric", "ours",
              "where in the viseme this frame's centre lies, 0 to 1",
              ("fraction",), 1, partial(fills.fraction, "viseme")),
        Block("phone_window_wide", "frame", "ph", "binary", "ours", "the phone at frames beyond the window, far apart",
              _at(_WIDE_FRAMES, PHONES), len(_WIDE_FRAMES), partial(fills.window, "phone", _WIDE_FRAMES, len(PHONES))),
        Block("class_window", "frame", "ph", "binary", "ours", f"acoustic class at a few frames around ({_ANSWERS_ID})",
              _at(_CLASS_FRAMES, _CLASSES), len(_CLASS_FRAMES) * _MOST_CLASSES,
              partial(fills.answers_around, _CLASS_FRAMES, False)),
        Block("class_context", "segment", "ph", "binary", "ours",
              f"acoustic class of the two phones before and after ({_ANSWERS_ID})", _at(_NEIGHBOURS, _CLASSES),
              len(_NEIGHBOURS) * _MOST_CLASSES, partial(fills.answers_around, _NEIGHBOURS, True)),
        Block("neighbour_frames", "segment", "ph", "numeric", "ours",
              "frames in the two phones before and after; 0 outside the utterance", _at(_NEIGHBOURS, ("frames",)),
              len(_NEIGHBOURS), partial(fills.neighbour_frames, _NEIGHBOURS)),
    ]
