"""``dnnvss prepare corpus=NAME corpus.raw=RAW``: a corpus from recordings; settings in ``conf/prepare.yaml``."""

from collections.abc import Sequence

from omegaconf import DictConfig

from dnnvss.commands.arguments import SettingsCommand
from dnnvss.commands.composed import run_command, typed_settings
from dnnvss.commands.prepare_settings import PrepareSettings
from dnnvss.commands.usage import UsageError

COMMAND = SettingsCommand("prepare", "prepare", PrepareSettings, bare="corpus.raw")


def main(arguments: Sequence[str]) -> int:
    """Prepare the corpus that the arguments describe."""
    return run_command(COMMAND, arguments, job)


def job(config: DictConfig) -> None:
    """Prepare the corpus of composed settings.

    Raises:
        DnnvssError: a setting is missing or wrong, or what the importer raises.
    """
    settings: PrepareSettings = typed_settings(COMMAND, config)
    corpus, importer = settings.corpus.common, settings.corpus.make
    if corpus.raw is None and settings.corpus.recorded:
        raise UsageError("corpus.raw is not set", remedy="Add corpus.raw=... to the command")
    importer.call(corpus.out, {"raw": corpus.raw, "jobs": settings.jobs, "backend": settings.backend,
                               "strict": settings.strict})
