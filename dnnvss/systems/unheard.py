"""Phones that training never heard: a network takes them for those that it did, the likest first.

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


def stand_in_columns(table: FeatureTable, heard: set[str]) -> dict[int, dict[int, float]]:
    """The binary columns of phones that nobody heard, each as shares of those of heard ones at the same place.

    Shares fall with the distance of the phones (:func:`dnnvss.phones.nearest`), by a factor of e for each unit.
    """
    likest = {phone: _shares(phone, heard) for phone in PHONES if phone not in heard}
    place = {_parts(table.columns[column]): k for k, column in enumerate(table.binary_columns)}
    return {k: {place[at, other]: share for other, share in likest[phone].items()}
            for (at, phone), k in place.items() if phone in likest}


def _shares(phone: str, heard: set[str]) -> dict[str, float]:
    names, distances = zip(*nearest(phone, heard), strict=True)
    shares = np.exp(distances[0] - np.array(distances))
    return dict(zip(names, (shares / shares.sum()).tolist(), strict=True))


def _parts(column: str) -> tuple[str, str]:
    """Where a column looks, and for what: ``("phone_window/+2", "AA")``, ``("centre_phone", "AA")``."""
    block, name = column.split("/", 1)
    at, _, what = name.rpartition(":")
    return f"{block}/{at}", what


@torch.no_grad()
def lend_weights(first: nn.Module, table: FeatureTable, heard: set[str]) -> None:
    """Give the columns of phones that training never heard weights of the likest that it did.

    Args:
        first: the layer of a network that sees the columns, with ``weight`` (columns + 1, H).
        table: what the columns are.
        heard: the phones that training heard; nothing is known of them where there are none.
    """
    if not heard:
        return
    weight = first.get_parameter("weight")
    for column, shares in stand_in_columns(table, heard).items():
        weight[column] = weight.new_tensor(list(shares.values())) @ weight[list(shares)]
