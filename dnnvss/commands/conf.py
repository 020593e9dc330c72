"""Where ``conf/`` lies, and what its files say: groups, their choices, names of settings, and help."""

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf

import dnnvss
from dnnvss import files
from dnnvss.errors import DnnvssError
from dnnvss.files.plain_yaml import read_yaml

_REMEDY = "Write a file such as those of conf/, in YAML and UTF-8"
_PACKAGE = Path(dnnvss.__file__).parent


def conf_folder() -> Path:
    """The folder of settings: inside the package where that was installed from a wheel, else beside it."""
    packed = _PACKAGE / "conf"
    return packed if packed.is_dir() else _PACKAGE.parent / "conf"


def groups(folder: Path, name: str) -> dict[str, str | None]:
    """The groups that ``name.yaml`` builds on, each with its default choice."""
    found: dict[str, str | None] = {}
    for entry in read_file(folder / f"{name}.yaml").get("defaults", []):
        if isinstance(entry, dict):
            (group, choice), = entry.items()
            if not group.startswith("override "):
                found[group.removeprefix("optional ")] = choice
    return found


def choices(folders: Iterable[Path], group: str) -> list[str]:
    """The files of a group in some folders of settings, without suffix."""
    return sorted({path.stem for folder in folders for path in (folder / group).glob("*.yaml")})


def choice_file(group: str, named: str) -> Path:
    """The file of a group's choice by its name, wherever the package lies; any other word is the path of a file."""
    own = conf_folder() / group / f"{named}.yaml"
    return own if named in choices([conf_folder()], group) else Path(named)


def setting_names(folders: Sequence[Path], name: str) -> list[str]:
    """The dotted names of all settings in ``name.yaml`` and in the files of its groups."""
    found = dict.fromkeys(_names(_own(folders[0] / f"{name}.yaml")))
    for group in groups(folders[0], name):
        for folder in folders:
            for path in sorted((folder / group).glob("*.yaml")):
                if "@package _global_" not in files.read_text(path, _REMEDY):
                    found |= dict.fromkeys(f"{group}.{n}" for n in _names(_own(path)))
    return list(found)


def sweep_values(path: Path) -> dict[str, Any]:
    """The settings of which a file gives a sweep its values, by name with hydra's sign; none of most files."""
    found: Any = read_file(path)
    for name in ("hydra", "sweeper", "params"):
        found = found.get(name) if isinstance(found, dict) else None
    return found if isinstance(found, dict) else {}


def help_text(folder: Path, name: str) -> str:
    """The settings of a command with what they mean, from its file and the folders of its groups."""
    text = (folder / f"{name}.yaml").read_text(encoding="utf-8")
    lines = [text[: text.index("\nhydra:")] if "\nhydra:" in text else text]
    for group in sorted(set(re.findall(r"^  - (\w+):", text, re.MULTILINE)) & {p.name for p in folder.iterdir()}):
        lines.append(f"# {group}=... one of: {', '.join(choices([folder], group))}")
    lines.append("# conf/GROUP/NAME.yaml says what the settings of a group mean; give one as GROUP.SETTING=VALUE.\n"
                 "# --cfg job prints all settings with their values, --hydra-help hydra's own options.")
    return "\n".join(lines)


def read_choice(path: Path) -> dict[str, Any]:
    """The settings in one file of a group, which refers to no other, as plain containers.

    Raises:
        DnnvssError: the file is missing or no table of settings.
    """
    plain: Any = files.read(path, lambda p: OmegaConf.to_container(OmegaConf.load(p), resolve=True), _REMEDY)
    if not isinstance(plain, dict) or not all(isinstance(key, str) for key in plain):
        raise DnnvssError("holds no table of settings", file=path, remedy=_REMEDY)
    return plain


def read_file(path: Path) -> dict[str, Any]:
    """What a file of settings says, as plain containers; nothing in it is looked up.

    Raises:
        DnnvssError: it cannot be read, or holds no table.
    """
    loaded: Any = files.read(path, lambda p: read_yaml(p.read_text("utf-8")), _REMEDY)
    if not isinstance(loaded, dict) or not all(isinstance(key, str) for key in loaded):
        raise DnnvssError("holds no table of settings", file=path, remedy=_REMEDY)
    return loaded


def _own(path: Path) -> dict[str, Any]:
    return {key: value for key, value in read_file(path).items() if key not in ("defaults", "hydra")}


def _names(values: dict[str, Any], above: str = "") -> Iterator[str]:
    for key, value in values.items():
        if isinstance(value, dict) and value:
            yield from _names(value, f"{above}{key}.")
        else:
            yield f"{above}{key}"
