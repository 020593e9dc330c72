"""``dnnvss prepare corpus=NAME corpus.raw=RAW``: a corpus from recordings; settings in ``conf/prepare.yaml``."""

from collections.abc import Sequence

from omegaconf import DictConfig

from data_prep.look import first_look
from dnnvss import files
from dnnvss.commands.arguments import SettingsCommand
from dnnvss.commands.composed import run_command, typed_settings
from dnnvss.commands.prepare_settings import PrepareSettings
from dnnvss.commands.usage import UsageError
from dnnvss.staging import changing

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
    out = corpus.out
    if settings.look:
        if not importer.looks:
            raise UsageError("there is no first look at this corpus",
                             remedy="Leave look=true out; corpus=folder and corpus=grid have it")
        importer.call(out, {"raw": corpus.raw, "jobs": settings.jobs, "backend": settings.backend, "then": first_look})
        return
    files.make_folder(out.parent)
    with files.locked(out, f"waiting for the command that prepares {out}"), changing(out):
        importer.call(out, {"raw": corpus.raw, "jobs": settings.jobs, "backend": settings.backend,
                            "strict": settings.strict})
