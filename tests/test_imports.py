"""No circle of modules, whether an import is at the top, in a function or for types alone."""

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

ROOT = Path(__file__).parents[1]


def name_of(path: Path) -> str:
    """The dotted name of a module file."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def imported(path: Path, modules: dict[str, Path]) -> Iterator[str]:
    """The modules of this repository that a file imports, wherever in the file it does so."""
    package = name_of(path).split(".")[: None if path.name == "__init__.py" else -1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            start = ".".join([*base, *filter(None, [node.module])])
            names = {f"{start}.{alias.name}" for alias in node.names}
            yield from names & modules.keys()
            if start in modules and names - modules.keys():
                yield start


def circle(graph: dict[str, set[str]]) -> list[str]:
    """One circle of a graph, its first module again at the end; empty where there is none."""
    try:
        tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        return list(error.args[1])
    return []


@cache
def house() -> dict[str, set[str]]:
    """What every module of the package and of the preparation imports of them."""
    files = [path for room in ("dnnvss", "data_prep") for path in (ROOT / room).rglob("*.py")]
    modules = {name_of(path): path for path in files}
    return {name: set(imported(path, modules)) - {name} for name, path in modules.items()}


def test_a_circle_is_found(tmp_path):
    assert set(circle({"a": {"b"}, "b": {"c"}, "c": {"b"}})) == {"b", "c"}
    assert circle({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_an_import_inside_a_function_and_a_relative_one_count():
    graph = house()
    assert "dnnvss.errors" in graph["dnnvss.files.whole"]
    assert "data_prep.alignments" in graph["data_prep.pipeline"]
    assert graph["dnnvss.errors"] == set()


def test_no_circle_of_modules():
    assert circle(house()) == []
