"""Time and memory from a text to its frame codes, by the length of the text.

    python benchmarks/long_text.py [--words 1000 2000 5000 10000 20000] [--kinds prose unbroken repeated] [--voice 500]

Each length runs in a process of its own; the durations are those of the built-in talker. Times are CPU seconds of one
thread, memory is the largest resident size of the process; without words it is what importing takes.
"""

import argparse
import json
import os
import random
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from claim import Claim, growth, tell

ROOT = Path(__file__).parents[1]
STEPS = ("parse", "durations", "tree", "codes", "voice")
SMALL = ("the", "of", "and", "to", "a", "in", "that", "it", "is", "was", "for", "on", "with", "he", "be", "I", "by")
LINEAR = {"durations": 1.1, "voice": 1.1}
"""Steps whose seconds are to grow with so small an exponent of the words at most; 1 is linear."""
COMMON, RARE = 800, 4000  # words of the lexicon that a text is made of beside the small ones


def text_of(words: int, kind: str) -> str:
    """A text of so many words of the lexicon, the same for the same length."""
    from dnnvss.text.lexicon import dictionary

    if kind == "repeated":
        return " ".join(["place"] * words)
    lexicon = [w for w in dictionary() if w.isalpha() and 2 < len(w) < 10]
    rng = random.Random(0)
    rng.shuffle(lexicon)
    pools = (SMALL, lexicon[:COMMON], lexicon[COMMON : COMMON + RARE])
    written = [rng.choice(pool) for pool in rng.choices(pools, (40, 50, 10), k=words)]
    if kind == "unbroken":
        return " ".join(written)
    marks = rng.choices(("", ",", ".", "?", ";"), (80, 9, 8, 1, 2), k=words)
    return " ".join(word + mark for word, mark in zip(written, marks, strict=True)) + "."


def measure(words: int, kind: str, voice: int) -> dict[str, float]:
    """CPU seconds of each step, and the largest memory in MB; ``voice`` words of the text are spoken as well."""
    from dnnvss.features import FeatureTable, encode
    from dnnvss.speech.durations import DurationModel
    from dnnvss.speech.formant import synthesise
    from dnnvss.text.sentence import parse
    from dnnvss.text.tree import linguistic_tree
    from dnnvss.timing import FrameClock

    model = DurationModel.load(os.environ["DNNVSS_DURATIONS"])
    table, clock = FeatureTable(("centre_phone", "phone_window", "phone_context", "phone_span")), FrameClock(25)
    model.predict(parse("Place red, at g nine. We record the records."))  # tables and taggers are loaded once
    text, times = text_of(words, kind), [time.process_time()]
    if words:
        sentence = parse(text)
        times.append(time.process_time())
        alignment = model.predict(sentence)
        times.append(time.process_time())
        linguistic_tree(alignment, text)
        times.append(time.process_time())
        encode(alignment, text, table, clock)
        times.append(time.process_time())
    if voice:
        synthesise(alignment)
        times.append(time.process_time())
    steps = {step: b - a for step, a, b in zip(STEPS, times[:-1], times[1:], strict=False)}
    return {**steps, "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024}


def write_durations(path: Path) -> None:
    """Write a duration model of sentences of the built-in talker."""
    from dnnvss.corpus import Utterance
    from dnnvss.corpus.talker import perform_take, script
    from dnnvss.speech.durations import DurationModel

    takes = [perform_take(name, text) for name, text in script(60).items()]
    DurationModel.fit([Utterance(take.id, take.text, take.alignment) for take in takes]).save(path)


def _child(environment: dict[str, str], words: int, kind: str, voice: bool) -> dict[str, float]:
    call = [sys.executable, __file__, "--child", str(words), kind, str(int(voice))]
    done = subprocess.run(call, env=environment, check=True, stdout=subprocess.PIPE, text=True)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--words", type=int, nargs="+", default=[0, 1000, 2000, 5000, 10000, 20000])
    parser.add_argument("--kinds", nargs="+", default=["prose"], choices=("prose", "unbroken", "repeated"))
    parser.add_argument("--voice", type=int, default=0, help="texts up to so many words are spoken too")
    parser.add_argument("--child", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        words, kind, voice = options.child
        print(json.dumps(measure(int(words), kind, int(voice))))
        return
    print(f"{'text':9} {'words':>6} {'MB':>6} {'ms a word':>10}  " + " ".join(f"{step:>9}" for step in STEPS) + "  s")
    with tempfile.TemporaryDirectory() as folder:
        durations = Path(folder) / "durations.npz"
        write_durations(durations)
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1",
                       "DNNVSS_DURATIONS": str(durations)}
        for kind in options.kinds:
            by_words: dict[int, dict[str, float]] = {}
            for words in options.words:
                found = _child(environment, words, kind, 0 < words <= options.voice)
                by_words[words] = found
                steps = [found.get(step, 0.0) for step in STEPS]
                each = 1000 * sum(steps[:4]) / max(words, 1)
                print(f"{kind:9} {words:6} {found['memory']:6.0f} {each:10.2f}  "
                      + " ".join(f"{step:9.2f}" for step in steps), flush=True)
            tell(claims(kind, by_words))


def claims(kind: str, by_words: dict[int, dict[str, float]]) -> list[Claim]:
    """How seconds grow with words, from the shortest to the longest text that has each step."""
    told = []
    for step, limit in LINEAR.items():
        sizes = sorted(words for words, found in by_words.items() if words and step in found)
        if len(sizes) > 1:
            seconds = [by_words[words][step] for words in sizes]
            told.append(Claim(f"{kind}, {sizes[0]:,} to {sizes[-1]:,} words: exponent of {step}",
                              growth(sizes, seconds), limit))
    return told


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    main()
