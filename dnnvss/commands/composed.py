"""From the arguments of a settings command to typed settings, with hydra or without."""

import os
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from dnnvss.commands.arguments import Arguments, SettingsCommand, parse_arguments
from dnnvss.commands.compose import compose
from dnnvss.commands.conf import conf_folder, help_text
from dnnvss.commands.usage import DONE, UsageError
from dnnvss.errors import DnnvssError
from dnnvss.settings import read_settings


def run_command(command: SettingsCommand, arguments: Sequence[str], job: Callable[[DictConfig], Any],
                always_hydra: bool = False) -> int:
    """Parse the arguments of a settings command, compose its settings and do its job with them.

    Args:
        command: the command.
        arguments: as typed.
        job: what it does with composed settings; a function of a module, because launchers send it to other processes.
        always_hydra: whether hydra composes in every case; else only where something is asked for that it alone can.

    Raises:
        UsageError: the arguments cannot be understood.
    """
    if {"-h", "--help"} & set(arguments):
        print(help_text(conf_folder(), command.config))
        return DONE
    parsed = parse_arguments(command, arguments)
    if always_hydra or parsed.needs_hydra:
        _under_hydra(parsed, job)
    else:
        job(compose(parsed))
    return DONE


def plain_settings(config: DictConfig) -> dict[str, Any]:
    """Composed settings as plain containers, resolved, without hydra's own.

    Raises:
        UsageError: a value refers to a setting that there is not.
    """
    own = config
    if "hydra" in config:
        own = OmegaConf.masked_copy(config, [str(key) for key in config if key != "hydra"])
    try:
        plain: Any = OmegaConf.to_container(own, resolve=True)
    except OmegaConfBaseException as error:
        raise UsageError(_first_line(error), remedy="Write ${NAME} with the name of a setting") from error
    return plain


def job_number() -> int | None:
    """Which job of a sweep this is, counted from 0; None where there is no sweep."""
    if (hydra := _hydra()) is None or hydra.mode is None:
        return None
    return int(hydra.job.num) if hydra.mode.name == "MULTIRUN" else None


def _hydra() -> Any:
    """Hydra's own settings, None where it does not run; it is not loaded to find out."""
    loaded = sys.modules.get("hydra.core.hydra_config")
    return loaded.HydraConfig.get() if loaded is not None and loaded.HydraConfig.initialized() else None


def typed_settings(command: SettingsCommand, config: DictConfig) -> Any:
    """Composed settings as an instance of the command's root.

    Raises:
        UsageError: a name, type, range or choice that is wrong, or a working directory that paths are not typed for.
    """
    if (hydra := _hydra()) is not None and hydra.job.chdir:
        raise UsageError("hydra.job.chdir=true would look for every path below the folder of the job",
                         remedy="Leave it out: runs=FOLDER, or out=FILE, says where is written")
    try:
        return read_settings(command.root, plain_settings(config), "")
    except DnnvssError as error:
        raise UsageError(error.problem, file=error.file, utterance=error.utterance, remedy=error.remedy) from error


def _under_hydra(parsed: Arguments, job: Callable[[DictConfig], Any]) -> None:
    """Let hydra compose, launch and sweep; what it finds wrong is told in one line.

    ``sys.argv`` stays as it was typed: processes that share a fit are started with it.
    """
    from hydra import version
    from hydra._internal.utils import _run_hydra, get_args_parser
    from hydra.errors import HydraException

    version.setbase("1.3")
    parser = get_args_parser()
    try:
        with _errors_handed_on():
            _run_hydra(args=parser.parse_args(parsed.for_hydra()), args_parser=parser, task_function=job,
                       config_path=str(conf_folder()), config_name=parsed.command.config)
    except (HydraException, OmegaConfBaseException) as error:
        _refuse_unreadable(parsed)
        remedy = f"dnnvss {parsed.command.name} --help lists the settings"
        if lacking := re.match(r"Could not override '([^']+)'", line := _first_line(error)):
            line = f"{lacking[1]} is no setting of every run that is asked for"
            remedy = "Check its name, or leave out the systems that lack it"
        raise UsageError(line, remedy=remedy) from error


def _refuse_unreadable(parsed: Arguments) -> None:
    """Refuse the first setting whose value hydra's grammar cannot read."""
    from hydra.core.override_parser.overrides_parser import OverridesParser
    from hydra.errors import HydraException

    parser = OverridesParser.create()
    for override in parsed.overrides:
        try:
            read = parser.parse_override(override.for_hydra(parsed.swept))
        except HydraException as error:
            raise UsageError(f"{override.key}={override.value} cannot be read",
                             remedy="Quote it, or write it as YAML") from error
        if read.is_sweep_override() and not parsed.swept:
            raise UsageError(f"{override.key}={override.value} gives several values",
                             remedy="Add -m for a run of each, or write a list as [A,B]")


@contextmanager
def _errors_handed_on() -> Iterator[None]:
    """Let hydra hand its errors on instead of ending the process."""
    before = os.environ.get("HYDRA_FULL_ERROR")
    os.environ["HYDRA_FULL_ERROR"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["HYDRA_FULL_ERROR"]


def _first_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[0] if lines else type(error).__name__
