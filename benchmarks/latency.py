"""How long synthesis takes by stage, from text to the first picture, with the run already loaded.

    OMP_NUM_THREADS=1 python benchmarks/latency.py RUN-OR-BUNDLE ...

Text without sound: what is timed is what the face needs. The sentence is scaled to last the seconds that are asked for.
The last two rows are of a text beside a voice: the alignment, and all to the trajectory, of a recording
(``--wav FILE --text WORDS``), else of the sentence as the built-in voice says it. With one thread the CPU time is what
the wall time would be on a machine that does nothing else.
"""

import argparse
import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from claim import Claim, tell
from scipy.signal import resample_poly

from dnnvss.commands.arguments import parse_arguments
from dnnvss.commands.compose import compose
from dnnvss.commands.composed import typed_settings
from dnnvss.commands.speak import COMMAND
from dnnvss.corpus import Utterance
from dnnvss.curves import mlpg, resample
from dnnvss.media import SPEECH_RATE, read_audio
from dnnvss.render.pictures import Pictures
from dnnvss.runs.run import Run
from dnnvss.speech.engines import find_engine
from dnnvss.style import Style, generate
from dnnvss.style.generator import make_style
from dnnvss.synthesis import speak as synthesis
from dnnvss.synthesis.plan import heard, parsed
from dnnvss.synthesis.request import Recording, SpeakRequest
from dnnvss.synthesis.speak import replace_unseen
from dnnvss.text.sentence import parse

TEXT = "place red at g nine now, please"
STAGES = ("text", "durations", "codes", "network", "MLPG", "articulated instead", "first picture")
TO_TRAJECTORY = STAGES[:5]
PLAIN, LIVELY, BESIDE_VOICE = 5.0, 7.0, 60.0
"""Milliseconds from a text to its trajectory, of a sentence of 3 s; LIVELY in the style articulated."""
BESIDE = ("voice aligned", "text beside a voice")


class Stopwatch:
    """Wall and CPU milliseconds of each stage, a list a stage."""

    def __init__(self) -> None:
        self.times: dict[str, list[np.ndarray]] = defaultdict(list)

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Time the block."""
        start = now()
        yield
        self.times[stage].append(now() - start)

    def median(self, stage: str) -> np.ndarray:
        """Return the median wall and CPU time of a stage."""
        return np.median(self.times[stage], axis=0)


def now() -> np.ndarray:
    """Return wall and CPU milliseconds."""
    return 1000 * np.array([time.perf_counter(), time.process_time()])


def speak(run: Run, renderer: Pictures, style: Style, seconds: float, timed: Stopwatch) -> int:
    """Say the sentence once; return its frames."""
    with timed("text"):
        sentence = parse(TEXT, variant=run.voice.variant)
    with timed("durations"):
        alignment = run.durations.predict(sentence, total=seconds)
    with timed("codes"):
        alignment, _ = replace_unseen(alignment, run.voice.phones)
        example = run.example(Utterance("timing", sentence.text, alignment))
    with timed("network"):
        prediction = run.model.predict(example)
    with timed("MLPG"):
        x = np.asarray(mlpg(prediction.mean, prediction.variance, run.task.windows))
    with timed("articulated instead"):
        x = generate(prediction.mean, prediction.variance, alignment["phones"], run.task.clock, run.generator.talker,
                     style, run.task.windows)
    with timed("first picture"):
        next(renderer.frames(resample(x, run.task.clock, run.task.clock)[:1]))
    return len(x)


def recorded(run: Run, options: argparse.Namespace) -> SpeakRequest:
    """A text and its recording: those that are given, else the sentence by the built-in voice."""
    if options.wav is not None:
        return SpeakRequest(options.text, recording=Recording(read_audio(options.wav, SPEECH_RATE), SPEECH_RATE))
    sentence = parse(TEXT, variant=run.voice.variant)
    said = find_engine("formant").speak(sentence, run.durations.predict(sentence, total=options.seconds))
    speech = resample_poly(said.samples, SPEECH_RATE, said.rate).astype(np.float32)
    return SpeakRequest(TEXT, recording=Recording(said.samples, said.rate, speech))


def speak_beside(run: Run, request: SpeakRequest, timed: Stopwatch) -> None:
    """Move the face to a text and its recording once."""
    with timed("voice aligned"):
        assert request.recording is not None
        heard(run, parsed(run, request, request.text), request.recording)
    with timed("text beside a voice"):
        synthesis.speak(run, request)


def main() -> None:
    """Print the median of each stage for each run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("runs", nargs="+", type=Path, help="run folders or bundles")
    parser.add_argument("--seconds", type=float, default=3.0)
    parser.add_argument("--repeats", type=int, default=30)
    parser.add_argument("--wav", type=Path, help="a recording of --text")
    parser.add_argument("--text", default=TEXT)
    options = parser.parse_args()
    print(f"wall and CPU milliseconds, median of {options.repeats}, one thread")
    for folder in options.runs:
        run, timed = Run.open(folder), Stopwatch()
        renderer = run.pictures()
        style = make_style(typed_settings(COMMAND, compose(parse_arguments(COMMAND, []))).style, run.face)
        speak(run, renderer, style, options.seconds, Stopwatch())  # what is read once is read
        request = replace(recorded(run, options), style=style)
        speak_beside(run, request, Stopwatch())
        for _ in range(options.repeats):
            frames = speak(run, renderer, style, options.seconds, timed)
            speak_beside(run, request, timed)
        plain = np.sum([timed.median(s) for s in TO_TRAJECTORY], axis=0)
        lively = plain - timed.median("MLPG") + timed.median("articulated instead")
        print(f"\n{folder.name}, {frames} frames")
        for stage in STAGES:
            print(f"  {stage:32} {timed.median(stage)[0]:8.2f} {timed.median(stage)[1]:8.2f}")
        for style_name, total in (("plain", plain), ("articulated", lively)):
            print(f"  {'text to trajectory, ' + style_name:32} {total[0]:8.2f} {total[1]:8.2f}")
        for stage in BESIDE:
            print(f"  {stage:32} {timed.median(stage)[0]:8.2f} {timed.median(stage)[1]:8.2f}")
        tell([Claim("ms from text to trajectory, plain", plain[1], PLAIN),
              Claim("ms from text to trajectory, articulated", lively[1], LIVELY),
              Claim("ms from text and voice to trajectory", timed.median("text beside a voice")[1], BESIDE_VOICE)])


if __name__ == "__main__":
    main()
