"""Time and memory of speaking long texts: the movement, what is written of it, and the video.

    python benchmarks/long_speech.py RUN [--words 1000 5000 20000] [--video 1000]

Each length runs in a process of its own, by the built-in voice in the style articulated. Seconds are the processor
and of the clock, memory is the largest resident size of the process so far over that before speaking, in MB. "times"
is how much longer the speech lasts, by the clock, than movement and video take together, and than everything does:
pictures are drawn while those before them are encoded, so that two cores that are free share the work.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from claim import Claim, tell
from long_text import ROOT, text_of

STAGES = ("before", "movement", "files", "video")
MOST, FILMED, ALL = 500.0, 10.0, 5.0
"""MB over the idle run, and times real time with the video alone and with everything."""


def measure(folder: Path, words: int, video: bool) -> dict[str, tuple[float, float, float]]:
    """Seconds of the processor and of the clock, and MB, at the end of each stage of :data:`STAGES`."""
    from dnnvss.commands.studio import styles
    from dnnvss.export.curves import write_curves
    from dnnvss.formats import write_alignment
    from dnnvss.media import write_wav
    from dnnvss.runs.run import Run
    from dnnvss.style.generator import make_style
    from dnnvss.synthesis import outputs
    from dnnvss.synthesis.request import SpeakRequest
    from dnnvss.synthesis.speak import speak

    run = Run.open(folder)
    style = make_style(styles()["articulated"], run.face)
    speak(run, SpeakRequest("Hello there.", engine="formant", style=style))
    text = text_of(words, "prose")
    told, begun, started = {}, time.process_time(), time.perf_counter()

    def note(stage: str) -> None:
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        told[stage] = (time.process_time() - begun, time.perf_counter() - started, memory)

    note("before")
    spoken = speak(run, SpeakRequest(text, engine="formant", style=style))
    note("movement")
    told["speech"] = (len(spoken.movement) / float(spoken.clock.rate), 0.0, 0.0)
    with tempfile.TemporaryDirectory() as made:
        out = Path(made)
        sound = spoken.plan.sound
        assert sound is not None
        write_wav(out / "a.wav", sound.samples, sound.rate)
        outputs.write_trajectory(out / "a.npz", spoken)
        write_alignment(out / "a.TextGrid", spoken.plan.alignment)
        write_curves(out / "a.csv", spoken.curves(), spoken.stage.clock)
        (out / "a.json").write_text(json.dumps(outputs.report(spoken), default=str))
        outputs.draw(out / "a.png", spoken)
        note("files")
        if video:
            outputs.write_spoken(spoken, out / "b.mp4")
            note("video")
    return told


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, help="folder of a finished run")
    parser.add_argument("--words", type=int, nargs="+", default=[1000, 5000, 20000])
    parser.add_argument("--video", type=int, default=0, help="texts up to so many words are filmed too")
    parser.add_argument("--child", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        print(json.dumps(measure(options.run, int(options.child[0]), options.child[1] == "1")))
        return
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    print(f"{'words':>6}  " + "  ".join(f"{stage:>21}" for stage in STAGES))
    for words in options.words:
        call = [sys.executable, __file__, str(options.run), "--child", str(words), str(int(words <= options.video))]
        done = subprocess.run(call, env=environment, check=True, stdout=subprocess.PIPE, text=True)
        told = json.loads(done.stdout.splitlines()[-1])
        idle, lasts = told["before"][2], told["speech"][0]
        cells = [f"{told[s][0]:5.0f} {told[s][1]:5.0f} s {told[s][2] - idle:4.0f} MB" if s in told else f"{'-':>21}"
                 for s in STAGES]
        print(f"{words:6}  " + "  ".join(cells) + f"  of {lasts / 60:.0f} min", flush=True)
        last = next(stage for stage in reversed(STAGES) if stage in told)
        claims = [Claim(f"{words:,} words, to the {last}: MB over the idle run", told[last][2] - idle, MOST)]
        if last == "video":
            whole, files = told[last][1], told["files"][1] - told["movement"][1]
            claims += [Claim(f"{words:,} words: times real time with the video", lasts / (whole - files), FILMED, True),
                       Claim(f"{words:,} words: times real time with everything", lasts / whole, ALL, True)]
        tell(claims)


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    main()
