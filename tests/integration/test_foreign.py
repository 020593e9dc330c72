"""Foreign runs, bundles, corpora and labels are data; killed commands are repeated; sets of files come whole."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import hostile
import numpy as np
import pytest
from conftest import ROOT

ENVIRONMENT = {**os.environ, "PYTHONPATH": os.pathsep.join((str(ROOT), str(ROOT / "tests"))), "OMP_NUM_THREADS": "1"}


def program(*words: object, **more: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *map(str, words)], capture_output=True, text=True, cwd=ROOT, env=ENVIRONMENT,
                          **more)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("foreign")


@pytest.fixture(scope="module")
def played(folder: Path) -> dict[str, dict[str, Any]]:
    done = program(ROOT / "tests" / "hostile.py", folder, check=True)
    return {each["case"]: each for each in map(json.loads, done.stdout.splitlines())}


@pytest.mark.slow
@pytest.mark.parametrize("case", hostile.CASES)
def test_what_is_foreign_runs_reads_and_writes_nothing(case: str, played: dict[str, dict[str, Any]]) -> None:
    found = played[case]
    assert found["status"] == 1 and not found["traceback"], found["said"]
    assert len(found["errors"]) == 1, found["said"]
    assert found["seen"] == [] and not found["changed"] and not found["secret"]
    assert found["peak"] < 1000  # megabytes, of which python and torch take most


def test_the_watcher_sees_what_it_must(tmp_path: Path) -> None:
    place = hostile.Place(tmp_path / "home", tmp_path / "secret")
    events = [("os.system", ("ls",)), ("pickle.find_class", ("posix", "system")),
              ("open", (f"{place.secret}/a", "r", 0)), ("open", ("/etc/x", "w", os.O_WRONLY)),
              ("os.rename", (f"{place.home}/a", "/etc/x", -1, -1)),
              ("exec", (compile("1", "/tmp/evil.py", "exec"),)), ("subprocess.Popen", ("sh", [], None, None)),
              ("socket.connect", (None, ("10.0.0.1", 80)))]
    watch = hostile.Watch(place)
    for event in events:
        watch(*event)
    assert len(watch.seen) == len(events)
    for event in [("open", (f"{place.home}/a", "w", os.O_WRONLY)), ("open", ("/etc/hostname", "r", 0)),
                  ("pickle.find_class", ("numpy", "dtype"))]:
        watch(*event)
    assert len(watch.seen) == len(events)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="trials are forks")
@pytest.mark.parametrize("name", ["prepare", "recordings", "speak", "export", "label", "track"])
def test_a_killed_command_is_repeated_and_leaves_nothing(
        name: str, folder: Path, played: dict[str, dict[str, Any]]) -> None:
    done = program(ROOT / "tests" / "kills.py", folder, "--only", name, "--few", 2)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{name}: 4 kills so far, 0 ended badly" in done.stdout


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="limits as Linux has them")
@pytest.mark.parametrize("name", ["speak", "track", "label"])
def test_a_command_with_too_little_of_something_says_so_and_succeeds_with_enough(
        name: str, folder: Path, played: dict[str, dict[str, Any]]) -> None:
    done = program(ROOT / "tests" / "limits.py", folder, "--only", name, "--few")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="commands are forks")
@pytest.mark.parametrize("number", [4, 5])
def test_two_trainings_of_one_run_end_with_the_files_of_one(
        number: int, folder: Path, played: dict[str, dict[str, Any]]) -> None:
    done = program(ROOT / "tests" / "pairs.py", folder, "--only", number, "--times", 1)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_two_commands_into_one_place_end_with_the_files_of_one(
        folder: Path, tmp_path: Path, played: dict[str, dict[str, Any]]) -> None:
    """Ten pairs of commands that write at once: five that speak, five that export."""
    done = program("-c", _PAIRS, folder / "made" / "runs" / "a", tmp_path, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    for k in range(5):
        place = tmp_path / f"speak{k}"
        told = json.loads((place / "a.json").read_text())
        points = np.load(place / "a.npz")["parameters"]
        assert {p.name for p in place.iterdir()} == {f"a.{s}" for s in ("mp4", "npz", "TextGrid", "png", "json", "wav")}
        others = {"hello": tmp_path / "alone0", "the big garden": tmp_path / "alone1"}
        alone = others[told["text"]]
        np.testing.assert_array_equal(points, np.load(alone / "a.npz")["parameters"])
        for suffix in ("mp4", "TextGrid", "wav"):
            assert (place / f"a.{suffix}").read_bytes() == (alone / f"a.{suffix}").read_bytes()
        bundle = tmp_path / f"bundle{k}"
        index = json.loads((bundle / "bundle.json").read_text())
        assert {p.name for p in bundle.iterdir()} == {"bundle.json", *index["digests"]}


_PAIRS = """
import os, sys
from pathlib import Path
import kills
kills.load()
run, where = Path(sys.argv[1]), Path(sys.argv[2])
texts = ("hello", "the big garden")

def begin(words, log):
    child = os.fork()
    if not child:
        os._exit(kills._child([str(w) for w in words], log, 0, False, kills._nothing, kills._nothing))
    return child

def speak(text, out):
    return ("speak", f"run={run}", f"text={text}", f"out={out}/a.mp4", "speech=formant")

for k, text in enumerate(texts):
    os.waitpid(begin(speak(text, where / f"alone{k}"), where / "log"), 0)
for k in range(5):
    children = [begin(speak(text, where / f"speak{k}"), where / "log") for text in texts]
    children += [begin(("export", run, "--out", where / f"bundle{k}", "--network", kind), where / "log")
                 for kind in ("npz", "onnx")]
    ends = [os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) for child in children]
    if any(ends):
        sys.exit((where / "log").read_text())
    from dnnvss.runs.run import Run
    Run.open(where / f"bundle{k}")
"""


def test_workers_end_with_the_process_that_started_them(tmp_path: Path) -> None:
    code = """
import os, sys, time, joblib
from pathlib import Path
from dnnvss.processes import parallel
def work(k):
    (Path(sys.argv[1]) / str(os.getpid())).touch()
    time.sleep(0.2 if k < 4 else 600)
with parallel(2):
    joblib.Parallel()(joblib.delayed(work)(k) for k in range(6))
"""
    (tmp_path / "pids").mkdir()
    process = subprocess.Popen([sys.executable, "-c", code, str(tmp_path / "pids")], env=ENVIRONMENT)
    deadline = time.monotonic() + 60
    while len(list((tmp_path / "pids").iterdir())) < 2 and time.monotonic() < deadline:
        time.sleep(0.1)
    workers = [int(path.name) for path in (tmp_path / "pids").iterdir()]
    assert len(workers) == 2 and all(map(_lives, workers))
    process.kill()
    process.wait()
    deadline = time.monotonic() + 20
    while any(map(_lives, workers)) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not any(map(_lives, workers))


def test_a_worker_whose_parent_ended_before_it_looked_ends_too() -> None:
    """The parent is told by its number: one that asks who its parent is may ask too late."""
    code = """
import os, subprocess, sys
quiet = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.DEVNULL)
print(subprocess.Popen([sys.executable, "-c", sys.argv[1], str(os.getpid())], **quiet).pid)
"""
    worker = """
import os, sys, time
parent = int(sys.argv[1])
while os.getppid() == parent:
    time.sleep(0.05)
from dnnvss.processes import end_with_parent
end_with_parent(parent)
time.sleep(600)
"""
    started = int(program("-c", code, worker, check=True).stdout)
    deadline = time.monotonic() + 30
    while _lives(started) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not _lives(started)


def _lives(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
