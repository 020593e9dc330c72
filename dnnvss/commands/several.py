"""``corpus=[a,b]``: several corpora on the command line, and the settings that each of them would have alone."""

import re
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from omegaconf import DictConfig, OmegaConf

from dnnvss.commands.arguments import quoted
from dnnvss.commands.conf import choices, conf_folder
from dnnvss.commands.usage import UsageError
from dnnvss.errors import DnnvssError
from dnnvss.settings import check_settings, read_settings, setting

SEVERAL = "several"
"""The file of ``conf/corpus`` that stands for more than one."""
_LIST = re.compile(r"^\[(?P<names>[^\[\]]*)\]$")
_OWN = ("corpus", "corpus.talkers", "corpus.balance")
"""Settings of the training as a whole; all others are each talker's."""


@dataclass(frozen=True, kw_only=True)
class SeveralCorpora:
    """``conf/corpus/several.yaml``.

    Args:
        talkers: files of ``conf/corpus``, names of corpora in ``data``, or paths of corpora.
        balance: see :func:`dnnvss.systems.talkers.repeats`.
        split: the variant of the splits of all.
    """

    talkers: tuple[str, ...] = setting()
    balance: float = setting(0.5, least=0, most=1)
    split: str = ""

    def __post_init__(self) -> None:
        check_settings(self, "corpus")


def with_lists(arguments: Sequence[str]) -> list[str]:
    """Arguments in which a list of corpora stands as the settings that it is short for.

    Raises:
        UsageError: lists and single corpora in one sweep.
    """
    found: list[str] = []
    for word in arguments:
        key, _, value = word.partition("=")
        if key != "corpus" or "[" not in value:
            found.append(word)
            continue
        lists = [_LIST.match(part) for part in re.split(r",(?![^\[]*\])", value)]
        named = [[name.strip() for name in one["names"].split(",") if name.strip()] for one in lists if one]
        if len(named) != len(lists):
            raise UsageError(f"{word} cannot be read", remedy="Write corpus=[a,b], in a sweep corpus=[a,b],[a,c]")
        found += [f"corpus={SEVERAL}",
                  "corpus.talkers=" + ",".join(f"[{','.join(map(quoted, names))}]" for names in named)]
    return found


def several_corpora(config: DictConfig) -> SeveralCorpora | None:
    """The corpora of composed settings; None where there is but one.

    Raises:
        UsageError: a setting that belongs to one corpus.
    """
    if "talkers" not in config.corpus:
        return None
    try:
        plain = OmegaConf.to_container(config.corpus, resolve=True)
        return read_settings(SeveralCorpora, plain, "corpus")  # type: ignore[arg-type]
    except DnnvssError as error:
        raise UsageError(error.problem, remedy=error.remedy) from error


def each_alone(corpora: SeveralCorpora, given: Sequence[str]) -> dict[str, DictConfig]:
    """The settings that each corpus would have in a training of its own, by their names.

    Args:
        corpora: which they are.
        given: the overrides of the job, as hydra keeps them.

    Raises:
        UsageError: a corpus is named twice.
    """
    shared = [word for word in given if word.partition("=")[0].lstrip("+~") not in _OWN]
    found: dict[str, DictConfig] = {}
    with _composing():
        for talker in corpora.talkers:
            config = compose("train", [*_one(talker), *shared])
            name = str(config.corpus.name)
            if name in found:
                raise UsageError(f"corpus={name} is named twice", remedy="Name each corpus once")
            found[name] = config
    return found


def _composing() -> "nullcontext[None] | initialize_config_dir":
    """What lets hydra compose: the job that runs has that already, with folders of the user's own."""
    if GlobalHydra.instance().is_initialized():
        return nullcontext()
    return initialize_config_dir(str(conf_folder()), version_base="1.3")


def _one(talker: str) -> list[str]:
    """The overrides by which a training of one talker names its corpus."""
    if talker in choices([conf_folder()], "corpus") and talker not in (SEVERAL, "folder"):
        return [f"corpus={talker}"]
    place = [f"++corpus.out={quoted(talker)}"] if "/" in talker or "\\" in talker else []
    return ["corpus=folder", f"++corpus.name={quoted(Path(talker).name)}", *place]
