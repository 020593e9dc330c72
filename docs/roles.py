"""Cross references of the docstrings for the site: a role becomes a link to what its name stands for."""

import re

from griffe import Extension, Module, NameResolutionError, Object

_ROLE = re.compile(r":(?:func|class|meth|data|mod|attr):`(~?)([\w.]+)`")
_LIBRARY = ("dnnvss.", "data_prep.")


def _target(owner: Object, name: str) -> str | None:
    """The full path of a public name of this library, as it is known at ``owner``."""
    if name.startswith(_LIBRARY):
        return name
    first, _, rest = name.partition(".")
    try:
        path = owner.resolve(first)
    except NameResolutionError:
        return None
    return f"{path}.{rest}".rstrip(".") if path.startswith(_LIBRARY) else None


def linked(owner: Object, text: str) -> str:
    """A docstring whose roles are Markdown links; private names and those of other libraries are plain code."""

    def link(found: re.Match[str]) -> str:
        name = found[2]
        target = None if name.rpartition(".")[2].startswith("_") else _target(owner, name)
        shown = name.rpartition(".")[2] if found[1] else name
        return f"[`{shown}`][{target}]" if target else f"`{shown}`"

    return _ROLE.sub(link, text)


def _rewrite(owner: Object) -> None:
    if owner.docstring:
        owner.docstring.value = linked(owner, owner.docstring.value)
    for member in owner.members.values():
        if isinstance(member, Object):
            _rewrite(member)


class Roles(Extension):
    """Rewrites the docstrings of a package once the whole of it is read."""

    def on_package(self, *, pkg: Module, **_: object) -> None:
        """Turn the roles of all docstrings into links."""
        _rewrite(pkg)
