"""How the stages of a preparation and of a training grow with what was recorded, where pictures are not the point.

    OMP_NUM_THREADS=1 python benchmarks/growth.py WORK [--hours 0.167 0.5 1 3 10]

The built-in talker's sentences are linked into WORK, again and again under new ids until they last so long. Of each
length a process of its own goes through the stages that work on all clips at once, or keep a file of each: recordings
found, splits, results kept and read again, the check-up, how late sounds are, the talker's own voice, records, a face
of points, examples, codes, dynamic visemes, durations, null models, and the pages of a run. Left out is what works on
one clip after the other and keeps nothing (decoding, drawing, the aligner for everybody), and training, whose time is
that of its epochs. Printed are seconds of the processor, the largest memory of its own (without pages of files, which
the system takes back), what memory grows by an hour, and how time grows: the exponent ``k`` of ``seconds = c * hours
** k`` from the length in the middle to the longest one, 1 where it is linear. Where a stage takes a second and more,
that is claimed.
"""

import argparse
import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from claim import Claim, growth, tell

from dnnvss.formats.tables import markdown_table

SENTENCES, SIZE = 160, 64
"""Of the built-in talker that are made, and the pixels of their pictures."""
CLIP = 3.0
"""Seconds that a sentence is taken to last."""
LOOK = 0.05
"""Seconds between two looks at the memory."""
MOST, LEAST = 1.15, 1.0
"""Largest exponent that passes for linear, and seconds of the longest length from which one is claimed."""

Utterances = Mapping[str, Any]
"""The utterance of the built-in talker that each id was linked from."""
Made = dict[str, dict[str, Any]]
"""What a stage left of each utterance, by id."""


class Watch:
    """Seconds of the processor and largest memory of its own of each stage, by name."""

    def __init__(self) -> None:
        self.found: dict[str, tuple[float, float]] = {}

    @contextlib.contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Measure what is done in the block."""
        ended, sizes, before = threading.Event(), [own_memory()], time.process_time()

        def look() -> None:
            while not ended.wait(LOOK):
                sizes.append(own_memory())

        looking = threading.Thread(target=look)
        looking.start()
        try:
            with contextlib.redirect_stdout(sys.stderr):
                yield
        finally:
            ended.set()
            looking.join()
        self.found[name] = (time.process_time() - before, max(*sizes, own_memory()))
        print(f"{name}: {self.found[name][0]:.1f} s, {self.found[name][1]:.0f} MB", file=sys.stderr, flush=True)


def own_memory() -> float:
    """MB that this process holds and no file does."""
    held = re.search(r"RssAnon:\s+(\d+)", Path("/proc/self/status").read_text("ascii"))
    return int(held[1]) / 1024 if held else float("nan")


def pool(work: Path) -> Path:
    """The sentences that every length is linked from, with word times as GRID has them and thumbnails."""
    from data_prep.demo import prepare_demo
    from dnnvss import files
    from dnnvss.corpus import checkup
    from dnnvss.media import read_video

    folder = work / "pool"
    corpus = prepare_demo(folder, SENTENCES, size=SIZE, jobs=1)
    for name, utterance in corpus.utterances.items():
        rows = [f"{25000 * s.start:.0f} {25000 * s.end:.0f} {s.label or 'sil'}" for s in utterance.alignment["words"]]
        files.write_text(folder / "align" / f"{name}.align", "\n".join(rows) + "\n")
        small = checkup.thumbnails(read_video(corpus.path(utterance, "video")))
        files.write_arrays(folder / "media" / f"{name}.npz", thumbnails=small, times=np.arange(len(small)) / 30)
        files.write_arrays(folder / "shown" / f"{name}.npz", index=np.arange(len(small)),
                           taken=np.ones(len(small), bool))
    files.write_json(folder / "landmarks.json", {"scale": 1.0, "groups": corpus.info.landmark_groups})
    return folder


def linked(work: Path, clips: int) -> Path:
    """A folder of recordings as GRID has them, and what the stages that read media would have left of them."""
    source, home = work / "pool", work / "linked"
    shutil.rmtree(home, ignore_errors=True)
    kinds = {"raw/video": ("video", ".mp4"), "raw/align": ("align", ".align"), "raw/landmarks": ("landmarks", ".npz"),
             "out/.stages/media": ("media", ".npz"), "out/.stages/video": ("shown", ".npz"),
             "out/.stages/sound": ("audio", ".wav"), "out/video": ("video", ".mp4")}
    for kind in kinds:
        (home / kind).mkdir(parents=True)
    shutil.copy(source / "landmarks.json", home / "raw")
    for name, new in islice(ids(source), clips):
        for kind, (folder, suffix) in kinds.items():
            os.link(source / folder / f"{name}{suffix}", home / kind / f"{new}{suffix}")
    return home


def ids(source: Path) -> Iterator[tuple[str, str]]:
    """A sentence and an id for it, again and again."""
    names = sorted(path.stem for path in (source / "video").glob("*.mp4"))
    turn = 0
    while True:
        yield from ((name, f"{name}_{turn}") for name in names)
        turn += 1


def measured(work: Path, clips: int) -> dict[str, tuple[float, float]]:
    """Seconds and megabytes of every stage for so many clips."""
    watch = Watch()
    home = linked(work, clips)
    trained(watch, home, prepared(watch, work, home, clips))
    shutil.rmtree(home)
    return watch.found


def prepared(watch: Watch, work: Path, home: Path, clips: int) -> Any:
    """The corpus, once it went through the stages of a preparation."""
    from dnnvss.corpus import Corpus

    known = Corpus.open(work / "pool").utterances
    own = {new: known[name] for name, new in islice(ids(work / "pool"), clips)}
    run, splits = begun(watch, home, own)
    made, bad = checked(watch, run, own)
    return recorded(watch, run, own, splits, made, spoken(watch, run, own, made), bad)


def begun(watch: Watch, home: Path, own: Utterances) -> tuple[Any, Any]:
    """The preparation of the recordings that are found, and their splits."""
    from data_prep.grid import prepare_grid
    from data_prep.recipe import Preparation
    from data_prep.report import Outcome
    from data_prep.splits import completed, resolved

    told: list[Any] = []

    def keep(*given: Any) -> Path:
        told.extend(given)
        return home / "out"

    with watch.stage("recordings found"):
        prepare_grid(home / "raw", home / "out", variant="en_us", jobs=1, then=keep)
    sources, recipe, shop = told
    sources = [replace(s, words=tuple(w.lower() for w in own[s.id].alignment["words"].labels if w)) for s in sources]
    with watch.stage("splits"):
        given, _ = resolved({"test": [s.id for s in sources[::20]], "val": [s.id for s in sources[1::20]]},
                            [s.id for s in sources])
        splits = completed(given, [s.id for s in sources], 0.05, 0.05)
    for stage in ("results kept", "results read again"):
        with watch.stage(stage):
            shop.run("nothing", nothing, {s.id: {"video": s.video} for s in sources})
    return Preparation(sources, recipe, shop, {s.id: Outcome(s.id) for s in sources}), splits


def checked(watch: Watch, run: Any, own: Utterances) -> tuple[Made, Any]:
    """What media left of each recording, its sound moved to its picture, and the frames that are no good."""
    from data_prep.checks import examined
    from data_prep.sounds import lateness_of, sounds
    from dnnvss.processes import parallel

    made: Made = {
        i: {"frames": u.frames, "rate": str(u.rate), "size": [SIZE, SIZE], "place": [1.0, 1.0, 0.0, 0.0],
            "video": f"video/{i}.mp4", "sound": f".stages/sound/{i}.wav", "starts": 0.0,
            "source": {"frames": u.frames, "size": [SIZE, SIZE]}} for i, u in own.items()}
    with watch.stage("check-up"):
        bad = examined(run, made, (SIZE, SIZE))
    with watch.stage("how late sounds are"), parallel(1):
        late = lateness_of(run, made, bad)
    with watch.stage("sounds moved"):
        return sounds(run, made, late), bad


def spoken(watch: Watch, run: Any, own: Utterances, made: Made) -> Made:
    """The times of each utterance, from which the talker's own voice has been learnt."""
    from data_prep.adapt import learn_voice
    from dnnvss.speech.align_onset import longest, runs_of
    from dnnvss.text.lexicon import pronunciations
    from dnnvss.timing import Alignment

    tasks = {i: {"words": [(w, pronunciations(w, "en_us", {})) for w in own[i].alignment["words"].labels if w],
                 "audio": run.shop.out / m["audio"], "bounds": []} for i, m in made.items()}
    timed = {i: {"alignment": own[i].alignment.to_json()} for i in made}
    with watch.stage("talker's own voice"):
        learn_voice(run.shop, tasks, timed)
        longest([runs_of(Alignment.from_json(t["alignment"])) for t in timed.values()])
    return timed


def recorded(watch: Watch, run: Any, own: Utterances, splits: Any, made: Made, timed: Made, bad: Any) -> Any:
    """The corpus, once its files are written."""
    from data_prep.checks import cleaned
    from data_prep.digests import with_digests
    from data_prep.report import write_report
    from dnnvss.corpus import Corpus, Utterance
    from dnnvss.timing import Alignment

    out = run.shop.out
    with watch.stage("landmarks written"):
        clean = cleaned(run, made, timed, bad)
    with watch.stage("records and report"):
        rows = [Utterance(i, own[i].text, Alignment.from_json(timed[i]["alignment"]), None, m["audio"],
                          clean[i]["landmarks"], Fraction(m["rate"]), m["frames"]) for i, m in made.items()]
        Corpus.write(out, replace(run.recipe.info, size=(SIZE, SIZE), rate=str(own[rows[0].id].rate)),
                     with_digests(run.shop, rows), splits)
        write_report(out, run.outcomes.values(), run.found)
    with watch.stage("corpus opened"):
        corpus = Corpus.open(out)
        assert corpus.fingerprint
        for name in ("train", "val", "test"):
            corpus.split(name)
    return corpus


def nothing(name: str, out: Path, video: Path) -> dict[str, Any]:
    """A stage whose work takes no time."""
    del out
    return {"name": name, "video": str(video)}


def trained(watch: Watch, home: Path, corpus: Any) -> None:
    """Go through the stages of a training but its epochs."""
    from hydra import compose, initialize_config_dir

    from dnnvss.commands.train_settings import run_settings
    from dnnvss.commands.train_steps import finished
    from dnnvss.features import CodeStore
    from dnnvss.runs.fitting import begin, encode, gather, new_model
    from dnnvss.runs.voice import Voice
    from dnnvss.speech.durations import DurationModel
    from dnnvss.visemes import gesture_view, learn
    from dnnvss.visemes.corpus import learnt_from, viseme_clips, viseme_settings

    with initialize_config_dir(str(Path(__file__).parents[1] / "conf"), version_base="1.3"):
        config = compose("train", ["corpus=demo", f"corpus.out={corpus.root}", "face=points", "labels=ph", "folds=0",
                                   "model=phone_mean", "sample=false", "jobs=1"])
    settings = run_settings(config)
    folder = home / "run"
    begin(folder, settings, corpus)
    with watch.stage("face of points"):
        encoded = encode(settings, corpus)
    with watch.stage("examples"):
        material = gather(settings, corpus, encoded, scratch=folder)
    with watch.stage("codes kept"):
        CodeStore.join({e.id: e.codes for part in material.examples.values() for e in part}).save(home / "codes")
        CodeStore.open(home / "codes")
    with watch.stage("dynamic visemes"):
        learning = viseme_settings(config.visemes)
        clock, train = settings.task.clock, corpus.split("train")
        moved = [clip for _, clip in viseme_clips(learnt_from(train, encoded), encoded, clock)]
        visemes = learn(moved, clock, learning, gesture_view(encoded.face, learning.gestures))
        del moved
        for _, clip in viseme_clips(train, encoded, clock):
            visemes.tier(clip)
    with watch.stage("durations and phones"):
        DurationModel.fit(train)
        Voice.of(train, corpus.info)
    with watch.stage("means of phones"):
        model = new_model(settings)
        model.fit(material.examples["train"], material.examples["val"], folder)
    with watch.stage("run kept, judged and told"):
        finished(folder, material, model)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=Path)
    parser.add_argument("--hours", type=float, nargs="+", default=[1 / 6, 0.5, 1, 3, 10])
    parser.add_argument("--clips", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if len(set(options.hours)) < 2:
        parser.error("--hours needs two lengths at least")
    if options.clips:
        print(json.dumps(measured(options.work, options.clips)))
        return
    pool(options.work)
    found = {}
    for hours in sorted(options.hours):
        command = [sys.executable, __file__, str(options.work), "--clips", str(round(3600 * hours / CLIP))]
        found[hours] = json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout)
    lengths = list(found)
    middle, last = lengths[(len(lengths) - 1) // 2], lengths[-1]
    rows, claims = [], list[Claim]()
    for stage in found[last]:
        seconds = [found[hours][stage][0] for hours in lengths]
        before, memory = (found[hours][stage][1] for hours in (middle, last))
        rows.append([stage, *(f"{s:.2f}" for s in seconds), "", f"{memory:.0f}",
                     f"{(memory - before) / (last - middle):.0f}"])
        if seconds[-1] >= LEAST:
            exponent = growth((middle, last), (found[hours][stage][0] for hours in (middle, last)))
            rows[-1][-3] = f"{exponent:.2f}"
            claims.append(Claim(f"{middle:g} to {last:g} hours of recordings: exponent of {stage}", exponent, MOST))
    heads = [f"{hours:.3g} h" for hours in lengths]
    print(markdown_table(["stage, seconds of", *heads, "exponent", f"MB at {heads[-1]}", "MB an hour"], rows))
    tell(claims)


if __name__ == "__main__":
    main()
