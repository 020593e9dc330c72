"""Whether times can be those of speech, or are in another unit than their file should have."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dnnvss.errors import DnnvssError
from dnnvss.formats.cues import Cue
from dnnvss.formats.labels import word_of
from dnnvss.phones import SILENCES
from dnnvss.timing import Alignment

PACE = {"phones": (0.015, 1.5), "words": (0.03, 6.0)}
"""Seconds between which the median phone and the median word of speech last: spoken very fast, sung very slowly."""

_FEW, _WIDER = 3, 5
"""Phones or words below which lengths may be further from what is usual, and by how many times."""
_USUAL = {"phones": 0.08, "words": 0.3}
_REMEDY = ("Write HTK times in units of 100 ns, or in seconds with a decimal point; those of TIMIT (.phn) in samples "
           "of 16 kHz, of Whisper's .tsv in milliseconds, of other formats in seconds")


def check_pace(alignment: Alignment, file: Path) -> Alignment:
    """Refuse times in another unit; the alignment itself where they are well.

    Raises:
        DnnvssError: the median phone or word is far too short or too long; says by about how much.
    """
    for tier in alignment.tiers:
        spoken = [s.end - s.start for s in tier if s.label not in SILENCES and word_of(s.label)]
        if tier.name in PACE and spoken:
            _refuse_pace(tier.name, spoken, file, 1 if len(spoken) >= _FEW else _WIDER)
    return alignment


def check_cues(cues: tuple[Cue, ...], file: Path) -> tuple[Cue, ...]:
    """Refuse times in another unit, by how long a word of a cue lasts; the cues themselves where they are well.

    Raises:
        DnnvssError: the median word is far too short or too long; says by about how much.
    """
    lasts = [(c.end - c.start) / len(c.text.split()) for c in cues if c.start is not None and c.end is not None]
    if len(lasts) >= _FEW:
        _refuse_pace("words", lasts, file)
    return cues


def _refuse_pace(kind: str, lasts: Sequence[float], file: Path, wider: int = 1) -> None:
    """Refuse lengths, in seconds, that phones or words do not have; ``wider`` times as far off for few of them."""
    (least, most), middle = PACE[kind], float(np.median(lasts))
    if least / wider <= middle <= most * wider:
        return
    times = 10 ** round(abs(np.log10(middle / _USUAL[kind]))) if middle > 0 else 0
    size = "small" if middle < least else "large"
    raise DnnvssError(f"its {kind} last {middle:.3g} s, which nobody says: the times are too {size}"
                      + (f", about {times:,} times" if times > 1 else ""), file=file, remedy=_REMEDY)
