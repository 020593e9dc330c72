"""The description of the service for other programs, derived from its routes and settings."""

import dataclasses
import re
from collections.abc import Mapping, Sequence
from types import UnionType
from typing import Any, Union, get_args, get_origin

from dnnvss import __version__
from dnnvss.settings import Checks, type_hints
from dnnvss.studio.page import STREAM, Route
from dnnvss.studio.speaking.saying import Change, Saying

_BODIES: dict[str, Any] = {"/v1/speak": Saying, "/v1/takes/{take}": Change}
_QUERIES = {"/v1/takes/{take}/pictures": {"first": "integer", "count": "integer", "view": "string"}}
_PLAIN = {int: "integer", float: "number", bool: "boolean", str: "string", Any: None}


def described(routes: Sequence[Route]) -> dict[str, Any]:
    """The service in OpenAPI 3.1."""
    paths: dict[str, dict[str, Any]] = {}
    for route in routes:
        method = "get" if route.method == STREAM else route.method.lower()
        paths.setdefault(route.path, {})[method] = _operation(route)
    return {"openapi": "3.1.0", "info": {"title": "dnnvss", "version": __version__,
                                         "description": "A talking face out of text or a voice."}, "paths": paths}


def _operation(route: Route) -> dict[str, Any]:
    named = [{"name": name, "in": "path", "required": True, "schema": {"type": "string"}}
             for name in re.findall(r"{(\w+)}", route.path)]
    asked = [{"name": name, "in": "query", "schema": {"type": kind}}
             for name, kind in _QUERIES.get(route.path, {}).items() if route.method == "GET"]
    refused = {"description": "what is wrong, as {\"error\": ...}"}
    operation: dict[str, Any] = {"summary": route.about, "parameters": named + asked,
                                 "responses": {"200": {"description": route.about}, "400": refused, "503": refused}}
    if route.bytes_most:
        operation["requestBody"] = {"content": {"application/octet-stream": {}}, "required": True}
    elif route.method == "POST":
        schema = _object(_BODIES[route.path]) if route.path in _BODIES else {"type": "object"}
        operation["requestBody"] = {"content": {"application/json": {"schema": schema}}, "required": True}
    return operation


def _object(cls: Any) -> dict[str, Any]:
    hints, fields = type_hints(cls), dataclasses.fields(cls)
    needed = [f.name for f in fields if dataclasses.MISSING is f.default is f.default_factory]
    properties = {f.name: {**_schema(hints[f.name]), **_bounds(f.metadata.get("checks")),
                           "description": f.metadata.get("doc", "")} for f in fields}
    return {"type": "object", "additionalProperties": False, "properties": properties, "required": needed}


def _schema(hint: Any) -> dict[str, Any]:
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, UnionType):
        return {"anyOf": [_schema(kind) for kind in inner]}
    if hint is type(None):
        return {"type": "null"}
    if origin is tuple:
        return {"type": "array", "items": _schema(inner[0])}
    if origin is not None and issubclass(origin, Mapping):
        return {"type": "object", "additionalProperties": _schema(inner[1])}
    if dataclasses.is_dataclass(hint):
        return _object(hint)
    kind = _PLAIN.get(hint)
    return {"type": kind} if kind else {}


def _bounds(checks: Checks | None) -> dict[str, Any]:
    if checks is None:
        return {}
    known = {"minimum": checks.least, "maximum": checks.most, "exclusiveMinimum": checks.above,
             "exclusiveMaximum": checks.below, "enum": None if checks.choices is None else list(checks.choices)}
    return {name: value for name, value in known.items() if value is not None}
