"""An utterance as a face sees it: what is drawn again of its frames, what is left out, and the mesh on the video."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from dnnvss.corpus import Corpus, Utterance
from dnnvss.errors import DnnvssError
from dnnvss.face.aam import ActiveAppearanceModel, ClipCode, encode_clip, reconstruct
from dnnvss.face.aam.coding import frame_residuals
from dnnvss.face.base import APERTURE, Code, Face
from dnnvss.face.clips import corpus_clips
from dnnvss.face.kinds import face_kind
from dnnvss.media import SOUND_RATE, read_audio, read_video, write_video
from dnnvss.media.pictures import write_picture
from dnnvss.render.footage import Footage, Revoicer
from dnnvss.render.plots import plot_residual
from dnnvss.render.views import draw_mesh

_ZOOM, _BRIGHTER = 2.0, 4
_LINE = (255, 255, 255)


@dataclass(frozen=True)
class Seen:
    """An utterance under an active appearance model: its pictures (F, H, W_, 3), landmarks (F, L, 2) and code."""

    utterance: Utterance
    images: np.ndarray
    landmarks: np.ndarray
    code: ClipCode


def see(model: ActiveAppearanceModel, corpus: Corpus, name: str) -> Seen:
    """Return an utterance encoded with a model.

    Raises:
        DnnvssError: there is no such utterance.
    """
    utterance = _utterance(corpus, name)
    images = read_video(corpus.path(utterance, "video"))
    landmarks, valid = corpus.landmarks(utterance)
    code = encode_clip(model, images, landmarks, valid, float(utterance.rate), utterance.id)
    return Seen(utterance, images, landmarks, code)


def draw_reconstruction(path: Path, model: ActiveAppearanceModel, seen: Seen, count: int = 6) -> Path:
    """Write frames from the closest to the most open mouth: recorded, drawn, and their difference (x 4, about grey)."""
    valid = np.flatnonzero(seen.code.valid)
    openness = valid[np.argsort(model.gauges[APERTURE](seen.code.parameters[valid]), kind="stable")]
    frames = openness[np.linspace(0, len(openness) - 1, min(count, len(openness))).astype(int)]
    code = seen.code
    part = ClipCode(code.parameters[frames], code.pose[frames], code.shape_offset, code.texture_offset,
                    code.valid[frames])
    footage = Footage(seen.images[frames], part, seen.utterance.rate, seen.utterance.id)
    drawn = Revoicer(model, footage, np.arange(len(frames)), own_detail=False).frames(part.parameters)
    box = _box(reconstruct(model, part)[0], seen.images.shape[1:3])
    columns = []
    for image, again in zip(footage.images, drawn, strict=True):
        wrong = np.clip(128 + _BRIGHTER * (again.astype(int) - image), 0, 255).astype(np.uint8)
        columns.append(np.concatenate([_zoomed(p[box]) for p in (image, again, wrong)]))
    write_picture(path, np.concatenate(columns, axis=1))
    return path


def residuals(model: ActiveAppearanceModel, seen: Seen) -> dict[str, np.ndarray]:
    """Return what the model leaves out of each frame (F,): of the points in pixels, of the texture in grey levels."""
    pixels, grey = frame_residuals(model, seen.images, seen.landmarks, seen.code)
    return {"points, pixels": pixels, "texture, grey levels": grey}


def write_tracked(path: Path, model: ActiveAppearanceModel, seen: Seen, corpus: Corpus) -> Path:
    """Write the utterance with the mesh on it, as the landmarks have it; frames without usable ones are left bare."""
    def frames() -> list[np.ndarray]:
        pairs = zip(seen.images, model.modelled(seen.landmarks), seen.code.valid, strict=True)
        return [_meshed(image, model, points) if good else _large(image) for image, points, good in pairs]

    utterance = seen.utterance
    sound = read_audio(corpus.path(utterance, "audio"), SOUND_RATE) if utterance.audio else None
    return write_video(path, frames(), utterance.clock.rate, sound, SOUND_RATE)


def _meshed(image: np.ndarray, model: ActiveAppearanceModel, points: np.ndarray) -> np.ndarray:
    return draw_mesh(_large(image), model, points * _ZOOM, _LINE)


def _large(image: np.ndarray) -> np.ndarray:
    return cv2.resize(image, None, fx=_ZOOM, fy=_ZOOM, interpolation=cv2.INTER_CUBIC)


def _zoomed(image: np.ndarray) -> np.ndarray:
    return cv2.copyMakeBorder(_large(image), 2, 2, 2, 2, cv2.BORDER_CONSTANT, value=(255, 255, 255))


def _box(points: np.ndarray, size: tuple[int, int]) -> tuple[slice, slice]:
    low, high = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    margin = 0.15 * (high - low)
    left, top = np.maximum(low - margin, 0).astype(int)
    right, bottom = np.minimum(high + margin, size[::-1]).astype(int)
    return slice(top, bottom), slice(left, right)


def textured_figures(out: Path, model: ActiveAppearanceModel, corpus: Corpus, name: str) -> list[Path]:
    """Write how an appearance model sees an utterance and return the paths."""
    seen = see(model, corpus, name)
    return [draw_reconstruction(out / "reconstruction.png", model, seen),
            _plot_residuals(out, seen.utterance, seen.code, residuals(model, seen)),
            write_tracked(out / "tracked.mp4", model, seen, corpus)]


def points_figures(out: Path, face: Face, corpus: Corpus, name: str) -> list[Path]:
    """Write what a face without texture leaves out of an utterance's points, and return the path."""
    utterance, kind = _utterance(corpus, name), face_kind(face.kind)
    clip = corpus_clips(corpus, [utterance])[0]
    code = kind.encode(face, clip).code
    gap = kind.stabilise(face, clip.landmarks()[0], code) - face.points(code.parameters)
    left = {f"points, {face.unit}": np.sqrt((gap**2).sum(axis=-1).mean(axis=-1))}
    return [_plot_residuals(out, utterance, code, left)]


def _plot_residuals(out: Path, utterance: Utterance, code: Code, left: Mapping[str, np.ndarray]) -> Path:
    return plot_residual(out / "residual.png", left, utterance.clock.rate, code.valid, utterance.alignment["phones"],
                         utterance.text)


def _utterance(corpus: Corpus, name: str) -> Utterance:
    if name not in corpus.utterances:
        raise DnnvssError("is not in the corpus", utterance=name, file=corpus.root / "utterances.jsonl")
    return corpus.utterances[name]


def seen_figures(out: Path, face: Face, corpus: Corpus, name: str) -> list[Path]:
    """The figures of an utterance under a face of any kind, by path.

    Raises:
        DnnvssError: there is no such utterance.
    """
    if isinstance(face, ActiveAppearanceModel):
        return textured_figures(out, face, corpus, name)
    return points_figures(out, face, corpus, name)
