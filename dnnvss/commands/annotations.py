"""What the typed root of a command says about a dotted setting: whether there is one, and whether it holds text."""

import dataclasses
import types
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal, Union, get_args, get_origin

from dnnvss.settings import type_hints


def annotations(root: Any, name: str) -> list[Any]:
    """The annotations that a dotted setting may have under a root; none where there is no such setting.

    A class whose settings depend on one of them (a system on its kind) lists the dataclasses in ``alternatives()``.
    """
    found = [root]
    for part in name.split("."):
        found = [inner for kind in found for inner in _inside(kind, part)]
    return found


def several_kinds(root: Any, name: str) -> bool:
    """Whether the settings of the group in which a dotted setting stands depend on one of them."""
    head, dot, _ = name.partition(".")
    chosen = [kind for kind in annotations(root, head) if hasattr(kind, "alternatives")]
    return bool(dot) and any(len(_members(kind)) > 1 for kind in chosen)


def setting_paths(root: Any, above: str = "") -> list[str]:
    """The dotted names of all settings under a root that have fixed names."""
    found: list[str] = []
    for kind in _members(root):
        if dataclasses.is_dataclass(kind):
            hints = type_hints(kind)
            for name in (f.name for f in dataclasses.fields(kind) if f.init):
                path = f"{above}.{name}" if above else name
                found += setting_paths(hints[name], path) or [path]
    return list(dict.fromkeys(found))


def is_text(root: Any, name: str) -> bool:
    """Whether a setting holds a text or a path, so that no sign in it means anything else."""
    leaves = [leaf for kind in annotations(root, name) for leaf in _members(kind)]
    texts = [leaf for leaf in leaves if leaf in (str, Path) or get_origin(leaf) is Literal]
    return any(leaf in (str, Path) for leaf in leaves) and len(texts) == len([x for x in leaves if x is not type(None)])


def _inside(kind: Any, part: str) -> list[Any]:
    found = []
    for member in _members(kind):
        if dataclasses.is_dataclass(member):
            hints = type_hints(member)
            found += [hints[part]] if part in _fields(member) else []
        elif get_origin(member) is not None and _is_mapping(get_origin(member)):
            found.append(get_args(member)[1])
        elif member is Any:
            found.append(Any)
    return found


def _members(kind: Any) -> list[Any]:
    """The alternatives of an annotation."""
    if get_origin(kind) in (Union, types.UnionType):
        return [inner for member in get_args(kind) for inner in _members(member)]
    if hasattr(kind, "alternatives"):
        return list(kind.alternatives())
    return [kind]


def _fields(kind: Any) -> set[str]:
    return {field.name for field in dataclasses.fields(kind) if field.init}


def _is_mapping(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, Mapping)
