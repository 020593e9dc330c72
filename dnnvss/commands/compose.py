"""Settings from ``conf/`` without hydra: what a bundle speaks with, whose start should cost little.

Only what ``conf/synth.yaml`` uses is understood: a list of defaults, groups and packages of one level, values, dotted
keys and ``+`` for new ones. The tests hold the result against hydra's.
"""

import re
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from dnnvss.errors import DnnvssError


def compose(folder: Path, name: str, arguments: list[str], texts: tuple[str, ...] = ()) -> DictConfig:
    """Return ``folder/name.yaml`` with its groups and the command line's ``key=value`` arguments.

    Args:
        folder: ``conf``.
        name: of the file.
        arguments: as typed, not quoted for hydra.
        texts: keys whose values are taken as they are.

    Raises:
        DnnvssError: an argument without ``=``, an unknown key or group, or a value that cannot be read.
    """
    pairs = [_pair(argument) for argument in arguments]
    chosen = {key: value for key, value in pairs if (folder / key).is_dir()}
    config = _file(folder, name, chosen)
    for group in set(chosen) - set(config):
        raise DnnvssError(f"{group}={chosen[group]} is not used by {name}.yaml", remedy="Leave it out")
    for key, value in pairs:
        if key not in chosen:
            literal = key in texts and value != "null"
            _set(config, key, _plain(value) if literal else _value(key, value))
    return config


def _file(folder: Path, name: str, chosen: dict[str, str]) -> DictConfig:
    """Return a file merged with its defaults; what the file itself says counts more than what it builds on."""
    path = folder / f"{name}.yaml"
    if not path.is_file():
        raise DnnvssError(f"{folder.name}={name} is unknown",
                          remedy=f"Use one of {sorted(p.stem for p in folder.glob('*.yaml'))}")
    own = OmegaConf.load(path)
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


def _pair(argument: str) -> tuple[str, str]:
    key, equals, value = argument.partition("=")
    if not equals or not key or key.startswith(("-", "~")):
        raise DnnvssError(f"{argument!r} is no setting", remedy="Write key=value; a bundle knows no other arguments")
    return key, value


def _plain(text: str) -> str:
    """Return a text in which ``${`` means itself."""
    return re.sub(r"(\\*)\$\{", r"\1\1\\${", text)


def _value(key: str, text: str) -> Any:
    """Return a value as YAML reads it; ``{a:1}`` needs no space behind the colon."""
    spaced = re.sub(r":(?=[^\s/])", ": ", text) if text.startswith("{") else text
    try:
        return OmegaConf.to_container(OmegaConf.create(f"value: {spaced}"))["value"]  # type: ignore[index,call-overload]
    except Exception as error:  # YAML's scanner and parser have errors of many kinds
        raise DnnvssError(f"{key}={text} cannot be read", remedy="Quote it, or write it as YAML") from error


def _set(config: DictConfig, key: str, value: Any) -> None:
    new, path = key.startswith("+"), key.removeprefix("+")
    missing = object()
    try:
        if not new and OmegaConf.select(config, path, default=missing) is missing:
            raise DnnvssError(f"unknown setting {path!r}", remedy="See conf/synth.yaml for those that there are")
        OmegaConf.update(config, path, value, merge=not isinstance(value, dict), force_add=True)
    except OmegaConfBaseException as error:
        raise DnnvssError(f"{key}={value!r} cannot be set ({error})", remedy="See conf/synth.yaml") from error
