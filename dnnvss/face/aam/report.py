"""What the encoding of a corpus is worth: errors of reconstruction, variance between clips, outliers."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from dnnvss import robust
from dnnvss.archives import Held, read_declared
from dnnvss.corpus import Corpus
from dnnvss.face.aam.code import ClipCode
from dnnvss.face.aam.model import ActiveAppearanceModel
from dnnvss.face.report import between_share, speech_span

OFF_COLOUR = 6.0
"""Robust standard deviations by which a clip's mean colour must differ from the others' to be reported."""


def build_report(
    model: ActiveAppearanceModel,
    corpus: Corpus,
    splits: Mapping[str, Sequence[str]],
    codes: Path,
    encoded: Sequence[str],
) -> dict[str, Any]:
    """Return plain containers that say how good an encoding is.

    ``reconstruction``: for each split the RMS distance of the points in pixels and the RMS difference of the texture
    in grey levels, with each clip's offsets and without. ``between_clips``: for each parameter the share of its
    variance over the train split that lies between clips (variance of the clip means over the total), over speech and
    over all frames, as used (clip means removed) and with the clip means put back. ``outliers``: for each utterance
    the frames that were left out, by reason. ``off_colour``: utterances whose mean colour is far from the others'.
    """
    read = {i: ClipCode.load(codes / f"{i}.npz") for i in encoded}
    train = [i for i in splits["train"] if i in read]
    return {
        "points": model.config.points.name, "kind": model.config.kind, "modes": model.size,
        "texture_pixels": len(model.mean_texture),
        "reconstruction": {name: _errors([codes / f"{i}.npz" for i in ids if i in read])
                           for name, ids in splits.items()},
        "between_clips": _between_clips(model, corpus, train, read),
        "outliers": {i: code.outliers for i, code in read.items() if code.outliers},
        "off_colour": _off_colour(read),
    }


def _errors(paths: Sequence[Path]) -> dict[str, float]:
    total = np.zeros((3, 2))
    for path in paths:
        total += read_declared(path, {"errors": Held(total.shape)}, "Run the command again")["errors"]
    rms = np.sqrt(total[:2] / np.maximum(total[2], 1))
    return {"pixels": round(float(rms[0, 0]), 4), "grey_levels": round(float(rms[0, 1]), 3),
            "pixels_without_offset": round(float(rms[1, 0]), 4),
            "grey_levels_without_offset": round(float(rms[1, 1]), 3), "frames": int(total[2, 0])}


def _between_clips(
    model: ActiveAppearanceModel, corpus: Corpus, train: Sequence[str], read: Mapping[str, ClipCode]
) -> dict[str, list[float]]:
    speech, whole, speech_back, whole_back = [], [], [], []
    for i in train:
        code = read[i]
        offset = model.project(code.shape_offset[None], code.texture_offset[None])
        spoken = np.zeros(len(code.valid), dtype=bool)
        spoken[speech_span(corpus.utterances[i], len(spoken))] = True
        speech.append(code.parameters[spoken & code.valid])
        whole.append(code.parameters[code.valid])
        speech_back.append(speech[-1] + offset)
        whole_back.append(whole[-1] + offset)
    kinds = {"speech": speech, "all_frames": whole, "speech_with_clip_means": speech_back,
             "all_frames_with_clip_means": whole_back}
    return {name: between_share([c for c in clips if len(c)]).round(4).tolist() for name, clips in kinds.items()}


def _off_colour(read: Mapping[str, ClipCode]) -> dict[str, list[float]]:
    """Return utterance to its mean colour less the others' (grey levels of red, green, blue), where that is far out."""
    colours = np.array([code.texture_offset.mean(axis=0, dtype=np.float64) for code in read.values()])
    centred = colours - np.median(colours, axis=0)
    spread = np.maximum(robust.spread(centred), 0.5)
    far = (np.abs(centred) > OFF_COLOUR * spread).any(axis=1)
    return {i: c.round(1).tolist() for i, c, out in zip(read, centred, far, strict=True) if out}
