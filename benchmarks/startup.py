"""How long ``synth.py`` takes from the start of its process to the first picture, and to its end.

    python benchmarks/startup.py RUN-OR-BUNDLE ... [speech=formant]

Each is started several times in turn, beside a process that imports nothing but torch, and one that imports what was
loaded when the first picture was drawn. CPU time is the process's own, user and system; wall time is counted from
before the process starts.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from claim import Claim, tell

ROOT = Path(__file__).parents[1]
OF_TORCH, OF_IMPORTS = 1.6, 1.3
"""Seconds to the first picture: of a run over importing torch, of a bundle over its own imports."""
TEXT = "place red at g nine now, please"
PROGRAM = """
import json, runpy, sys, time
mark, sys.argv = sys.argv[1], sys.argv[2:]
import dnnvss.render.renderer as renderer
def frames(self, parameters, draw=renderer.Renderer.frames):
    for number, picture in enumerate(draw(self, parameters)):
        if number == 0:
            with open(mark, "w") as file:
                json.dump([time.time(), time.process_time(), list(sys.modules)], file)
        yield picture
renderer.Renderer.frames = frames
runpy.run_path(sys.argv[0], run_name="__main__")
"""
TORCH = "import json, sys, time, torch; json.dump([time.time(), time.process_time(), []], open(sys.argv[1], 'w'))"
IMPORTS = """
import contextlib, gc, importlib, json, sys, time
gc.disable()
for name in json.load(open(sys.argv[2])):
    with contextlib.suppress(Exception):
        importlib.import_module(name)
json.dump([time.time(), time.process_time(), []], open(sys.argv[1], 'w'))
"""


def started(program: str, arguments: list[str], mark: Path) -> tuple[list[float], list[str]]:
    """Return wall and CPU seconds to the mark with wall seconds to the end, and the modules that were loaded."""
    start = time.time()
    subprocess.run([sys.executable, "-c", program, str(mark), *arguments], check=True, stdout=subprocess.DEVNULL,
                   stderr=subprocess.DEVNULL, cwd=ROOT, env={**os.environ, "OMP_NUM_THREADS": "1"})
    wall, cpu, loaded = json.loads(mark.read_text())
    return [wall - start, cpu, time.time() - start], loaded


def main() -> None:
    """Print the medians."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", help="run folders or bundles; what holds '=' is a setting of synth.py")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    settings = [a for a in options.runs if "=" in a] or ["speech=none"]
    with tempfile.TemporaryDirectory() as folder:
        mark = Path(folder) / "mark.json"
        jobs: dict[str, tuple[str, list[str]]] = {"import torch": (TORCH, [])}
        for run in (a for a in options.runs if "=" not in a):
            said = [f"run={run}", f"text={TEXT}", f"out={folder}/a.mp4", *settings]
            jobs[run] = (PROGRAM, [str(ROOT / "synth.py"), *said])
        for run in list(jobs)[1:]:
            listed = Path(folder) / f"modules{len(jobs)}.json"
            listed.write_text(json.dumps(started(*jobs[run], mark)[1]))
            jobs[f"imports of {run}"] = (IMPORTS, [str(listed)])
        times: dict[str, list[list[float]]] = {name: [] for name in jobs}
        for _ in range(options.repeats):
            for name, (program, arguments) in jobs.items():
                times[name].append(started(program, arguments, mark)[0])
    print(f"seconds, median of {options.repeats}, one thread, {' '.join(settings)}; ratios of CPU time")
    print(f"{'':44} {'first picture':>14} {'CPU':>6} {'whole command':>14} {'of torch':>9} {'of its imports':>15}")
    middle = {name: np.median(rows, axis=0) for name, rows in times.items()}
    for name, (first, cpu, whole) in middle.items():
        line = f"{name[-44:]:44} {first:14.2f} {cpu:6.2f} {whole:14.2f}"
        if (own := f"imports of {name}") in middle:
            line += f" {cpu / middle['import torch'][1]:9.2f} {cpu / middle[own][1]:15.2f}"
        print(line)
    torch, told = middle["import torch"][1], list[Claim]()
    for name in (name for name in middle if f"imports of {name}" in middle):
        if (Path(name) / "bundle.json").exists():
            ratio = middle[name][1] / middle[f"imports of {name}"][1]
            told.append(Claim("first picture of a bundle, times its own imports", ratio, OF_IMPORTS))
        else:
            told.append(Claim("first picture of a run, times importing torch", middle[name][1] / torch, OF_TORCH))
    tell(told)


if __name__ == "__main__":
    main()
