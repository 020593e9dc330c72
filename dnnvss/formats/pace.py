"""Whether times can be those of speech, or are in another unit than their file should have."""

from pathlib import Path

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.formats.labels import word_of
from dnnvss.phones import SILENCES
from dnnvss.timing import Alignment

PACE = {"phones": (0.015, 1.5), "words": (0.03, 6.0)}
"""Seconds between which the median phone and the median word of speech last: spoken very fast, sung very slowly."""

_FEW = 3
_USUAL = {"phones": 0.08, "words": 0.3}
_REMEDY = "Write HTK times in units of 100 ns, or in seconds with a decimal point; times of other formats in seconds"


def check_pace(alignment: Alignment, file: Path) -> Alignment:
    """Refuse times in another unit; the alignment itself where they are well.

    Raises:
        DnnvssError: the median phone or word is far too short or too long; says by about how much.
    """
    for tier in alignment.tiers:
        spoken = [s.end - s.start for s in tier if s.label not in SILENCES and word_of(s.label)]
        if tier.name not in PACE or len(spoken) < _FEW:
            continue
        (least, most), middle = PACE[tier.name], float(np.median(spoken))
        if not least <= middle <= most:
            times = 10 ** round(abs(np.log10(middle / _USUAL[tier.name]))) if middle > 0 else 0
            size = "small" if middle < least else "large"
            raise DnnvssError(f"its {tier.name} last {middle:.3g} s, which nobody says: the times are too {size}"
                              + (f", about {times:,} times" if times > 1 else ""), file=file, remedy=_REMEDY)
    return alignment
