"""The built-in talker as a motion-capture session: takes as a capture system leaves them, and their truth."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from data_prep.motion import prepare_motion
from data_prep.stages import Workshop
from dnnvss import files
from dnnvss.corpus.talker import Articulators
from dnnvss.corpus.talker.hours import times_of_day
from dnnvss.corpus.talker.session import MARKERS, RATE, CapturedTake, Faults, capture, perform_words
from dnnvss.errors import DnnvssError
from dnnvss.formats import Curves, Markers, write_alignment, write_curves, write_trc
from dnnvss.media import SPEECH_RATE, write_wav
from dnnvss.speech.formant import synthesise
from dnnvss.staging import is_ours
from dnnvss.timing import FrameClock

CREDIT = "Built-in talker of dnnvss, captured by program, no person recorded (MIT)."
VERSION = 2
_PITCH, CURVE_RATE = 185.0, 60
SESSION = "session.json"
"""What says which session lies in a folder, and whether it is whole; written first and last."""
_TOLD = {"version", "form", "sentences", "held_out", "seed", "whole"}
TRUTH = "truth"
"""The folder beside the takes with what is true of each: points, and where markers were swapped or thrown."""
CURVES: Mapping[str, Mapping[str, float]] = {
    "JawOpen": {"jaw": 0.9},
    "MouthClose": {"jaw": 0.45, "opening": -0.6},
    "MouthPucker": {"rounding": 0.9},
    "MouthFunnel": {"protrusion": 0.8},
    "MouthStretchLeft": {"spread": 0.7},
    "MouthStretchRight": {"spread": 0.68},
    "MouthRollLower": {"tuck": 0.8},
    "TongueOut": {"tongue_front": 0.5},
    "EyeBlinkLeft": {"blink": 1.0},
    "EyeBlinkRight": {"blink": 0.97},
}
"""Curve of a rig to the articulators that it is the sum of."""


def prepare_session(
    raw: str | Path,
    out: str | Path,
    *,
    name: str = "session",
    form: str = "markers",
    sentences: int = 55,
    held_out: int = 12,
    seed: int = 0,
    jobs: int = -1,
    backend: str = "loky",
    strict: bool = False,
) -> Path:
    """Return the folder of the prepared corpus, after the session was performed into ``raw``, unless it is there.

    Args:
        raw: the folder of takes, made by this.
        out: the folder to write.
        name: of the corpus.
        form: ``markers`` (66 and 7 on a jig, 120 Hz) or ``curves`` (of a rig, 60 Hz).
        sentences: captured ones, which train and choose.
        held_out: others, which test.
        seed: of sentences, movement and faults.
        jobs, backend, strict: as for :func:`data_prep.motion.prepare_motion`.

    Raises:
        DnnvssError: ``raw`` holds something else, or less than three sentences are asked for.
    """
    if sentences < 3 or held_out < 1:
        raise DnnvssError(
            f"cannot make a session of {sentences} sentences and {held_out}",
            remedy="Ask for 3 and 1 at least",
        )
    raw = Path(raw)
    kept = {
        "version": VERSION,
        "form": form,
        "sentences": sentences,
        "held_out": held_out,
        "seed": seed,
    }
    whole = {**kept, "whole": True}
    if _session_in(raw) != whole:
        files.write_json(raw / SESSION, {**kept, "whole": False})
        _perform(raw, form, sentences, held_out, seed, Workshop(Path(out), jobs, backend))
        files.write_json(raw / SESSION, whole)
    return prepare_motion(
        raw, out, name=name, credit=CREDIT, jobs=jobs, backend=backend, strict=strict
    )


def _session_in(raw: Path) -> dict[str, Any] | None:
    """What a folder says of the session in it, None where it is empty or not there.

    Raises:
        DnnvssError: it holds something else, which would be lost.
    """
    if not raw.is_dir() or all(is_ours(path.name) for path in raw.iterdir()):
        return None
    path = raw / SESSION
    told = files.read_json(path) if path.is_file() else None
    if not isinstance(told, dict) or set(told) != _TOLD:
        raise DnnvssError(
            "is not empty, and no session", file=raw, remedy="Give a new folder: corpus.raw=FOLDER"
        )
    return told


def _perform(
    raw: Path, form: str, sentences: int, held_out: int, seed: int, shop: Workshop
) -> None:
    texts = times_of_day(sentences, seed)
    texts += times_of_day(held_out, seed + 1, without=texts)
    for path in raw.glob("take_*"):
        files.remove(path)
    tasks = {
        f"take_{k:03d}": {
            "raw": str(raw.resolve()),
            "number": k,
            "text": text,
            "form": form,
            "seed": seed,
        }
        for k, text in enumerate(texts)
    }
    for ended in shop.run("session", perform, tasks, VERSION).values():
        if "dropped" in ended:
            raise DnnvssError(str(ended["dropped"]))
    ids, val = list(tasks), max(1, sentences // 11)
    splits = {
        "train": ids[: sentences - val],
        "val": ids[sentences - val : sentences],
        "test": ids[sentences:],
    }
    for split, own in splits.items():
        files.write_text(raw / "splits" / f"{split}.txt", "\n".join(own) + "\n")


def perform(
    name: str, out: Path, raw: str, number: int, text: str, form: str, seed: int
) -> dict[str, Any]:
    """Write a take with its words, sound, phone times and truth into ``raw``."""
    home = Path(raw)
    if form == "curves":
        performed = perform_words(text, np.random.default_rng([seed, number, 8]))
        alignment = performed.alignment
        times = FrameClock(CURVE_RATE).centres(FrameClock(CURVE_RATE).edge(alignment.end))
        write_curves(
            home / f"{name}.csv",
            Curves(tuple(CURVES), rig_curves(performed.motion.at(times)), times),
        )
    else:
        take = capture(number, text, seed, Faults())
        alignment = take.alignment
        write_trc(home / f"{name}.trc", Markers(MARKERS, take.seen, float(RATE)))
        _keep_truth(home / TRUTH / f"{name}.npz", take)
    write_wav(home / f"{name}.wav", synthesise(alignment, SPEECH_RATE, seed, _PITCH), SPEECH_RATE)
    write_alignment(home / f"{name}.TextGrid", alignment)
    files.write_text(home / f"{name}.txt", text)
    return {"frames": FrameClock(RATE).edge(alignment.end)}


def rig_curves(rows: np.ndarray) -> np.ndarray:
    """The curves (F, C) of articulators (F, 12), between 0 and 1."""
    names = Articulators._fields
    weights = np.array([[own.get(n, 0.0) for n in names] for own in CURVES.values()])
    return np.clip(rows @ weights.T, 0, 1)


def _keep_truth(path: Path, take: CapturedTake) -> None:
    files.write_arrays(
        path, points=take.truth.astype(np.float32), swaps=take.swaps, flickers=take.flickers
    )
