"""The container file, read: what it names is there, and what it starts is taken.

It is built nowhere here: that needs an engine and the network.
"""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from dnnvss.commands import studio
from dnnvss.studio.page import Asked, Page, Route
from dnnvss.studio.server import Server

HOUSE = Path(__file__).parents[1]
KNOWN = {"FROM", "ARG", "WORKDIR", "COPY", "RUN", "USER", "VOLUME", "EXPOSE", "HEALTHCHECK", "ENTRYPOINT", "ENV"}
TOKEN = "a-token-of-the-test"


def instructions() -> list[tuple[str, str]]:
    """The instructions, each with what follows its name."""
    lines = (HOUSE / "Containerfile").read_text("utf-8").splitlines()
    joined = "\n".join(line for line in lines if not line.startswith("#")).replace("\\\n", " ")
    return [(line.split()[0], line.partition(" ")[2].strip()) for line in joined.splitlines() if line.strip()]


def listed(name: str) -> list[str]:
    """The words of an instruction that ends in a list."""
    (found,) = [rest for own, rest in instructions() if own == name]
    words = json.loads(found[found.index("["):])
    assert all(isinstance(word, str) for word in words)
    return list(words)


def test_it_is_made_of_known_instructions_that_begin_with_an_image() -> None:
    names = [name for name, _ in instructions()]
    assert names[0] == "FROM" and set(names) <= KNOWN and names[-1] == "ENTRYPOINT"
    assert "python:3.11" in instructions()[0][1]
    for name, rest in instructions():
        if name == "RUN":
            done = subprocess.run(["sh", "-n", "-c", rest], capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr


def test_what_it_copies_is_there_and_not_left_out() -> None:
    kept = {line[1:] for line in (HOUSE / ".dockerignore").read_text().splitlines() if line.startswith("!")}
    copied = {word for name, rest in instructions() if name == "COPY" for word in rest.split()[:-1]}
    assert copied == kept
    assert all((HOUSE / name).exists() for name in copied)
    project = (HOUSE / "pyproject.toml").read_text("utf-8")
    needed = re.findall(r'^(?:readme|license) = .*?"([\w.]+\.md|LICENSE)"', project, re.M)
    packed = re.findall(r'"(\w+)"', project.split("packages = ")[1].split("\n")[0])
    assert {*needed, *packed, "conf"} <= copied


def test_nobody_is_root_in_it() -> None:
    assert [rest for name, rest in instructions() if name == "USER"] == ["speaker"]
    names = [name for name, _ in instructions()]
    assert names.index("USER") > names.index("RUN")


def test_what_it_starts_is_taken_and_its_port_is_the_open_one() -> None:
    words = listed("ENTRYPOINT")
    assert words[:2] == ["dnnvss", "studio"]
    options = studio.flags().read(words[2:])
    (port,) = [rest for name, rest in instructions() if name == "EXPOSE"]
    (volume,) = [rest for name, rest in instructions() if name == "VOLUME"]
    assert (options.port, options.host, str(options.runs)) == (int(port), "0.0.0.0", volume)
    assert f"127.0.0.1:{port}" in options.name and str(options.log) == "-"


def test_its_check_of_health_tells_well_from_not_well(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DNNVSS_TOKEN", TOKEN)
    words = listed("HEALTHCHECK")
    well = []

    def health(asked: Asked) -> dict[str, bool]:
        if not well:
            raise RuntimeError("not well")
        return {"well": True}

    with Server(Page("labelling", (Route("GET", "/v1/health", health),)), token=TOKEN) as server:
        code = words[-1].replace(":8766/", f":{server.port}/")
        command = [sys.executable, *words[1:-1], code]
        assert subprocess.run(command, capture_output=True, check=False).returncode != 0
        well.append(True)
        assert subprocess.run(command, capture_output=True, check=False).returncode == 0
        monkeypatch.setenv("DNNVSS_TOKEN", "another")
        assert subprocess.run(command, capture_output=True, check=False).returncode != 0
