"""No environment decides how a command ends."""

import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dnnvss import files
from dnnvss.commands.entry import main
from dnnvss.errors import DnnvssError, ShortageError
from dnnvss.evaluation.optional import attempted
from dnnvss.render.plots import plot_trajectories
from dnnvss.timing import Tier


def test_a_notebooks_backend_and_a_narrow_console_end_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    console = io.TextIOWrapper(io.BytesIO(), encoding="cp1252")
    monkeypatch.setattr(sys, "stdout", console)
    assert main(["--version"]) == 0 and os.environ["MPLBACKEND"] == "agg"
    print("wrote 日本.mp4", file=console, flush=True)
    assert b"wrote \\u65e5\\u672c.mp4" in console.buffer.getvalue()  # type: ignore[attr-defined]


@pytest.mark.parametrize(("said", "count"), [({}, "10000"), ({"GOMP_SPINCOUNT": "7"}, "7"),
                                             ({"OMP_WAIT_POLICY": "ACTIVE"}, None)])
def test_threads_that_wait_soon_sleep_unless_they_are_told_not_to(monkeypatch: pytest.MonkeyPatch, said: dict[str, str],
                                                                  count: str | None) -> None:
    for name in ("OMP_WAIT_POLICY", "GOMP_SPINCOUNT"):
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)  # so that it is put back afterwards
    for name, value in said.items():
        monkeypatch.setenv(name, value)
    assert main(["--version"]) == 0 and os.environ.get("GOMP_SPINCOUNT") == count


@pytest.mark.parametrize("said, count", [({}, "20"), ({"OPENBLAS_THREAD_TIMEOUT": "26"}, "26")])
def test_threads_of_numpy_are_told_so_before_it_is_loaded(said: dict[str, str], count: str) -> None:
    program = "import os, sys, dnnvss.commands; print('numpy' in sys.modules, os.environ['OPENBLAS_THREAD_TIMEOUT'])"
    own = {name: value for name, value in os.environ.items() if name != "OPENBLAS_THREAD_TIMEOUT"}
    done = subprocess.run([sys.executable, "-c", program], env=own | said, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", count]


@pytest.mark.parametrize("title", ["A $100 fee plus 5% of $2000.", "a_b^c $\\frac{x$ {}", "100% #1 \\ $", "$",
                                   "日本 $x$"])
@pytest.mark.filterwarnings("ignore:Glyph")
def test_signs_of_formulas_in_a_title_are_signs(tmp_path: Path, title: str) -> None:
    phones = Tier("phones", [(0, 0.2, "sil"), (0.2, 0.4, "AA")])
    path = plot_trajectories(tmp_path / "a.png", {"a_$b$": np.zeros(10)}, 25, phones, title, "c_$1")
    assert path.stat().st_size > 1000


def test_what_a_run_can_do_without_costs_it_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    def draw() -> None:
        raise ValueError("no\nfont")

    def full() -> None:
        raise ShortageError("no memory", remedy="Close something")

    assert not attempted("a figure", draw) and "without a figure: ValueError: no font" in capsys.readouterr().out
    assert attempted("a figure", lambda: None)
    with pytest.raises(DnnvssError, match="no memory"):
        attempted("a figure", full)


def test_a_text_is_utf8_whatever_the_locale_took_it_for() -> None:
    for text in ("caf\u00e9", "na\u00efve, \u65e5\u672c"):
        taken = text.encode().decode("ascii", "surrogateescape")
        assert files.as_utf8(taken) == text == files.as_utf8(text)
    assert files.as_utf8("caf\udce9") == "caf\udce9"


def test_names_that_are_not_utf8_can_be_told_and_kept(tmp_path: Path) -> None:
    name = os.fsdecode(b"caf\xe9.mp4")
    assert files.printable(f"wrote {name} to 日本") == "wrote caf\\xe9.mp4 to 日本"
    assert files.read_json(files.write_json(tmp_path / "a.json", {"video": name})) == {"video": name}
    assert files.write_text(tmp_path / "a.txt", name).read_text("utf-8") == "caf\\xe9.mp4"


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere names of files are UTF-8 in every locale")
def test_names_that_the_locale_has_no_letters_for_are_told(tmp_path: Path) -> None:
    program = "from dnnvss.commands.usage import guarded; guarded(lambda: open('d\\u00e9mo'))()"
    done = subprocess.run([sys.executable, "-c", program], env=os.environ | {"LC_ALL": "C", "PYTHONUTF8": "0"},
                          capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 1 and done.stderr.count("\n") == 1
    assert "which has no '\\xe9'" in done.stderr and "Set PYTHONUTF8=1" in done.stderr
