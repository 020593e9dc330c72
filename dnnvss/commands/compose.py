"""Settings from ``conf/`` without hydra, for commands whose start should cost little.

Understood are a list of defaults, groups and packages of one level, values and dotted keys: what ``conf/synth.yaml``
and ``conf/prepare.yaml`` use. The tests hold the result against hydra's.
"""

import re
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from dnnvss.commands.arguments import Arguments, Override
from dnnvss.commands.conf import conf_folder, groups, read_file
from dnnvss.commands.usage import UsageError


def compose(arguments: Arguments) -> DictConfig:
    """The settings of a command: its file with its groups, and what the command line says.

    Raises:
        UsageError: a value that cannot be read, or a setting inside something that holds none.
    """
    folder, name = conf_folder(), arguments.command.config
    known = groups(folder, name)
    chosen = {o.key: str(o.value) for o in arguments.overrides if o.key in known}
    config = _file(folder, name, chosen)
    for override in arguments.overrides:
        if override.key not in chosen:
            _set(config, override)
    return config


def _file(folder: Path, name: str, chosen: dict[str, str]) -> DictConfig:
    """A file merged with its defaults; what the file itself says counts more than what it builds on."""
    own = OmegaConf.create(read_file(folder / f"{name}.yaml"))
    assert isinstance(own, DictConfig)
    parts: list[Any] = []
    for entry in own.pop("defaults", []):
        if isinstance(entry, str):
            if entry != "_self_":
                parts.append(_file(folder, entry, {}))
            continue
        (group, choice), = entry.items()
        if not group.startswith("override "):
            parts.append({group: _file(folder / group, chosen.get(group, choice), {})})
    own.pop("hydra", None)
    result = OmegaConf.merge(*parts, own)
    assert isinstance(result, DictConfig)
    return result


def _set(config: DictConfig, override: Override) -> None:
    key, text = override.key, override.value or ""
    value = _plain(text) if override.text and text != "null" else _value(key, text)
    try:
        OmegaConf.update(config, key, value, merge=not isinstance(value, dict), force_add=True)
    except Exception as error:  # OmegaConf's own, and those of what it looks into
        above = key.rpartition(".")[0]
        raise UsageError(f"{key} is no setting: {above} holds a single value", remedy=f"Give {above}=...") from error


def _plain(text: str) -> str:
    """A text in which ``${`` means itself."""
    return re.sub(r"(\\*)\$\{", r"\1\1\\${", text)


def _value(key: str, text: str) -> Any:
    """A value as YAML reads it; ``{a:1}`` needs no space behind the colon."""
    spaced = re.sub(r":(?=[^\s/])", ": ", text) if text.startswith("{") else text
    try:
        return OmegaConf.to_container(OmegaConf.create(f"value: {spaced}"))["value"]  # type: ignore[index,call-overload]
    except Exception as error:  # YAML's scanner and parser have errors of many kinds
        raise UsageError(f"{key}={text} cannot be read", remedy="Quote it, or write it as YAML") from error
