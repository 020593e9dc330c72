"""Settings as typed dataclasses: one reader that checks names, types, ranges and choices.

A settings dataclass declares each value with :func:`setting`; :func:`read_settings` builds it from plain containers,
and its ``__post_init__`` calls :func:`check_settings`, so that an instance built in code is held to the same rules::

    @dataclass(frozen=True)
    class FitSettings:
        epochs: int = setting(12, least=1, doc="passes over the frames")
        optimizer: str = setting("adamw", choices=("sgd", "adamw"))

        def __post_init__(self) -> None:
            check_settings(self, "trainer")

Annotations that are understood: ``int`` (no bool, no float), ``float`` (whole numbers too), ``bool``, ``str``,
``Path``, ``Literal``, ``X | Y``, ``X | None``, ``tuple[X, ...]`` and ``tuple[X, Y]`` (lists are taken),
``Mapping[str, X]`` and other settings dataclasses. A class with ``from_setting(value, where)`` is built by that. Any
other class is held to ``isinstance``.
"""

import dataclasses
import difflib
import math
import os
import types
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Literal, NoReturn, TypeVar, Union, get_args, get_origin, get_type_hints

from dnnvss.errors import DnnvssError

T = TypeVar("T")

MISSING = "???"
"""What stands in a file of ``conf/`` for a value that the command line has to give."""

_LARGEST = 2**63  # of whole numbers

_NOUNS: dict[Any, str] = {int: "whole number", float: "number", bool: "true or false", str: "text", Path: "path",
                          type(None): "null"}


@dataclasses.dataclass(frozen=True)
class Checks:
    """What a value must keep to beside its type; it holds for each value of a tuple or a mapping.

    Args:
        least, most: bounds that may be reached.
        above, below: bounds that may not be reached.
        choices: all values that there are.
        infinite: whether a number may be infinite; one that is not a number is always refused.
        nonzero: whether 0 is left out.
        path: whether a text is a path.
    """

    least: float | None = None
    most: float | None = None
    above: float | None = None
    below: float | None = None
    choices: tuple[Any, ...] | None = None
    infinite: bool = False
    nonzero: bool = False
    path: bool = False

    @property
    def range(self) -> str:
        """The bounds in words, empty where there are none."""
        if self.least is not None and self.most is not None:
            return f"{self.least:g} to {self.most:g}"
        low = f"{self.least:g} or more" if self.least is not None else ""
        low = f"more than {self.above:g}" if self.above is not None else low
        high = f"{self.most:g} at most" if self.most is not None else ""
        high = f"less than {self.below:g}" if self.below is not None else high
        return " and ".join(filter(None, (low, high))) + (", not 0" if self.nonzero else "")

    def fault(self, value: float) -> str | None:
        """What is wrong with a number, None where nothing is."""
        if math.isnan(value) or (math.isinf(value) and not self.infinite):
            return "is not finite"
        if (self.least is not None and value < self.least) or (self.above is not None and value <= self.above):
            return "is too little"
        if (self.most is not None and value > self.most) or (self.below is not None and value >= self.below):
            return "is too much"
        return "means nothing" if self.nonzero and value == 0 else None


def setting(default: Any = dataclasses.MISSING, *, least: float | None = None, most: float | None = None,
            above: float | None = None, below: float | None = None, choices: Iterable[Any] | None = None,
            infinite: bool = False, nonzero: bool = False, path: bool = False, doc: str = "") -> Any:
    """A field of a settings dataclass, with its checks.

    Args:
        default: without one the setting is required; lists and mappings are copied for each instance.
        least, most, above, below, choices, infinite, nonzero, path: see :class:`Checks`.
        doc: what the setting means, in half a sentence.
    """
    checks = Checks(least, most, above, below, None if choices is None else tuple(choices), infinite, nonzero, path)
    metadata = {"checks": checks, "doc": doc}
    if isinstance(default, list | dict):
        return dataclasses.field(default_factory=lambda: type(default)(default), metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


def read_settings(cls: type[T], mapping: Mapping[str, Any], where: str) -> T:
    """The settings that plain containers hold, as an instance of a settings dataclass.

    Args:
        cls: the dataclass.
        mapping: values by name; a name that is absent has its default.
        where: dotted name under which a user gives them (``trainer``); empty at the root.

    Raises:
        DnnvssError: an unknown name, a required setting that is absent, or a value of another type, range or choice.
    """
    if not isinstance(mapping, Mapping):
        _refuse(where or "the settings", mapping, cls, Checks())
    hints, fields = type_hints(cls), dataclasses.fields(cls)  # type: ignore[arg-type]
    known = [f.name for f in fields if f.init]
    for name in mapping:
        if name not in known:
            raise unknown_setting(_join(where, str(name)), [_join(where, k) for k in known])
    values = {}
    for field in fields:
        if field.name in mapping and mapping[field.name] != MISSING:
            name = _join(where, field.name)
            values[field.name] = _read(hints[field.name], mapping[field.name], name, _checks(field))
        elif field.init and dataclasses.MISSING is field.default is field.default_factory:
            name = _join(where, field.name)
            raise DnnvssError(f"{name} is not set", remedy=f"Add {name}=... to the command")
    return cls(**values)


def check_settings(instance: Any, where: str) -> None:
    """Hold the values of a built settings dataclass to its declarations; lists become the tuples that they stand for.

    Args:
        instance: of a dataclass, frozen or not; to be called by its ``__post_init__``.
        where: as for :func:`read_settings`.

    Raises:
        DnnvssError: a value of another type, range or choice.
    """
    hints = type_hints(type(instance))
    for field in dataclasses.fields(instance):
        given = getattr(instance, field.name)
        value = _read(hints[field.name], given, _join(where, field.name), _checks(field))
        if value is not given:
            object.__setattr__(instance, field.name, value)


def unknown_setting(name: str, known: Iterable[str]) -> DnnvssError:
    """The error about a setting that does not exist, with the one that was probably meant."""
    names = list(known)
    ends = {other.rpartition(".")[2]: other for other in reversed(names)}
    near = difflib.get_close_matches(name.rpartition(".")[2], ends, 1)
    others = f"Choose among {', '.join(names)}" if names else "Leave it out"
    remedy = f"Did you mean {ends[near[0]]}?" if near else others
    return DnnvssError(f"{name} is no setting", remedy=remedy)


def type_hints(cls: Any) -> Mapping[str, Any]:
    """The annotations of a settings dataclass, resolved."""
    return _hints(cls)


_hints = cache(get_type_hints)


def shown(value: Any) -> str:
    """A value as a user would type it, short enough for a line."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, Mapping):
        text = "{" + ", ".join(f"{k}: {shown(v)}" for k, v in value.items()) + "}"
    elif isinstance(value, Sequence) and not isinstance(value, str):
        text = "[" + ", ".join(map(shown, value)) + "]"
    else:
        text = str(value)
    text = text if text.isprintable() and text.strip() == text and text else repr(text)
    return text if len(text) <= 80 else f"{text[:77]}..."


def _read(kind: Any, value: Any, name: str, checks: Checks) -> Any:
    """The value as its annotation wants it."""
    if kind is Any:
        return value
    origin, arguments = _parts(kind)
    if origin in (Union, types.UnionType):
        return _read_union(kind, value, name, checks)
    if origin is Literal:
        return _chosen(value, arguments, name)
    if origin is tuple:
        return _read_tuple(kind, value, name, checks)
    if origin is not None and issubclass(origin, Mapping):
        if not isinstance(value, Mapping):
            _refuse(name, value, kind, checks)
        return {_text(k, name): _read(arguments[1], v, _join(name, str(k)), checks) for k, v in value.items()}
    if isinstance(kind, type) and hasattr(kind, "from_setting") and not isinstance(value, kind):
        return kind.from_setting(value, name)
    if dataclasses.is_dataclass(kind) and isinstance(kind, type) and not isinstance(value, kind):
        return read_settings(kind, value, name)
    return _read_leaf(kind, value, name, checks)


@cache
def _parts(kind: Any) -> tuple[Any, tuple[Any, ...]]:
    """Origin and arguments of an annotation."""
    return get_origin(kind), get_args(kind)


def _read_leaf(kind: Any, value: Any, name: str, checks: Checks) -> Any:
    if not _fits(_parts(kind)[0] or kind, value) or (isinstance(value, str) and "\0" in value):
        _refuse(name, value, kind, checks)
    if kind in (int, float):
        if isinstance(value, Integral) and abs(int(value)) > _LARGEST:
            raise DnnvssError(f"{name}: a number of {int(value).bit_length()} bits is too much",
                              remedy=f"Give {_expected(kind, checks)}")
        if (fault := checks.fault(kind(value))) is not None:
            raise DnnvssError(f"{name}={shown(value)} {fault}", remedy=f"Give {_expected(kind, checks)}")
        value = kind(value)
    elif kind is Path:
        value = at_home(value)
    elif checks.path:
        value = str(at_home(value)) if value.startswith("~") else value
    return value if checks.choices is None else _chosen(value, checks.choices, name)


def at_home(path: str | Path) -> Path:
    """A path in which ``~/`` at the start is the user's home folder, as a shell would have it."""
    name = str(path)
    return Path(os.path.expanduser(name)) if name == "~" or name.startswith(_HOME) else Path(path)  # noqa: PTH111


_HOME = tuple(f"~{separator}" for separator in {"/", os.sep})


def _fits(kind: Any, value: Any) -> bool:
    if type(value) is kind:
        return True
    if kind in (int, float):
        return isinstance(value, Integral if kind is int else Real) and not isinstance(value, bool)
    if kind is Path:  # an empty one, such as a variable of a shell that is not set, would be the working directory
        return isinstance(value, Path) or (isinstance(value, str) and value.strip() != "")
    return isinstance(value, kind)


def _read_union(kind: Any, value: Any, name: str, checks: Checks) -> Any:
    """The value as the first alternative that takes it; a fault beyond the type is told as it is."""
    if value is None and type(None) in get_args(kind):
        return None
    members = [m for m in get_args(kind) if m is not type(None)]
    if len(members) == 1 and hasattr(members[0], "from_setting"):
        return _read(members[0], value, name, checks)  # it knows best what it takes
    for member in sorted(members, key=lambda m: m is not type(value)):
        try:
            return _read(member, value, name, checks)
        except DnnvssError as error:
            other = " is unknown" if get_origin(member) is Literal and len(members) > 1 else " is no "
            if not error.problem.startswith(f"{name}={shown(value)}{other}"):
                raise
    return _refuse(name, value, kind, checks)


def _read_tuple(kind: Any, value: Any, name: str, checks: Checks) -> tuple:
    arguments = get_args(kind)
    repeated = len(arguments) == 2 and arguments[1] is ...
    if not _is_list(value) or (not repeated and len(value) != len(arguments)):
        _refuse(name, value, kind, checks)
    kinds = [arguments[0]] * len(value) if repeated else arguments
    read = tuple(_read(k, v, f"{name}[{i}]", checks) for i, (k, v) in enumerate(zip(kinds, value, strict=True)))
    same = isinstance(value, tuple) and all(a is b for a, b in zip(read, value, strict=True))
    return value if same else read


def _is_list(value: Any) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def _chosen(value: Any, choices: Sequence[Any], name: str) -> Any:
    """The value, if it is among the choices."""
    if any(type(value) is type(c) and value == c for c in choices):
        return value
    listed = f"one of {', '.join(map(shown, choices))}"
    near = difflib.get_close_matches(str(value), [str(c) for c in choices], 1)
    raise DnnvssError(f"{name}={shown(value)} is unknown",
                      remedy=f"Did you mean {near[0]}? There are {listed.removeprefix('one of ')}" if near
                      else f"Use {listed}")


def _text(key: Any, name: str) -> str:
    if not isinstance(key, str):
        raise DnnvssError(f"{name}: the name {shown(key)} is no text", remedy="Give a name in letters")
    return key


def _refuse(name: str, value: Any, kind: Any, checks: Checks) -> NoReturn:
    remedy = f"Give {_expected(kind, checks)}"
    if kind is str and not checks.choices and isinstance(value, bool | int | float):
        remedy += (", in quotes: YAML takes yes, no, on and off for true and false" if isinstance(value, bool)
                   else f', in quotes: "{value}"')
    raise DnnvssError(f"{name}={shown(value)} is no {_noun(kind)}", remedy=remedy)


def _noun(kind: Any) -> str:
    """What values of an annotation are called."""
    if get_origin(kind) in (Union, types.UnionType):
        return " or ".join(dict.fromkeys(_noun(m) for m in _told(kind) if m is not type(None)))
    if get_origin(kind) is Literal:
        return " or ".join(map(shown, get_args(kind)))
    if get_origin(kind) is tuple:
        return "list"
    if dataclasses.is_dataclass(kind) or get_origin(kind) is not None:
        return "table of names and values"
    return _NOUNS.get(kind, getattr(kind, "__name__", str(kind)))


def _told(union: Any) -> list[Any]:
    """The alternatives of a union that are told: a whole number is a number."""
    members = get_args(union)
    return [m for m in members if not (m is int and float in members)]


def _expected(kind: Any, checks: Checks) -> str:
    """What to give instead, in words."""
    if get_origin(kind) in (Union, types.UnionType):
        return " or ".join(_expected(m, checks) for m in _told(kind))
    if get_origin(kind) is tuple:
        arguments = [a for a in get_args(kind) if a is not ...]
        if ... in get_args(kind):
            return f"a list, each {_expected(arguments[0], checks)}"
        return f"[{', '.join(_expected(a, checks) for a in arguments)}]"
    if get_origin(kind) is not None and get_origin(kind) is not Literal and issubclass(get_origin(kind), Mapping):
        return f"{{NAME: {_expected(get_args(kind)[1], checks)}}}"
    if checks.choices and kind is not type(None):
        return f"one of {', '.join(map(shown, checks.choices))}"
    noun = _noun(kind)
    article = "" if kind in (bool, str, type(None)) or get_origin(kind) is Literal else "a "
    return article + noun + (f", {checks.range}" if kind in (int, float) and checks.range else "")


def _checks(field: dataclasses.Field) -> Checks:
    return field.metadata.get("checks", _NO_CHECKS)


_NO_CHECKS = Checks()


def _join(where: str, name: str) -> str:
    return f"{where}.{name}" if where else name
