"""``dnnvss correlations folder=FOLDER study=NAME``: how much of what is seen can be heard.

The experiments of Theobald and Wilkinson 2007, Figures 3 to 5; settings in ``conf/correlations.yaml``.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from omegaconf import DictConfig

from dnnvss.commands.arguments import SettingsCommand
from dnnvss.commands.composed import run_command, typed_settings
from dnnvss.corpus import SPLITS
from dnnvss.evaluation.correlation_figures import write_correlations
from dnnvss.evaluation.correlations import Study
from dnnvss.settings import setting


@dataclass(frozen=True, kw_only=True)
class CorrelationsSettings:
    """``conf/correlations.yaml``."""

    study: Study
    folder: Path
    out: Path | None = None
    split: str = setting("train", choices=SPLITS)


COMMAND = SettingsCommand("correlations", "correlations", CorrelationsSettings, bare="folder")


def main(arguments: Sequence[str]) -> int:
    """Make the study that the arguments describe."""
    return run_command(COMMAND, arguments, job)


def job(config: DictConfig) -> None:
    """Make the study of composed settings."""
    settings: CorrelationsSettings = typed_settings(COMMAND, config)
    written = write_correlations(settings.study, settings.folder, settings.out, settings.split)
    print("wrote " + ", ".join(map(str, written)))
