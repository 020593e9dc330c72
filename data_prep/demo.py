"""The built-in talker as a prepared corpus: draws it, speaks it, and writes what any recorded corpus would have."""

from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np

from data_prep.digests import with_digests
from data_prep.report import Outcome, write_report
from data_prep.splits import draw
from data_prep.stages import FOLDER, Workshop
from dnnvss import files
from dnnvss.corpus import Corpus, CorpusInfo, Utterance
from dnnvss.corpus.talker import LANDMARK_GROUPS, RATE, SHEET, Take, film, perform_take, script, unseen_splits
from dnnvss.errors import DnnvssError
from dnnvss.formats import Landmarks, write_npz
from dnnvss.media import SPEECH_RATE, write_wav

VERSION = 2
"""Raised with every change of how the talker looks, moves or speaks, so that an old corpus is made anew."""
CREDIT = "Built-in talker of dnnvss: drawn and spoken by program, no person recorded (MIT)."
_STAGE = "talker"
_PITCH = 185.0  # Hz


def prepare_demo(
    out: Path, sentences: int = 160, seed: int = 0, jobs: int = -1, size: int = SHEET, backend: str = "loky"
) -> Corpus:
    """Return the corpus of the built-in talker, written to ``out``; what is already there is kept.

    Args:
        out: folder of the prepared corpus.
        sentences: how many, 3 to 1000; 160 are 8 minutes.
        seed: of sentences, times, movement and camera; the same seed gives the same landmarks and frames.
        jobs: processes; -1 for all cores.
        size: width and height of the video in pixels, even, 64 to 640.
        backend: joblib backend.

    Raises:
        DnnvssError: a number out of range, or the folder cannot be written.
    """
    _check(sentences, size)
    out = Path(out)
    texts = script(sentences, seed)
    _forget_incomplete(out, texts)
    shop = Workshop(out, jobs=jobs, backend=backend)
    tasks = {name: {"text": text, "seed": seed, "size": size} for name, text in texts.items()}
    try:
        results = shop.run(_STAGE, record, tasks, VERSION)
        utterances = with_digests(shop, [Utterance.from_json(results[name]) for name in texts])
    finally:
        shop.sweep()
    splits = draw(list(texts), val=0.075, test=0.1125) | unseen_splits(texts, seed)
    info = CorpusInfo("demo", (size, size), str(RATE), LANDMARK_GROUPS, "en_us", CREDIT)
    write_report(out, [Outcome(name) for name in texts])
    Corpus.write(out, info, utterances, splits)
    return Corpus.open(out)


def record(name: str, out: Path, text: str, seed: int, size: int) -> dict[str, Any]:
    """Draw and speak one sentence into ``out`` and return its record, as :meth:`Utterance.to_json` has it."""
    from dnnvss.speech.formant import synthesise

    cv2.setNumThreads(1)  # one process a core is already at work
    take = perform_take(name, text, seed)
    paths = _paths(name)
    points = take.landmarks(size)
    _write_video(out / paths["video"], take, size)
    write_wav(out / paths["audio"], synthesise(take.alignment, SPEECH_RATE, seed, _PITCH), SPEECH_RATE)
    write_npz(out / paths["landmarks"], Landmarks(points, np.ones(len(points), bool)))
    return Utterance(name, text, take.alignment, **paths, rate=Fraction(RATE), frames=take.frames).to_json()


def _check(sentences: int, size: int) -> None:
    if not 3 <= sentences <= 1000:
        raise DnnvssError(f"cannot make a corpus of {sentences} sentences", remedy="Ask for 3 to 1000")
    if size % 2 or not 64 <= size <= 640:
        raise DnnvssError(f"cannot draw the talker {size} pixels wide", remedy="Give an even number from 64 to 640")


def _paths(name: str) -> dict[str, str]:
    return {"video": f"video/{name}.mp4", "audio": f"audio/{name}.wav", "landmarks": f"landmarks/{name}.npz"}


def _forget_incomplete(out: Path, names: dict[str, str]) -> None:
    """Let utterances be made again whose media somebody removed."""
    for name in names:
        if not all((out / path).is_file() for path in _paths(name).values()):
            files.remove(out / FOLDER / _STAGE / f"{name}.json")


def _write_video(path: Path, take: Take, size: int) -> None:
    """Write the frames as H.264, without sound."""
    with files.replacing(path) as temporary, av.open(str(temporary), "w") as container:
        options = {"crf": "17", "preset": "ultrafast", "threads": "1"}
        stream = container.add_stream("libx264", rate=RATE, options=options)
        stream.width = stream.height = size
        stream.pix_fmt = "yuv420p"
        for picture in film(take.articulators, size, np.random.default_rng([*take.seed, 5])):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
