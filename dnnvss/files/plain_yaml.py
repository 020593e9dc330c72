"""YAML of ours, as OmegaConf understands it, read by the parser in C where PyYAML has it."""

import re
from typing import Any

import yaml

Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _PlainLoader(Loader):
    """No tags of Python's, no dates, no key twice; ``1e-3`` is a number."""

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        """A table, none of whose keys comes twice."""
        keys = [key.value for key, _ in node.value if key.tag == yaml.resolver.BaseResolver.DEFAULT_SCALAR_TAG]
        for twice in (key for key in keys if keys.count(key) > 1):
            raise yaml.constructor.ConstructorError("while constructing a mapping", node.start_mark,
                                                    f"found duplicate key {twice}", node.start_mark)
        return super().construct_mapping(node, deep=deep)


_FLOAT = re.compile(r"""^(?:[-+]?[0-9]+(?:_[0-9]+)*\.[0-9_]*(?:[eE][-+]?[0-9]+)?
                         |[-+]?[0-9]+(?:_[0-9]+)*(?:[eE][-+]?[0-9]+)
                         |\.[0-9]+(?:_[0-9]+)*(?:[eE][-+][0-9]+)?
                         |[-+]?[0-9]+(?:_[0-9]+)*(?::[0-5]?[0-9])+\.[0-9_]*
                         |[-+]?\.(?:inf|Inf|INF)
                         |\.(?:nan|NaN|NAN))$""", re.VERBOSE)
_PlainLoader.add_implicit_resolver("tag:yaml.org,2002:float", _FLOAT, list("-+0123456789."))
_PlainLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag != "tag:yaml.org,2002:timestamp"]
    for first, resolvers in _PlainLoader.yaml_implicit_resolvers.items()}


_DEEPEST = 50
"""Values in each other; the parser, whose stack Python does not watch, would end the process beyond some thousands."""


class UnfitError(yaml.YAMLError):
    """YAML that no file of ours needs to hold."""


def read_yaml(text: str, aliases: bool = True) -> Any:
    """What a text says, in plain containers; an empty one is an empty table. Nothing in it is looked up.

    Args:
        text: YAML.
        aliases: whether it may hold an alias, by which a few lines grow without end.

    Raises:
        UnfitError: it holds an alias that it may not, or is nested too deeply.
        yaml.YAMLError: it is no YAML, or holds a tag of Python's or a key twice.
    """
    depth = 0
    for event in yaml.parse(text, Loader):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > _DEEPEST:
            raise UnfitError(f"holds more than {_DEEPEST} values in each other")
        if isinstance(event, yaml.AliasEvent) and not aliases:
            raise UnfitError("holds an alias (*NAME)")
    found = yaml.load(text, _PlainLoader)
    return {} if found is None else found
