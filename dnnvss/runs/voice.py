"""What a run knows of how its talker speaks: phones, pauses, triphones, variant of English, rate, credit."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from dnnvss import files
from dnnvss.corpus import CorpusInfo, Utterance
from dnnvss.phones import SILENCES, SPOKEN
from dnnvss.phones.contexts import spoken_triphones
from dnnvss.records import read_record
from dnnvss.settings import setting
from dnnvss.text.variants import VARIANTS
from dnnvss.timing import FrameClock

_REMEDY = "Train the run again: dnnvss train overwrite=true, with the settings of its config.yaml"


@dataclass(frozen=True)
class Voice:
    """How the talker of a run speaks.

    Args:
        phones: labels that the talker spoke, in order, without pauses.
        pauses: kinds of silence that the talker made.
        variant: of English, ``en_us`` or ``en_gb``.
        rate: frames a second of the talker's video, as text.
        credit: the line to print wherever a picture of the talker is shown.
        triphones: contexts that the talker spoke.
        borrowed: those of the phones that other talkers spoke alone, whose runs the system learnt from.
    """

    phones: tuple[str, ...]
    pauses: tuple[str, ...]
    variant: str
    rate: str
    credit: str
    triphones: frozenset[str]
    borrowed: tuple[str, ...] = ()

    def borrowing(self, other: "Voice") -> "Voice":
        """This voice with the phones that another talker spoke and this one did not."""
        more = set(other.phones) - set(self.phones)
        phones, borrowed = (tuple(sorted({*own, *more})) for own in (self.phones, self.borrowed))
        return replace(self, phones=phones, borrowed=borrowed)

    @classmethod
    def of(cls, utterances: Sequence[Utterance], info: CorpusInfo) -> "Voice":
        """The voice that training utterances show."""
        heard = {phone for u in utterances for phone in u.alignment["phones"].labels}
        spoken, pauses = tuple(sorted(heard - set(SILENCES))), tuple(sorted(heard & set(SILENCES)))
        triphones = frozenset(spoken_triphones(u.alignment for u in utterances))
        return cls(spoken, pauses, info.variant, info.rate, info.credit, triphones)

    def save(self, path: Path) -> Path:
        """Write ``.json`` and return the path."""
        return files.write_json(path, {**asdict(self), "triphones": sorted(self.triphones)})

    @classmethod
    def load(cls, path: Path) -> "Voice":
        """The voice that :meth:`save` wrote.

        Raises:
            DnnvssError: the file is missing, damaged, or of another version.
        """
        kept = read_record(_Kept, path, _REMEDY)
        FrameClock.from_setting(kept.rate, f"{path}: rate")
        return cls(kept.phones, kept.pauses, kept.variant, kept.rate, kept.credit, frozenset(kept.triphones),
                   kept.borrowed)


@dataclass(frozen=True, kw_only=True)
class _Kept:
    """What the file of a voice holds."""

    phones: tuple[str, ...] = setting(choices=SPOKEN)
    pauses: tuple[str, ...] = setting(choices=SILENCES)
    variant: str = setting(choices=VARIANTS)
    rate: str
    credit: str
    triphones: tuple[str, ...]
    borrowed: tuple[str, ...] = setting((), choices=SPOKEN)
