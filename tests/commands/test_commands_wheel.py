"""A wheel works outside the clone: the console script, the settings and the data of the package are in it."""

import os
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import pytest
from conftest import ROOT

from dnnvss.commands.entry import COMMANDS


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this clone."""
    pytest.importorskip("hatchling", reason="hatchling builds the wheel; it is in the extra `test`")
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation",
                    "--disable-pip-version-check", "-w", folder, ROOT], check=True, capture_output=True)
    return next(folder.glob("*.whl"))


def test_a_source_distribution_holds_all_that_is_kept() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("this is no clone")
    kept = subprocess.run(["git", "ls-tree", "--name-only", "HEAD"], cwd=ROOT, check=True, capture_output=True,
                          text=True)
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    held = {name.removeprefix("/") for name in settings["tool"]["hatch"]["build"]["targets"]["sdist"]["include"]}
    by_itself = {".gitignore", "LICENSE", "README.md", "pyproject.toml"}  # hatchling takes these unasked
    assert set(kept.stdout.split()) <= held | by_itself


@pytest.mark.slow
def test_settings_and_data_of_the_package_are_in_the_wheel(wheel: Path) -> None:
    held = set(zipfile.ZipFile(wheel).namelist())
    wanted = {f"dnnvss/{path.relative_to(ROOT).as_posix()}" for path in (ROOT / "conf").rglob("*.yaml")}
    rooms = [path for room in ("dnnvss", "data_prep") for path in (ROOT / room).rglob("*")]
    wanted |= {path.relative_to(ROOT).as_posix() for path in rooms
               if path.is_file() and "__pycache__" not in path.parts}
    assert wanted <= held


@pytest.mark.slow
def test_commands_of_an_installed_wheel_work_outside_the_clone(wheel: Path, tmp_path: Path) -> None:
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    python = tmp_path / "venv" / "bin" / "python"
    subprocess.run([sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps",
                    "--disable-pip-version-check", wheel], check=True, capture_output=True)
    site = subprocess.run([python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"], check=True,
                          capture_output=True, text=True).stdout.strip()
    Path(site, "zz_dependencies.pth").write_text(sysconfig.get_path("purelib"), encoding="utf-8")
    elsewhere = tmp_path / "else, where's $x"
    elsewhere.mkdir()

    def run(*words: str) -> subprocess.CompletedProcess[str]:
        plain = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        return subprocess.run([tmp_path / "venv" / "bin" / "dnnvss", *words], capture_output=True, text=True,
                              cwd=elsewhere, env=plain, check=False)

    overview = run("--help")
    assert overview.returncode == 0 and all(f"  {name} " in overview.stdout for name in COMMANDS)
    assert "corpus=... one of: demo, facegood, folder, grid" in run("train", "--help").stdout
    assert run("features").stdout.startswith("# Features")
    made = run("prepare", "corpus=demo", "corpus.sentences=3", "corpus.size=64", f"corpus.out={elsewhere}/c", "jobs=1")
    assert made.returncode == 0, made.stderr
    assert (elsewhere / "c" / "corpus.json").is_file()
    refused = run("train", "trainer.epochs=abc")
    assert refused.returncode == 2 and "trainer.epochs=abc is no whole number" in refused.stderr
