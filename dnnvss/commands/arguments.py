"""The one parser of settings: ``key=value`` arguments, checked against what a command knows, and quoted.

Hydra and OmegaConf give commas, colons, braces, quotes and ``${`` a meaning of their own; in a text or a path they are
just text. Which settings hold text is what their types say.
"""

import difflib
import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, takewhile
from pathlib import Path
from typing import Any

from dnnvss.commands.annotations import annotations, is_text, setting_paths, several_kinds
from dnnvss.commands.conf import choices, conf_folder, groups, read_file, setting_names, sweep_values
from dnnvss.commands.usage import UsageError
from dnnvss.settings import unknown_setting

_FLAGS = {"--help": 0, "-h": 0, "--hydra-help": 0, "--version": 0, "--resolve": 0, "--run": 0, "-r": 0,
          "--multirun": 0, "-m": 0, "--shell-completion": 0, "-sc": 0, "--cfg": 1, "-c": 1, "--package": 1, "-p": 1,
          "--config-path": 1, "-cp": 1, "--config-name": 1, "-cn": 1, "--config-dir": 1, "-cd": 1,
          "--info": 0, "-i": 0}
"""Hydra's own options, and how many values each takes."""
_SHOWN = ("job", "hydra", "all")
"""What hydra's ``--cfg`` takes."""
_SWEPT = re.compile(r"^(choice|range|interval|glob|shuffle|sort|tag|extend_list)\(.*\)$", re.DOTALL)
_PARSED = re.compile(r"^(?P<sign>\+\+|\+|~)?(?P<key>[^=]*)(?P<equals>=)?(?P<value>.*)$", re.DOTALL)


@dataclass(frozen=True)
class Override:
    """One argument.

    Args:
        sign: ``+`` adds, ``++`` adds or replaces, ``~`` deletes; empty for what a user usually types.
        key: dotted name of a setting, or a group.
        value: as typed, None where a deletion has none.
        text: whether no sign in the value has a meaning.
    """

    sign: str
    key: str
    value: str | None
    text: bool = False

    def for_hydra(self, several: bool = False) -> str:
        """The argument as hydra's grammar wants it; with ``several`` commas part the values of a sweep."""
        if self.value is None:
            return f"{self.sign}{self.key}"
        values = self.value.split(",") if several else [self.value]
        value = ",".join(map(quoted, values)) if self.text and not _SWEPT.match(self.value) else self.value
        return f"{self.sign}{self.key}={value}"


@dataclass(frozen=True)
class SettingsCommand:
    """A command whose arguments are settings.

    Args:
        name: as typed behind ``dnnvss``.
        config: the file of ``conf/`` that holds its settings.
        root: the dataclass that types them.
        bare: the setting that a word without ``=`` was probably meant for.
        literal: whether quotes around a text are part of it.
    """

    name: str
    config: str
    root: Any
    bare: str
    literal: bool = False


@dataclass(frozen=True)
class Arguments:
    """The command line of a settings command, parsed and checked.

    Args:
        command: whose it is.
        flags: hydra's own options with their values.
        overrides: the settings.
    """

    command: SettingsCommand
    flags: tuple[str, ...]
    overrides: tuple[Override, ...]

    @property
    def swept(self) -> bool:
        """Whether hydra is asked for a multirun."""
        return bool({"-m", "--multirun"} & set(self.flags))

    @property
    def needs_hydra(self) -> bool:
        """Whether something is asked for that only hydra can do."""
        return bool(self.flags) or any(o.key.startswith("hydra") or o.sign == "~" for o in self.overrides)

    def for_hydra(self) -> list[str]:
        """The arguments as hydra wants them."""
        return [*self.flags, *(o.for_hydra(self.swept) for o in self.overrides)]


def parse_arguments(command: SettingsCommand, arguments: Sequence[str]) -> Arguments:
    """The arguments of a command.

    Raises:
        UsageError: an unknown option, setting, group or choice, or a word that is no setting; it says what was probably
            meant.
    """
    flags, words = _split(command, list(arguments))
    _refuse_parted(command.bare, words)
    known = _Known(command, _folders(flags))
    swept = bool({"-m", "--multirun"} & set(flags))
    overrides = [known.checked(word, swept) for word in words]
    signs = known.sweeps(overrides) if swept else {}
    named = (replace(o, sign=signs.get(o.key, o.sign)) if o.sign != "~" else o for o in overrides)
    return Arguments(command, tuple(flags), tuple(named))


def quoted(value: str) -> str:
    """A text in hydra's quotes, so that every sign in it means itself."""
    if value == "null":
        return value
    plain = re.sub(r"(\\*)\$\{", r"\1\1\\${", value)
    escaped = re.sub(r"(\\*)('|$)", lambda m: m[1] * 2 + (m[2] and "\\'"), plain)
    return f"'{escaped}'"


def _split(command: SettingsCommand, arguments: list[str]) -> tuple[list[str], list[str]]:
    """Hydra's options with their values, and all else."""
    flags, words = [], []
    while arguments:
        word = arguments.pop(0)
        name, equals, _ = word.partition("=")
        if not word.startswith("-"):
            words.append(word)
        elif name not in _FLAGS:
            raise _unknown_flag(command, word, arguments)
        else:
            flags.append(word)
            if name in ("--info", "-i") and arguments and re.fullmatch(r"[a-z-]+", arguments[0]):
                flags.append(arguments.pop(0))
            for _ in range(_FLAGS[name] if not equals else 0):
                if not arguments:
                    raise UsageError(f"{word} needs a value", remedy=f"Write {word} VALUE")
                flags.append(arguments.pop(0))
            if name in ("--cfg", "-c") and (flags[-1].partition("=")[2] or flags[-1]) not in _SHOWN:
                raise UsageError(f"{name} shows one of {', '.join(_SHOWN)}", remedy=f"Write {name} job")
    return flags, words


def _refuse_parted(name: str, words: list[str]) -> None:
    """Refuse ``text=Hello there``, which the shell parted at its spaces, and show it in quotes."""
    for i, (word, behind) in enumerate(pairwise(words), 1):
        if word.startswith(f"{name}=") and "=" not in behind and not behind.startswith("~"):
            parts = [word.partition("=")[2], *takewhile(lambda w: "=" not in w, words[i:])]
            raise UsageError(f"{behind} is no setting", remedy=f"Did you mean {_typed(name, ' '.join(parts))}?")


def _unknown_flag(command: SettingsCommand, word: str, behind: list[str]) -> UsageError:
    name, equals, value = word.lstrip("-").partition("=")
    wanted = name.replace("-", "_")
    if not equals and behind and not behind[0].startswith("-") and "=" not in behind[0]:
        value = behind[0]
    meant = _Known(command, [conf_folder()]).nearest(wanted)
    if meant is None:
        near = difflib.get_close_matches(word, _FLAGS, 1, 0.7)
        return UsageError(f"{word} is no option of {command.name}",
                          remedy=f"Did you mean {near[0]}?" if near else
                          f"Write settings as NAME=VALUE; dnnvss {command.name} --help lists them")
    return UsageError(f"{word} is no option of {command.name}", remedy=f"Did you mean {_typed(meant, value)}?")


def _folders(flags: list[str]) -> list[Path]:
    """The folders of settings: the user's own come last."""
    own = [Path(b) for a, b in pairwise(flags) if a in ("--config-dir", "-cd")]
    own += [Path(a.partition("=")[2]) for a in flags if a.startswith(("--config-dir=", "-cd="))]
    for folder in own:
        if not folder.is_dir():
            raise UsageError("no such folder", file=folder, remedy="Give --config-dir a folder of settings")
        for path in sorted(folder.rglob("*.yaml")):
            read_file(path)  # hydra's words for one that is damaged name neither file nor remedy
    return [conf_folder(), *own]


def _typed(key: str, value: str) -> str:
    """An argument as a user would type it in a shell."""
    return f"{key}={shlex.quote(value) if value else '...'}"


@dataclass(frozen=True)
class _Known:
    """What a command knows: groups, choices and names of settings, in some folders."""

    command: SettingsCommand
    folders: list[Path]

    @cached_property
    def groups(self) -> dict[str, str | None]:
        return groups(self.folders[0], self.command.config)

    @cached_property
    def in_files(self) -> list[str]:
        return setting_names(self.folders, self.command.config)

    @cached_property
    def names(self) -> list[str]:
        return list(dict.fromkeys([*self.in_files, *setting_paths(self.command.root)]))

    def checked(self, word: str, swept: bool) -> Override:
        """The override that a word stands for."""
        match = _PARSED.match(word)
        assert match is not None
        sign, key, value = match["sign"] or "", match["key"], match["value"] if match["equals"] else None
        override = Override(sign, key, value)
        if "@" in key or key.startswith(("hydra.", "hydra/")):
            return override
        if value is None and sign != "~":
            raise self._bare(word)
        if key in self.groups:
            return self._group(replace(override, sign=sign if sign == "~" else ""), swept)
        if not self._exists(key):
            if sign != "~" and several_kinds(self.command.root, key) and all(key.split(".")) and not self._deeper(key):
                return replace(override, sign="++")  # the typed settings know which kind it is, and tell what that has
            raise self._unknown(key, value or "")
        wrapped = not self.command.literal and value is not None and _is_wrapped(value)
        text = is_text(self.command.root, key) and not wrapped and not self._refers(value or "")
        # some files of a group may not hold a setting that its type has: hydra adds it where it is absent
        return replace(override, text=text, sign="++" if "." in key and sign != "~" else sign)

    def sweeps(self, overrides: Sequence[Override]) -> dict[str, str]:
        """The settings of which chosen files, such as an experiment's, give a sweep its values, and their signs there.

        Hydra lets these give way to what is typed under the same sign alone.
        """
        chosen = [folder / o.key / f"{choice}.yaml" for o in overrides if o.key in self.groups
                  for choice in (o.value or "").split(",") for folder in self.folders]
        names = [name for path in chosen if path.is_file() for name in sweep_values(path)]
        found = (_PARSED.match(name) for name in names)
        return {match["key"]: match["sign"] or "" for match in found if match is not None}

    def _exists(self, key: str) -> bool:
        if not key or any(not part for part in key.split(".")):
            return False
        return bool(annotations(self.command.root, key)) or any(n == key or n.startswith(f"{key}.") for n in self.names)

    def _refers(self, value: str) -> bool:
        """Whether a value takes that of another setting, as hydra's interpolations do."""
        if self.command.literal:
            return False
        return any(inner in self.names or re.match(r"^(oc\.\w+|hydra|now):", inner)
                   for inner in re.findall(r"\$\{([^{}]*)\}", value))

    def _group(self, override: Override, swept: bool) -> Override:
        group, value = override.key, override.value
        if value is None or _SWEPT.match(value):
            return override
        known = choices(self.folders, group)
        for choice in value.split(",") if swept else [value]:
            if choice == "null" and self.groups[group] is None:
                continue
            if choice not in known and not _is_wrapped(choice) and "${" not in choice and "/" not in choice:
                raise self._unknown_choice(group, choice, known)
        return override

    def _unknown_choice(self, group: str, choice: str, known: list[str]) -> UsageError:
        near = difflib.get_close_matches(choice, known, 1, 0.6)
        meant = f"Did you mean {group}={near[0]}? " if near else ""
        if group == "corpus" and not near and choice:
            meant = f"Did you mean corpus=folder {_typed('corpus.name', choice)}? "
        return UsageError(f"{group}={choice} is unknown", remedy=f"{meant}There are {', '.join(known)}")

    def _bare(self, word: str) -> UsageError:
        for group in self.groups:
            if word in choices(self.folders, group):
                return UsageError(f"{word} is no setting", remedy=f"Did you mean {group}={word}?")
        meant = f"{word}=..." if self._exists(word) else _typed(self.command.bare, word)
        return UsageError(f"{word} is no setting", remedy=f"Did you mean {meant}?")

    def _unknown(self, key: str, value: str) -> UsageError:
        if key in (path.name for path in self.folders[0].iterdir() if path.is_dir()) and key not in self.groups:
            return UsageError(f"{key}={value} is not used by {self.command.name}",
                              remedy=f"{key} belongs to another command; leave it out")
        meant = self.nearest(key)
        if meant is not None:
            return UsageError(f"{key} is no setting of {self.command.name}",
                              remedy=f"Did you mean {_typed(meant, value)}?")
        error = unknown_setting(key, self._beside(key))
        return UsageError(error.problem, remedy=error.remedy)

    def _beside(self, key: str) -> list[str]:
        """The settings of the group that a key is in, or those of the top."""
        head = key.rpartition(".")[0]
        inside = [n for n in self.names if n.startswith(f"{head}.")] if head else []
        return inside or list(dict.fromkeys([*(n for n in self.names if "." not in n), *self.groups]))

    def _deeper(self, key: str) -> bool:
        """Whether a key that there is not has the last name, or nearly, of a setting further down in its group."""
        head, _, last = key.partition(".")
        inside = [n for n in self.names if n.startswith(f"{head}.") and n.count(".") > key.count(".")]
        return bool(difflib.get_close_matches(last, {n.rpartition(".")[2] for n in inside}, 1, 0.8))

    def nearest(self, key: str) -> str | None:
        """The setting or group that was probably meant, None where none is like it."""
        names = [*self.names, *self.groups]
        if key in names:
            return key
        last = key.rpartition(".")[2]
        same = [n for n in names if n.rpartition(".")[2] == last]
        if same:
            # those of visemes come last: most labels have none
            return min(same, key=lambda n: (not n.endswith(f".{key}"), n.count("."), n.startswith("visemes."),
                                            names.index(n)))
        ends = difflib.get_close_matches(last, {n.rpartition(".")[2] for n in names}, 1, 0.8)
        alike = [n for n in names if n.rpartition(".")[2] in ends]
        near = difflib.get_close_matches(key, alike or names, 1, 0.0 if alike else 0.8)
        return near[0] if near else None


def _is_wrapped(value: str) -> bool:
    """Whether a value stands in quotes of its own, for hydra."""
    return len(value) > 1 and value[0] == value[-1] and value[0] in "'\""
