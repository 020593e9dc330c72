"""What a run knows of how its talker speaks: phones, pauses, triphones, variant of English, rate, credit."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from dnnvss import files
from dnnvss.corpus import CorpusInfo, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.phones import SILENCES
from dnnvss.phones.contexts import spoken_triphones

_REMEDY = "Train the run again: python train.py overwrite=true, with the settings of its config.yaml"


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
    """

    phones: tuple[str, ...]
    pauses: tuple[str, ...]
    variant: str
    rate: str
    credit: str
    triphones: frozenset[str]

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
        value = files.read_json(path, _REMEDY)
        try:
            lists = {name: tuple(map(str, value[name])) for name in ("phones", "pauses", "triphones")}
            texts = {name: str(value[name]) for name in ("variant", "rate", "credit")}
        except (KeyError, TypeError) as error:
            raise DnnvssError(f"does not say {error}", file=path, remedy=_REMEDY) from error
        return cls(lists["phones"], lists["pauses"], **texts, triphones=frozenset(lists["triphones"]))
