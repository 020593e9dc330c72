"""What the docs, docstrings and comments of the settings name exists; the site and the citation are whole."""

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[1]
PAGES = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")]
CODE = [*(path for room in ("dnnvss", "data_prep") for path in (ROOT / room).rglob("*.py")),
        ROOT / "train.py", ROOT / "synth.py"]
SETTINGS = [*(ROOT / "conf").rglob("*.yaml")]
OLD = ("dnnvss.pipeline", "dnnvss.labels", "dnnvss.evaluation", "dnnvss.export", "pipeline/")
"""Commands of 0.1.0: the changelog and the doors that answer in their place name them."""


_MODULE = re.compile(r"\b(?:dnnvss|data_prep)(?:\.\w+)+")
_FILE = re.compile(r"(?<![\w/<.-])(?:dnnvss|data_prep|conf|docs|benchmarks|tests)/[\w./-]*\w")
_PART = re.compile(r"`((?:\w+/)+\w+\.py)`")


def docstrings(path: Path) -> Iterator[str]:
    """The docstrings of a file, those of constants too, and its comments."""
    source = path.read_text(encoding="utf-8")
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.value.value
    yield from re.findall(r"#.*", source)


def module_exists(name: str) -> bool:
    """Whether a dotted name is a module or a name at the top of one, or a member of that."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        place = ROOT.joinpath(*parts[:count])
        file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
        if file.is_file():
            rest = parts[count:]
            return not rest or re.search(rf"\b{re.escape(rest[0])}\b", file.read_text(encoding="utf-8")) is not None
    return False


def file_exists(name: str) -> bool:
    """Whether a path stands in the repository, from its root or from the package."""
    return any((root / name).exists() for root in (ROOT, ROOT / "dnnvss"))


def unknown(text: str) -> list[str]:
    """The modules and files that a text names and that do not exist."""
    modules = [name for name in _MODULE.findall(text) if not module_exists(name)]
    named = dict.fromkeys([*_FILE.findall(text), *_PART.findall(text)])
    return modules + [name for name in named if not re.search(r"\b[A-Z]{2,}\b", name) and not file_exists(name)]


def test_what_is_not_there_is_found():
    assert unknown("see dnnvss.timing.clock and `timing/clock.py`, conf/train.yaml, dnnvss.timing.FrameClock") == []
    assert unknown("dnnvss.timing.sundial, dnnvss/timing/sundial.py and `timing/sundial.py`") == [
        "dnnvss.timing.sundial", "dnnvss/timing/sundial.py", "timing/sundial.py"]


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_pages_name_what_exists(path):
    missing = unknown(path.read_text(encoding="utf-8"))
    if path.name == "CHANGELOG.md":
        missing = [name for name in missing if not name.startswith(OLD)]
    assert missing == []


def headings(path: Path) -> set[str]:
    """The anchors of a page: its headings as the site and GitHub spell them."""
    text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    plain = (re.sub(r"[^\w\s-]", "", title).strip().lower() for title in re.findall(r"^#+ (.*)", text, re.MULTILINE))
    return {re.sub(r"[-\s]+", "-", title) for title in plain}


@pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_to_a_page_and_a_heading(path):
    lost = []
    for link in re.findall(r"\]\(([^)\s]+)\)", path.read_text(encoding="utf-8")):
        place, _, anchor = link.partition("#")
        target = (path.parent / place).resolve() if place else path
        if "://" not in link and not (target.exists() and (not anchor or anchor in headings(target))):
            lost.append(link)
    assert lost == []


def test_docstrings_and_settings_name_what_exists():
    texts = {path: "\n".join(docstrings(path)) for path in CODE}
    texts |= {path: path.read_text(encoding="utf-8") for path in SETTINGS}
    missing = {str(path.relative_to(ROOT)): names for path, text in texts.items() if (names := unknown(text))}
    assert missing == {}


def test_every_room_has_a_page_of_the_site():
    rooms = {path.name for path in (ROOT / "dnnvss").iterdir() if (path / "__init__.py").is_file()}
    rooms |= {path.stem for path in (ROOT / "dnnvss").glob("*.py") if path.stem not in ("__init__", "__main__")}
    shown = set()
    for page in (ROOT / "docs" / "api").glob("*.md"):
        shown |= set(re.findall(r"^::: dnnvss\.(\w+)$", page.read_text(encoding="utf-8"), re.MULTILINE))
    assert shown == rooms - {"pipeline", "labels", "moved"}  # old names of commands, which say what replaced them
    site = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))
    named = set(re.findall(r"[\w/]+\.md", str(site["nav"])))
    assert named == {str(page.relative_to(ROOT / "docs")) for page in (ROOT / "docs").rglob("*.md")}


def test_the_citation_is_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert {"cff-version", "message", "title", "authors"} <= citation.keys()
    assert (citation["version"], citation["license"]) == (project["version"], project["license"])
