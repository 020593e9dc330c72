"""What the encoding of a corpus as points is worth: errors of reconstruction, variance between clips, outliers."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss.archives import Held, read_declared
from dnnvss.corpus import Corpus
from dnnvss.face.points.code import PointsCode
from dnnvss.face.points.model import PointsFace
from dnnvss.face.report import between_share, speech_span


def build_report(face: PointsFace, corpus: Corpus, splits: Mapping[str, Sequence[str]], codes: Path,
                 kept: Sequence[str]) -> dict[str, Any]:
    """Plain containers that say how good an encoding is.

    ``reconstruction``: for each split the RMS distance of the points, with each clip's offset and without.
    ``between_clips``: for each parameter the share of its variance over the train split that lies between clips, over
    speech and over all frames. ``outliers``: for each utterance the frames that were left out, by reason.

    Args:
        face: the fitted face.
        corpus: the corpus.
        splits: name to utterance ids.
        codes: folder of ``<id>.npz``.
        kept: ids of what was encoded.
    """
    read = {i: PointsCode.load(codes / f"{i}.npz") for i in kept}
    train = [i for i in splits["train"] if i in read]
    return {
        "points": face.settings.points.name, "modes": face.size, "dimensions": face.dimensions, "unit": face.unit,
        "reconstruction": {name: _errors([codes / f"{i}.npz" for i in ids if i in read], face.unit)
                           for name, ids in splits.items()},
        "between_clips": _between_clips(corpus, {i: read[i] for i in train}),
        "outliers": {i: code.outliers for i, code in read.items() if code.outliers},
    }


def _errors(paths: Sequence[Path], unit: str) -> dict[str, float]:
    total = np.zeros(3)
    for path in paths:
        total += read_declared(path, {"errors": Held(total.shape)}, "Run the command again")["errors"]
    rms = np.sqrt(total[:2] / max(total[2], 1))
    return {unit: round(float(rms[0]), 4), f"{unit}_without_offset": round(float(rms[1]), 4), "frames": int(total[2])}


def _between_clips(corpus: Corpus, read: Mapping[str, PointsCode]) -> dict[str, list[float]]:
    speech, whole = [], []
    for i, code in read.items():
        spoken = np.zeros(len(code.valid), dtype=bool)
        spoken[speech_span(corpus.utterances[i], len(spoken))] = True
        speech.append(code.parameters[spoken & code.valid])
        whole.append(code.parameters[code.valid])
    kinds = {"speech": speech, "all_frames": whole}
    return {name: between_share([c for c in clips if len(c)]).round(4).tolist() for name, clips in kinds.items()}
