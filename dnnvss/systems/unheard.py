"""Phones that training never heard: a network takes them for the likest that it did.

The weights of a column that is never 1 stay as they were drawn, so that such a phone would add noise wherever it is
seen, also from the frames and segments around.
"""

from collections.abc import Iterable

import numpy as np
import torch
from torch import nn

from dnnvss.features import FeatureTable, FrameCodes, phones_of
from dnnvss.phones import PHONES, nearest


def heard_phones(every: Iterable[FrameCodes]) -> set[str]:
    """The phones of utterances, as far as they own a frame; none where phones are not told."""
    found: set[str] = set()
    for codes in every:
        if "phone_code" not in codes.arrays:
            continue
        phones = phones_of(codes)
        found |= {PHONES[code] for code in np.unique(phones.code[phones.frames > 0])}
    return found


def stand_in_columns(table: FeatureTable, heard: set[str]) -> tuple[list[int], list[int]]:
    """The binary columns of phones that nobody heard, and for each that of the likest heard one at the same place."""
    likest = {phone: nearest(phone, heard)[0][0] for phone in PHONES if phone not in heard}
    place = {_parts(table.columns[column]): k for k, column in enumerate(table.binary_columns)}
    never = {k: place[at, likest[phone]] for (at, phone), k in place.items() if phone in likest}
    return list(never), list(never.values())


def _parts(column: str) -> tuple[str, str]:
    """Where a column looks, and for what: ``("phone_window/+2", "AA")``, ``("centre_phone", "AA")``."""
    block, name = column.split("/", 1)
    at, _, what = name.rpartition(":")
    return f"{block}/{at}", what


@torch.no_grad()
def lend_weights(first: nn.Module, table: FeatureTable, heard: set[str]) -> None:
    """Give the columns of phones that training never heard the weights of the likest that it did.

    Args:
        first: the layer of a network that sees the columns, with ``weight`` (columns + 1, H).
        table: what the columns are.
        heard: the phones that training heard; nothing is known of them where there are none.
    """
    if heard:
        never, instead = stand_in_columns(table, heard)
        weight = first.get_parameter("weight")
        weight[never] = weight[instead]
